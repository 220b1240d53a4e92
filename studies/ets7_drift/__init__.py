"""Section 2.1 and figure 2 of the paper: why the attitude of ETS-VII drifted away from its simulation.

The truth, from an independent simulator, has gravity gradient, momentum left in the wheels and an initial rate; the
simulation starts without the three. ``python -m studies.ets7_drift --full`` writes ``reports/ets7_drift.pdf``.
"""

from __future__ import annotations

from collections.abc import Sequence

from bayesid._io.progress import Progress, silent
from studies.common.command import Command
from studies.ets7_drift.analysis import CAUSES, Case, Result, analyse
from studies.ets7_drift.report import write_report
from studies.ets7_drift.world import DURATION, SPREAD, draw_world

__all__ = ["CAUSES", "Case", "Result", "main", "run"]

LOOSE = 0.05
"""Width of the base's prior in the full run's second case: the masses and moments are then known to a tenth."""


def run(
    *,
    full: bool = False,
    seed: int = 1,
    recordings: int | None = None,
    duration: float = DURATION,
    names: Sequence[str] | None = None,
    progress: Progress = silent,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        Three recordings, and a second case: a base hardly known.
    seed : int
        Every random number follows from it.
    recordings : int, optional
        Three in a full run and two in a quick one where left out.
    duration : float
        Of each recording [s].
    names : sequence of str, optional
        Candidates; the whole catalogue where left out.
    progress : callable, optional
        Told a fraction and a sentence, anew in every case.
    """
    count = recordings or (3 if full else 2)
    world = draw_world(count, seed, duration=duration)
    cases = {"main": analyse(world, SPREAD, seed, progress, names=names)}
    if full:
        cases["loose"] = analyse(world, LOOSE, seed, progress, names=names, compared=False)
    return Result(cases)


COMMAND = Command(
    "ets7_drift", "Name what makes the attitude of ETS-VII drift.", full="three recordings, and a harder case", seed=1
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    write_report(run(full=options.full, seed=options.seed), options.output)
