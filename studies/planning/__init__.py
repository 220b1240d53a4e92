"""Section 1.1.1 of the paper: what identification buys the planner of a free-flying robot.

A path planned in joint space ends elsewhere if the base is not what the planner takes it for. An independent simulator
flies the plan; the prediction says beforehand how far off it may end, before and after identification, and a plan made
with the identified base is flown too. ``python -m studies.planning --full`` writes ``reports/planning.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from studies.common.command import Command
from studies.planning.analysis import Case, analyse
from studies.planning.calibration import calibrate
from studies.planning.report import Result, write_report
from studies.planning.world import DURATION, SPREAD, drawn_guess, paper_guess

__all__ = ["Case", "Result", "main", "run"]

GUESSES = 80
"""Of the base, in a full run, over which the regions before identification are counted."""

NARROW = 0.02
"""Relative width of a prior under which final poses are nearly normal."""


def run(
    *,
    full: bool = False,
    seed: int = 1,
    draws: int = 400,
    effective_samples: float = 1500.0,
    duration: float = DURATION,
    progress: Callable[[str], None] | None = None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        Also start from the paper's own initial guess, which is far away.
    seed : int
        Every random number follows from it.
    draws : int
        Of each prediction.
    effective_samples : float
        Of each identification.
    duration : float
        Of the planned path [s].
    progress : callable, optional
        Told what is being done.
    """
    guesses = {"drawn": drawn_guess(seed)}
    if full:
        guesses["paper"] = paper_guess()
    cases = {
        name: analyse(guess, seed, draws, effective_samples, duration, progress or (lambda text: None))
        for name, guess in guesses.items()
    }
    first = cases["drawn"].first
    count = GUESSES if full else GUESSES // 4
    found = [
        calibrate(first.goal, first.flown, duration, spread, guesses=count, draws=draws // 2, seed=seed)
        for spread in (SPREAD, NARROW)
    ]
    return Result(cases, tuple(found))


COMMAND = Command(
    "planning", "Say what identification buys the planner.", full="also from the paper's initial guess", seed=1
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    write_report(run(full=options.full, seed=options.seed, progress=print), options.output)
