"""Section 4.3 of the paper, treatment of noise and sensor precision: what it expected, verified in three dimensions.

Joints differentiated twice, filtered, fitted; rates filtered; the accelerometer integrated or not; the linear method
and the integral one: bias and standard deviation of the base's ten parameters by Monte Carlo over data of an
independent simulator. ``python -m studies.sensors --full`` writes ``reports/sensors.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bayesid.app.compilation_cache import keep_compiled
from studies.common.command import Command
from studies.sensors.report import write_report
from studies.sensors.result import REALISTIC, Effort, Result, compute

__all__ = ["FULL", "SMALL", "Effort", "Result", "main", "run"]

SMALL = Effort(draws=8, ours=0, theirs=0, levels=("0.04 deg/s", REALISTIC))
FULL = Effort(draws=48, ours=5, theirs=32)


def run(
    *,
    full: bool = False,
    seed: int = 1,
    effort: Effort | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        All levels of noise, enough draws, and nonlinear fits: minutes.
    seed : int
        Every random number follows from it.
    effort : Effort, optional
        In place of what ``full`` says.
    progress : callable
        Told what is being done.
    """
    return compute(effort or (FULL if full else SMALL), seed, progress)


COMMAND = Command(
    "sensors",
    "Verify what the paper expects of noise and sensors.",
    full="all levels of noise, enough draws: minutes",
    seed=1,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    write_report(run(full=options.full, seed=options.seed, progress=print), options.output)
