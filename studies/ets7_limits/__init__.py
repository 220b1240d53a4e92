"""What ETS-VII itself could have identified within its flight rules, in what time, and with which sensors.

The d-optimal manoeuvre of `studies.excitation`, within 50 mm/s and 5 degrees a second at the tip, is taken from the
table beside that study's report. Its information is rescaled for other sensors, repeated, and evaluated with an arm
that is not known exactly, beside that of the flight's own manoeuvre. ``python -m studies.ets7_limits`` writes
``reports/ets7_limits.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid.app.compilation_cache import keep_compiled
from bayesid.recording.joint_motion import Motion
from studies.common import mission
from studies.common.quantities import HEADINGS
from studies.common.study import Command
from studies.ets7_limits.analysis import (
    ACCELS,
    DESIGN,
    RATES,
    USUAL,
    Answer,
    Widths,
    answers,
    designed_motion,
    information_of,
    read_rows,
    widths,
)

__all__ = ["Result", "main", "run"]

# numbers of repetitions at which the accuracy is drawn
REPETITIONS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5)


@dataclass(frozen=True)
class Result:
    """Content of the report."""

    motion: Motion  # the designed manoeuvre
    # answers by labels of rate and accelerometer, then by whether the arm and the bias are known
    answers: Mapping[tuple[str, str], Mapping[tuple[bool, bool], Answer]]
    after: Mapping[str, Widths]  # standard deviations from the ``designed`` manoeuvre and from that of the ``flight``
    repetitions: Sequence[float]  # numbers of repetitions of the curves
    # largest relative standard deviations by manoeuvre and whether the arm is known
    curves: Mapping[tuple[str, bool], Sequence[float]]
    # largest relative difference of the standard deviations from those that `studies.excitation` states
    difference: float
    # number of flights of the same manoeuvre in `studies.excitation`, and smallest and largest ratio of realised to
    # predicted errors
    realised: tuple[int, float, float]


def run(
    folder: Path,
    *,
    rates: Sequence[str] = tuple(RATES),
    accels: Sequence[str] = tuple(ACCELS),
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    folder : Path
        Folder with the tables of `studies.excitation`.
    rates, accels : sequence of str
        Labels of the sensors.
    progress : callable
        Receives a line on what is being done.
    """
    motion = designed_motion(folder / "excitation-manoeuvres.csv")
    information = information_of(motion)
    table = answers(information["designed"], rates, {label: ACCELS[label] for label in accels}, progress)
    curves = {
        (name, known): [own.repeated(USUAL, known).worst(count) for count in REPETITIONS]
        for name, own in information.items()
        for known in (True, False)
    }
    after = {name: widths(own) for name, own in information.items()}
    return Result(motion, table, after, REPETITIONS, curves, _difference(after["designed"], folder), _realised(folder))


def _difference(after: Widths, folder: Path) -> float:
    """Return the largest relative difference from the standard deviations in the table of `studies.excitation`."""
    stated = {row["arm"]: row for row in read_rows(folder / "excitation-predicted.csv") if row["manoeuvre"] == DESIGN}
    found = dict(zip(mission.ROWS, (after.uncertain, after.exact), strict=True))
    values = {arm: np.array([float(row[f"sd {heading}"]) for heading in HEADINGS]) for arm, row in stated.items()}
    return float(max(np.abs(found[arm] / values[arm] - 1.0).max() for arm in mission.ROWS))


def _realised(folder: Path) -> tuple[int, float, float]:
    row = next(row for row in read_rows(folder / "excitation-realised.csv") if row["manoeuvre"] == DESIGN)
    ratios = [float(row[f"rms / predicted sd, {heading}"]) for heading in HEADINGS]
    return int(row["flights"]), min(ratios), max(ratios)


COMMAND = Command(
    "ets7_limits",
    "Say what ETS-VII could have identified within its rules.",
    extra={"--tables": {"type": Path, "default": Path("reports"), "help": "folder with the tables of excitation"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    from studies.common.provenance import MODELS, study_origin
    from studies.ets7_limits.report import write_report

    options = COMMAND.parse(arguments)
    keep_compiled()
    inputs = [MODELS / "ets7.urdf", options.tables / "excitation-manoeuvres.csv"]
    result = run(options.tables, progress=lambda text: print(text, flush=True))
    write_report(result, options.output, study_origin("ets7_limits", options, inputs))
