"""Sensors of the base in other axes than declared: all turns by right angles, and their mirror images."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Floats
from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["SensorAxes", "right_angles"]

NORTH_EAST_DOWN = np.diag([1.0, -1.0, -1.0])
USUAL = 0.3  # share of the axes that people use: turned about x, and one axis or all counted the other way


def right_angles() -> list[Floats]:
    """Return the 48 signed permutations (3, 3), the identity first."""
    matrices = [
        np.eye(3)[list(order)] * np.array(signs)[:, None]
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    ]
    return sorted(matrices, key=lambda matrix: not np.array_equal(matrix, np.eye(3)))


@MistakeFamily.register
class SensorAxes(MistakeFamily):
    """Rate sensor or accelerometer in other axes."""

    title = "axes of sensors"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield the 47 other axes of each sensor."""
        for kind in readings.sensors:
            for turn in right_angles()[1:]:
                diagonal = np.array_equal(np.abs(turn), np.eye(3))
                yield _in_axes(kind, turn, USUAL / 7.0 if diagonal else (1.0 - USUAL) / 40.0)


def _in_axes(kind: SensorKind, turn: Floats, share: float) -> Mistake:
    parts = ("rate", "turning") if kind == SensorKind.RATE else (kind.value,)
    mirrored = np.linalg.det(turn) < 0.0
    shown = ", ".join(_axis(row) for row in turn)

    def undo(readings: ReadingsOnGrid) -> ReadingsOnGrid:
        return readings.with_sensor(kind, readings.sensors[kind].values @ turn.T)

    def remedy(readings: ReadingsOnGrid) -> str:
        matrix = readings.sensors[kind].axes @ turn * (-1.0 if mirrored else 1.0)
        quaternion = Rotation.from_matrix(matrix).as_quat(canonical=True) + 0.0
        lines = [f"[{kind.section}]", f"mounting = [{', '.join(f'{value:.9g}' for value in quaternion)}]"]
        return "\n".join([*lines, "reflected = true"] if mirrored else lines)

    def text(readings: ReadingsOnGrid) -> str:
        sensor = "gyro" if kind == SensorKind.RATE else kind.instrument.name
        if np.array_equal(turn, NORTH_EAST_DOWN):
            return (
                f"The axes of your {sensor} are turned by 180 degrees about x, as forward-right-down is from "
                "forward-left-up: its x, y, z are x, -y, -z of the declared axes."
            )
        left = " They are left-handed." if mirrored else ""
        return f"Your {sensor} uses other axes: x, y, z of the declared axes are its {shown}.{left}"

    return Mistake(
        f"convention:axes:{kind.value}", kind.value, f"axes:{kind.value}", 2, undo, remedy, text, share, parts
    )


def _axis(row: Floats) -> str:
    index = int(np.argmax(np.abs(row)))
    return f"{'-' if row[index] < 0.0 else ''}{'xyz'[index]}"
