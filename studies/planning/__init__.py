"""Section 1.1.1 of the paper: what the planner of a free-flying robot gains by identification.

A path planned in joint space ends elsewhere if the base is not what the planner takes it for. An independent simulator
flies the plan; the prediction says beforehand how far off it may end, before and after identification, and a plan made
with the identified base is flown too. ``python -m studies.planning --full`` writes ``reports/planning.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from studies.common.command import WORKERS, Command
from studies.common.monte_carlo import Workers
from studies.planning.analysis import Case, analyse
from studies.planning.calibration import calibrate
from studies.planning.report import Result, write_report
from studies.planning.world import DURATION, SPREAD, drawn_guess, paper_guess

__all__ = ["Case", "Result", "main", "run"]

GUESSES = 80
"""Number of guesses of the base in a full run, over which the regions before identification are counted."""

NARROW = 0.02
"""Relative width of a prior under which final poses are nearly normal."""


def run(
    *,
    full: bool = False,
    seed: int = 1,
    draws: int = 400,
    effective_samples: float = 1500.0,
    duration: float = DURATION,
    store: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        True to start from the paper's initial guess too, which is far away.
    seed : int
        Seed of all random numbers.
    draws : int
        Number of draws of each prediction.
    effective_samples : float
        Effective sample size of each identification.
    duration : float
        Duration of the planned path [s].
    store : path, optional
        File that keeps the trials of the calibration, see `studies.common.monte_carlo`.
    workers : int or Executor
        Number of processes for these trials.
    progress : callable, optional
        Receives a line on what is being done.
    """
    guesses = {"drawn": drawn_guess(seed)} | ({"paper": paper_guess()} if full else {})
    cases = {
        name: analyse(guess, seed, draws, effective_samples, duration, progress) for name, guess in guesses.items()
    }
    calibration = calibrate(
        cases["drawn"].first,
        duration,
        (SPREAD, NARROW),
        guesses=GUESSES if full else GUESSES // 4,
        draws=draws // 2,
        seed=seed,
        store=store,
        workers=workers,
        progress=progress,
    )
    return Result(cases, calibration)


COMMAND = Command(
    "planning",
    "Say what a planner gains by identification.",
    full="also from the paper's initial guess",
    seed=1,
    extra={
        "--trials": {"type": Path, "help": "file that keeps the trials of the calibration between runs"},
        **WORKERS,
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    result = run(full=options.full, seed=options.seed, store=options.trials, workers=options.workers, progress=print)
    write_report(result, options.output)
