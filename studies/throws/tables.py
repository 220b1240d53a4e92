"""Further tables of the study, written as CSV beside its report in SI units."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from studies.common.template import write_table
from studies.throws.left_over import CHANNELS, PHASES
from studies.throws.shaking import following, shaken_axis

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["write_tables"]

SETS = 10
"""Number of sets of causes that are listed of each body."""

AXES = tuple(f"{sensor} {axis}" for sensor in ("gyro", "accelerometer") for axis in "xyz")

Row = tuple[object, ...]


def write_tables(output: Path, result: Result) -> list[str]:
    """Write the tables beside a report and return the names of their files."""
    files = [
        write_table(
            output,
            "moments",
            ["model", "throw", "moment", "stated [kg m2]", "found [kg m2]", "formal sd [kg m2]"],
            _moment_rows(result),
        ),
        write_table(
            output,
            "bodies",
            [
                *("body", "throws", "torque sd [N m]", "rms / sd of the torque", "force sd [m/s2]"),
                *(f"noise in flight / at rest, {axis}" for axis in AXES),
                *("wheel [Hz]", "loudest order", "throws with it", "axis", "amplitude [m/s2]", "beside it [m/s2]"),
                "force [N]",
            ],
            _body_rows(result),
        ),
        write_table(
            output,
            "residuals",
            ["body", "channel", "rms", "rms at rest", "loudest [Hz]", *PHASES, *(f"imbalance, {p}" for p in PHASES)],
            _residual_rows(result),
        ),
        write_table(output, "device", ["error", "mean", "formal sd"], _device_rows(result)),
    ]
    if result.studies:
        header = ["diagnosis", "body", "probability", "log evidence", "causes"]
        files.append(write_table(output, "causes", header, _cause_rows(result)))
    return files


def _moment_rows(result: Result) -> Iterator[Row]:
    for analysis in (result.plain, result.extended):
        for body in analysis.bodies.values():
            for throw, found, sd in zip(body.throws, body.moments, body.formal, strict=True):
                for k, name in enumerate(("smallest", "middle", "largest")):
                    yield analysis.label, throw, name, *map(_digits, (body.truth[k], found[k], sd[k]))


def _body_rows(result: Result) -> Iterator[Row]:
    for name, own in result.extended.left.items():
        widths = result.extended.widths[name]
        torque, force = widths["smooth-torque"], widths["smooth-force"]
        order, there, beside = own.turn
        axis = shaken_axis(own)
        numbers = (torque.sd, torque.ratio, force.sd, *result.extended.noise[name], own.wheel[1], order)
        felt = (there[axis], beside[axis], result.masses[name] * there[axis])
        yield (
            *(name, len(own.names), *map(_digits, numbers), following(own, result.pairs)),
            *(CHANNELS[axis][-1], *map(_digits, felt)),
        )


def _residual_rows(result: Result) -> Iterator[Row]:
    for name, own in result.extended.left.items():
        for c, channel in enumerate(AXES):
            numbers = (own.rms[c], own.quiet[c], own.loudest(c), *own.phase[:, c], *own.shaken[:, c])
            yield name, channel, *map(_digits, numbers)


def _device_rows(result: Result) -> Iterator[Row]:
    for name, (mean, sd) in result.extended.calibration.items():
        yield name, _digits(mean), _digits(sd)


def _cause_rows(result: Result) -> Iterator[Row]:
    found = [("as recorded", study.body, study.diagnosis) for study in result.studies]
    found += [("wheel dropped", body, diagnosis) for body, diagnosis in result.wheels.items()]
    for title, body, diagnosis in found:
        for item in diagnosis.probabilities.sets[:SETS]:
            numbers = (_digits(item.probability), _digits(item.log_evidence))
            yield title, body, *numbers, " + ".join(item.names) or "nothing"


def _digits(value: float | np.floating) -> str:
    return f"{float(value):.6g}"
