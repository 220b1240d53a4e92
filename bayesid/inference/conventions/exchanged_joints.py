"""Joints whose columns are exchanged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.robot.joint_state import JointState
from bayesid.simulation.model import Model

__all__ = ["ExchangedJoints"]


@MistakeFamily.register
class ExchangedJoints(MistakeFamily):
    """Two joints of one kind, each of which could make the other's motion."""

    title = "exchanged joints"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield the pairs."""
        joints, position = model.robot.joints, readings.joints.position
        low, high = position.min(axis=0), position.max(axis=0)
        pairs = [
            (a, b)
            for a, b in combinations(range(len(joints)), 2)
            if joints[a].unit == joints[b].unit
            and not np.array_equal(position[:, a], position[:, b])
            and all(joints[i].lower <= low[k] and high[k] <= joints[i].upper for i, k in ((a, b), (b, a)))
        ]
        for a, b in pairs:
            yield _exchanged(a, b, joints[a].name, joints[b].name, 1.0 / len(pairs))


def _exchanged(a: int, b: int, first: str, second: str, share: float) -> Mistake:
    def undo(readings: ReadingsOnGrid) -> ReadingsOnGrid:
        order = np.arange(readings.joints.position.shape[1])
        order[[a, b]] = b, a
        return replace(readings, joints=JointState(*(values[:, order] for values in readings.joints)))

    lines = (f'[joints."{x}"]\ncolumn = "position.{y}"' for x, y in ((first, second), (second, first)))
    remedy = "\n".join(lines)
    return Mistake(
        f"convention:exchanged:{first},{second}",
        f"{first},{second}",
        f"exchanged:{first},{second}",
        1,
        undo,
        lambda readings: remedy,
        lambda readings: f"The columns of joints {first} and {second} are exchanged.",
        share,
    )
