"""Gravity in the readings of the accelerometer, as on the ground: constant in its axes, or in space."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.reading_units import in_unit
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.recording.units import STANDARD_GRAVITY, UNITS
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["GravityInReadings"]

TOLERANCE = 0.02  # relative difference from standard gravity on the ground, by the place and the instrument's scale


@MistakeFamily.register
class GravityInReadings(MistakeFamily):
    """Readings whose mean is gravity, whose size says their unit."""

    title = "gravity in accelerations"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield gravity constant in the sensor's axes, and constant in space, where the readings hold it."""
        accelerometer = readings.sensors.get(SensorKind.ACCEL)
        if accelerometer is None:
            return
        for fixed in ("sensor", "space"):
            size = float(np.linalg.norm(_gravity(readings, fixed)[0]))
            for unit, factor in UNITS["accel"].items():
                if abs(size * factor / STANDARD_GRAVITY - 1.0) < TOLERANCE:
                    gravity = _with_gravity(fixed)
                    in_other = in_unit(SensorKind.ACCEL, unit, factor, gravity.share)
                    yield gravity if factor == 1.0 else Mistake.together(in_other, gravity)


def _gravity(readings: ReadingsOnGrid, fixed: str) -> tuple[Floats, Floats]:
    """Return gravity at the first instant (3,) and at all (n, 3), sensor axes, in the unit of the readings."""
    accelerometer = readings.sensors[SensorKind.ACCEL]
    values = accelerometer.values[accelerometer.present]
    if fixed == "sensor":
        mean = _along_an_axis(values)
        return mean, np.broadcast_to(mean, accelerometer.values.shape)
    turned = readings.turned @ accelerometer.axes  # from sensor axes to base axes at the first instant
    first = np.median(np.einsum("tij,tj->ti", turned, accelerometer.values)[accelerometer.present], axis=0)
    return accelerometer.axes.T @ first, np.einsum("tij,i->tj", turned, first)


def _along_an_axis(values: Floats) -> Floats:
    """Return the median of readings (n, 3), or standard gravity along the axis that is as near as the readings vary.

    The motion is in the median, too, and what it leaves would be taken for a bias.
    """
    median = np.asarray(np.median(values, axis=0))
    axis = int(np.argmax(np.abs(median)))
    plumb = np.sign(median[axis]) * STANDARD_GRAVITY * np.eye(3)[axis]
    spread = np.median(np.abs(values - median), axis=0)
    return plumb if (np.abs(median - plumb) < spread).all() else median


def _with_gravity(fixed: str) -> Mistake:
    def undo(readings: ReadingsOnGrid) -> ReadingsOnGrid:
        return readings.with_sensor(
            SensorKind.ACCEL, readings.sensors[SensorKind.ACCEL].values - _gravity(readings, fixed)[1]
        )

    def remedy(readings: ReadingsOnGrid) -> str:
        vector = ", ".join(f"{value:.6g}" for value in _gravity(readings, fixed)[0])
        lines = ["[sensors.accel]", f"gravity = [{vector}]"]
        return "\n".join([*lines, 'gravity_fixed_in = "space"'] if fixed == "space" else lines)

    def text(readings: ReadingsOnGrid) -> str:
        size = float(np.linalg.norm(_gravity(readings, fixed)[0]))
        where = "the sensor's axes" if fixed == "sensor" else "space"
        return f"The accelerometer reads gravity, {size:.4g} m/s2, constant in {where}: it was recorded on the ground."

    return Mistake("convention:gravity:accel", "accel", "gravity:accel", 1, undo, remedy, text, 0.5, ("accel",))
