"""Two causes that a first manoeuvre cannot tell apart, and the manoeuvre designed to separate them.

Momentum left in the wheels of a slowly drifting base makes a torque that is nearly constant; so does a leaking valve.
One of them is hidden with MuJoCo, both are fitted, and the Bayes factor is taken before and after the designed
manoeuvre. ``python -m studies.separating`` writes ``reports/separating.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import Search, Store
from studies.common.command import Command
from studies.ets7_limits.setting import DURATION, POINTS
from studies.separating.analysis import STAGES, Result, design_stage, expectations, motions_of, realise
from studies.separating.pairs import pairs
from studies.separating.report import write_report
from studies.separating.verdicts import verdicts

__all__ = ["Result", "main", "run"]

SEARCH = Search(starts=2, iterations=50)


def run(
    *,
    seed: int = 1,
    duration: float = DURATION,
    points: int = POINTS,
    search: Search = SEARCH,
    noises: int = 10,
    diagnosed: bool = True,
    store: Store | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    seed : int
        Every random number follows from it.
    duration : float
        Of the designed manoeuvres [s].
    points : int
        Free control points of every joint.
    search : Search
    noises : int
        Recordings of every flight.
    diagnosed : bool
        Whether to ask `diagnose` too.
    store : Store, optional
        Keeps what the search found.
    """
    designs = design_stage(duration, points, seed, search, store or Store.forgetful(), progress)
    motions = motions_of(designs)
    expected, directions = expectations(motions, duration, seed)
    realised, sampled = realise(motions, duration, noises, seed, progress)
    found = verdicts(motions, STAGES, duration, seed, progress) if diagnosed else {}
    return Result(pairs(duration), designs, expected, directions, realised, sampled, found, duration)


COMMAND = Command(
    "separating",
    "Tell apart what a first manoeuvre confuses.",
    seed=1,
    extra={"--store": {"type": Path, "help": "file that keeps what the search found, for an interrupted run"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    store = None if options.store is None else Store.open(options.store, f"separating {options.seed} {SEARCH}")
    write_report(run(seed=options.seed, store=store, progress=print), options.output)
