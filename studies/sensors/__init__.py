"""Section 4.3 of the paper, treatment of noise and sensor precision: its expectations, verified in three dimensions.

Joints are differentiated twice, filtered or fitted; rates are filtered; the accelerometer is integrated or not; the
linear method and the integral one are compared. Monte Carlo over data of an independent simulator gives the bias and
the standard deviation of the base's ten parameters. ``python -m studies.sensors --full`` writes
``reports/sensors.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bayesid.app.compilation_cache import keep_compiled
from studies.common.monte_carlo import Workers
from studies.common.provenance import study_origin
from studies.common.study import TRIALS, Command
from studies.sensors.report import write_report
from studies.sensors.result import REALISTIC, Effort, Result, compute

__all__ = ["FULL", "SMALL", "Effort", "Result", "main", "run"]

SMALL = Effort(draws=8, levels=("0.04 deg/s", REALISTIC))
"""Effort of the short study, which takes a minute."""

FULL = Effort(draws=48, likelihood_fits=5, paper_fits=32)
"""Effort of the full study, which takes minutes."""


def run(
    *,
    full: bool = False,
    seed: int = 1,
    effort: Effort | None = None,
    trials: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        Whether to take all levels of noise, enough draws, and nonlinear fits.
    seed : int
        Seed of all random numbers.
    effort : Effort, optional
        Effort in place of what ``full`` says.
    trials, workers
        File and number of processes of the nonlinear fits; see `studies.common.monte_carlo.run_trials`.
    progress : callable
        Receives a line on what is being done.
    """
    return compute(effort or (FULL if full else SMALL), seed, trials, workers, progress)


COMMAND = Command(
    "sensors",
    "Verify what the paper expects of noise and sensors.",
    full="take all levels of noise, enough draws, and nonlinear fits: minutes",
    seed=1,
    extra=TRIALS,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    result = run(full=options.full, seed=options.seed, trials=options.trials, workers=options.workers, progress=print)
    write_report(result, options.output, origin=study_origin(COMMAND.name, options))
