"""Section 2.1 and figure 2 of the paper: why the attitude of ETS-VII drifted away from its simulation.

The truth, from an independent simulator, has gravity gradient, momentum left in the wheels and an initial rate; the
simulation starts without the three. ``python -m studies.ets7_drift --full`` writes ``reports/ets7_drift.pdf``.
"""

from __future__ import annotations

from collections.abc import Sequence

from bayesid._io.progress import Progress, silent
from studies.common.command import Command
from studies.ets7_drift.analysis import CAUSES, Case, analyse
from studies.ets7_drift.report import write_report
from studies.ets7_drift.world import DURATION, SPREAD, draw_world

__all__ = ["CAUSES", "Case", "main", "run"]

LOOSE = 0.05
"""Relative width of the base's prior in the full run's second case: masses and moments are then known to a tenth."""


def run(
    *,
    full: bool = False,
    seed: int = 1,
    recordings: int | None = None,
    duration: float = DURATION,
    names: Sequence[str] | None = None,
    progress: Progress = silent,
) -> dict[str, Case]:
    """Run the study and return its cases by name: ``main`` and, in a full run, ``loose``.

    Parameters
    ----------
    full : bool
        True for three recordings, and for a second case in which the base is hardly known.
    seed : int
        Seed of all random numbers.
    recordings : int, optional
        Number of recordings, by default three in a full run and two in a quick one.
    duration : float
        Duration of each recording [s].
    names : sequence of str, optional
        Names of the candidates, by default the whole catalogue.
    progress : callable, optional
        Receives a fraction and a sentence, anew in every case.
    """
    world = draw_world(recordings or (3 if full else 2), seed, duration=duration)
    cases = {"main": analyse(world, SPREAD, seed, progress, names=names)}
    if full:
        cases["loose"] = analyse(world, LOOSE, seed, progress, names=names, compared=False)
    return cases


COMMAND = Command(
    "ets7_drift", "Name what makes the attitude of ETS-VII drift.", full="three recordings, and a harder case", seed=1
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    write_report(run(full=options.full, seed=options.seed), options.output)
