"""Two causes that a first manoeuvre cannot tell apart, and the manoeuvre designed to separate them.

Momentum left in the wheels of a slowly drifting base makes a torque that is nearly constant; so does a leaking valve.
One of them is hidden with MuJoCo, both are fitted, and the Bayes factor is evaluated before and after the designed
manoeuvre. ``python -m studies.separating`` writes ``reports/separating.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import THOROUGH, Search, Store
from bayesid.recording.joint_motion import Motion
from studies.common import mission
from studies.common.study import TRIALS, Command
from studies.separating.analysis import Realised, expectations, realise, references
from studies.separating.linear_evidence import Expected
from studies.separating.manoeuvres import Designed, design_both, separating_problem

__all__ = ["FLIGHTS", "Result", "main", "run"]

FLIGHTS = 400  # number of sets of flights for each cause in a full run
FULL, QUICK = THOROUGH, Search(starts=3, iterations=60)  # effort of each search of a full and of a quick run


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    designs: Mapping[str, Designed]  # designed manoeuvres by their criterion
    motions: Mapping[str, Motion]  # all manoeuvres, the ``first`` among them
    expected: Mapping[tuple[str, str], Expected]  # expectations of linear theory
    # expectations for effects of the same size in random directions
    directions: Mapping[tuple[str, str], Sequence[Expected]]
    realised: Sequence[Realised]  # realised log Bayes factors, one for each truth
    search: Search  # effort of each search
    full: bool


def run(
    *,
    full: bool = False,
    seed: int = 1,
    points: int = mission.POINTS,
    search: Search | None = None,
    noises: int | None = None,
    store: Store | None = None,
    trials: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        True for the thorough effort of each search and `FLIGHTS` sets of flights for each truth.
    seed : int
        Seed of all random numbers.
    points : int
        Number of free control points of every joint.
    search : Search, optional
        Effort of each design.
    noises : int, optional
        Number of sets of flights for each truth.
    store : Store, optional
        Store that keeps the results of the searches.
    trials : path, optional
        File that keeps the flights.
    progress : callable, optional
        Receives a line on what is being done.
    """
    search = search or (FULL if full else QUICK)
    noises = (FLIGHTS if full else 40) if noises is None else noises
    designs = design_both(separating_problem(points), seed, search, store or Store.forgetful(), progress)
    motions: dict[str, Motion] = {"first": mission.flight_manoeuvre()}
    motions |= {name: item.motion for name, item in designs.items()}
    known = references(motions)
    expected, directions = expectations(known, seed)
    realised = realise(motions, known, noises, seed, trials, progress)
    return Result(designs, motions, expected, directions, realised, search, full and noises >= FLIGHTS)


COMMAND = Command(
    "separating",
    "Tell apart what a first manoeuvre confuses.",
    full=f"the thorough effort of each search, {FLIGHTS} sets of flights for each cause",
    seed=1,
    extra={
        "--store": {"type": Path, "help": "file that keeps the results of the searches, for an interrupted run"},
        "--flights": {"type": int, "help": "number of sets of flights for each cause"},
        "--trials": TRIALS["--trials"],
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    from studies.common.provenance import study_origin
    from studies.separating.report import write_report

    options = COMMAND.parse(arguments)
    keep_compiled()
    effort = FULL if options.full else QUICK
    store = None if options.store is None else Store.open(options.store, f"separating {options.seed} {effort}")
    result = run(
        full=options.full,
        seed=options.seed,
        noises=options.flights,
        store=store,
        trials=options.trials,
        progress=lambda text: print(text, flush=True),
    )
    write_report(result, options.output, study_origin("separating", options))
