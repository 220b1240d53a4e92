"""Where the named causes act on the robot, for a picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Hypothesis
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.diagnosis.outcome.cause_sizes import vector_size
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.sensors import SensorKind

__all__ = ["CauseMark", "cause_marks"]

PLACES = ("cp", "position")
"""Names of the quantities of an effect that are a point of the base."""


class CauseMark(NamedTuple):
    """Mark of one cause.

    Attributes
    ----------
    label : str
        Name of the cause.
    point : (3,) array
        Where it acts, base frame [m]: the point of a force or a tank, a link's centre of mass, the accelerometer, or
        the base origin.
    direction : (3,) array or None
        Unit vector along a vector in base axes; None where it has none or its direction is not known.
    """

    label: str
    point: Floats
    direction: Floats | None


def cause_marks(hypothesis: Hypothesis, pose: Floats) -> list[CauseMark]:
    """Return a mark for every cause of a hypothesis, in the robot's pose (joints, 4, 4)."""
    effects = {effect.candidate: effect for effect in hypothesis.fit.effects}
    robot = hypothesis.fit.posterior.model.robot
    marks = []
    for label in hypothesis.labels:
        effect = effects.get(label)
        if effect is not None and effect.link is not None:
            marks.append(CauseMark(label, _centre(robot, effect.link, pose), None))
            continue
        place = _place(hypothesis, label)
        vector = vector_size(hypothesis, label) if place is None else None
        direction = vector.direction if vector is not None and vector.directed else None
        marks.append(CauseMark(label, _origin(hypothesis, effect) if place is None else place, direction))
    return marks


def _place(hypothesis: Hypothesis, label: str) -> Floats | None:
    """Return the point of the base that is among the quantities of a cause."""
    found = {item.quantity.name: item.mean for item in amplitudes_of(hypothesis, label)}
    for name in PLACES:
        keys = [f"{name}.{axis}" for axis in "xyz"]
        if all(key in found for key in keys):
            return np.array([found[key] for key in keys])
    return None


def _origin(hypothesis: Hypothesis, effect: Effect | None) -> Floats:
    """Return where the accelerometer is, for what is wrong with it, and the base origin otherwise."""
    model = hypothesis.fit.posterior.model
    if effect is not None and effect.name.startswith(f"{SensorKind.ACCEL.value}-"):
        for sensor in model.sensors:
            if sensor.kind is SensorKind.ACCEL:
                return np.asarray(sensor.position, dtype=float)
    return np.zeros(3)


def _centre(robot: Robot, name: str, pose: Floats) -> Floats:
    link = robot.link(name)
    carrier = np.eye(4) if link.joint < 0 else pose[link.joint]
    return np.asarray((carrier @ link.placement @ np.append(link.inertial.com, 1.0))[:3])
