"""Two causes that a first manoeuvre cannot tell apart, and the manoeuvre designed to separate them.

Momentum left in the wheels of a slowly drifting base makes a torque that is nearly constant; so does a leaking valve.
One of them is hidden with MuJoCo, both are fitted, and the Bayes factor is evaluated before and after the designed
manoeuvre. ``python -m studies.separating`` writes ``reports/separating.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import Search, Store
from bayesid.recording.joint_motion import Motion
from studies.common.command import Command
from studies.common.ets7 import START, FlightManoeuvre
from studies.ets7_limits.setting import DURATION, POINTS
from studies.separating.analysis import Result, diagnosed_causes, expectations, realise
from studies.separating.expected import pairs
from studies.separating.manoeuvres import design_both, separating_problem
from studies.separating.report import write_report

__all__ = ["Result", "main", "run"]

SEARCH = Search()
"""Effort of each design, minutes on two cores."""


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
        Seed of all random numbers.
    duration : float
        Duration of every manoeuvre [s].
    points : int
        Number of free control points of every joint.
    search : Search
        Effort of each design.
    noises : int
        Number of noisy recordings of every flight.
    diagnosed : bool
        True to run the package's diagnosis too.
    store : Store, optional
        Store that keeps the results of the searches.
    progress : callable, optional
        Receives a line on what is being done.
    """
    designs = design_both(separating_problem(duration, points), seed, search, store or Store.forgetful(), progress)
    motions: dict[str, Motion] = {"first": FlightManoeuvre(START)}
    motions |= {name: item.motion for name, item in designs.items()}
    expected, directions = expectations(motions, duration, seed)
    realised, sampled = realise(motions, duration, noises, seed, progress)
    verdicts = diagnosed_causes(motions, duration, seed, progress) if diagnosed else {}
    return Result(pairs(duration), designs, expected, directions, realised, sampled, verdicts, duration)


COMMAND = Command(
    "separating",
    "Tell apart what a first manoeuvre confuses.",
    seed=1,
    extra={"--store": {"type": Path, "help": "file that keeps the results of the searches, for an interrupted run"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    store = None if options.store is None else Store.open(options.store, f"separating {options.seed} {SEARCH}")
    write_report(run(seed=options.seed, store=store, progress=print), options.output)
