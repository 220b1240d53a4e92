"""Joints that count the other way, or from another zero."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.robot.joint_state import JointState
from bayesid.simulation.model import Model

__all__ = ["JointSign", "JointZero"]

MOVES = 1e-2  # range of a joint's motion from which its sign can matter [rad or m]
ZEROS = np.deg2rad([-150.0, -120.0, -90.0, -60.0, -45.0, -30.0, 30.0, 45.0, 60.0, 90.0, 120.0, 150.0, 180.0])

STEPS = np.deg2rad([15.0, 5.0, 1.5, 0.5])  # refinement of a zero
SLIDES = np.array([-0.8, -0.4, -0.2, -0.1, 0.1, 0.2, 0.4, 0.8])  # zeros of prismatic joints [m]
ALIKE, ALIKE_SLIDES = np.deg2rad(5.0), 0.03  # differences of zeros that are not told apart [rad, m]


@MistakeFamily.register
class JointSign(MistakeFamily):
    """A joint whose angle counts the other way."""

    title = "signs of joints"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield each joint that moves."""
        for index, joint in enumerate(model.robot.joints):
            if np.ptp(readings.joints.position[:, index]) > MOVES:
                yield _other_way(index, joint.name, 1.0 / len(model.robot.joints))


def _other_way(index: int, name: str, share: float) -> Mistake:
    return Mistake(
        f"convention:sign:{name}",
        name,
        f"sign:{name}",
        2,
        lambda seen: _counted(seen, index, -1.0, 0.0),
        lambda seen: _stated(_counted(seen, index, -1.0, 0.0), name, "sign"),
        lambda seen: f"Joint {name} has the opposite sign to that in the robot's file.",
        share,
    )


@MistakeFamily.register
class JointZero(MistakeFamily):
    """A joint that counts from another zero."""

    title = "zeros of joints"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield usual zeros of every joint, which the search refines."""
        for index, joint in enumerate(model.robot.joints):
            offsets = ZEROS if joint.unit == "rad" else SLIDES
            for offset in offsets:
                share = 1.0 / len(offsets) / len(model.robot.joints)
                yield _zero_of(index, joint.name, float(offset), share, turns=joint.unit == "rad")


def _zero_of(index: int, name: str, offset: float, share: float, *, turns: bool) -> Mistake:
    """Return the mistake that a joint's position lacks an offset [rad or m]."""
    if turns:
        offset = float(np.pi - (np.pi - offset) % (2.0 * np.pi))  # within half a turn
    added = f"{np.rad2deg(offset):.3g} degrees to its angle" if turns else f"{offset:.3g} m to its position"

    def nearby(level: int) -> tuple[Mistake, ...]:
        step = STEPS[level] if turns else 0.25 * abs(offset) * 0.5**level
        return tuple(_zero_of(index, name, offset + sign * step, share, turns=turns) for sign in (1.0, -1.0))

    return Mistake(
        f"convention:zero:{name}",
        name,
        f"zero:{name}",
        3,
        lambda seen: _counted(seen, index, 1.0, offset),
        lambda seen: _stated(_counted(seen, index, 1.0, offset), name, "offset"),
        lambda seen: f"Joint {name} has a different zero: add {added}.",
        share,
        nearby=nearby,
        value=offset / (ALIKE if turns else ALIKE_SLIDES),
    )


def _counted(readings: ReadingsOnGrid, index: int, sign: float, offset: float) -> ReadingsOnGrid:
    parts: list[Floats] = []
    for order, values in enumerate(readings.joints):
        changed = np.array(values)
        changed[:, index] = sign * changed[:, index] + (offset if order == 0 else 0.0)
        parts.append(changed)
    name = readings.names[index]
    before = readings.recorded_as.joint(name)
    after = replace(before, sign=sign * before.sign, offset=sign * before.offset + offset)
    return readings.with_joints(JointState(*parts), {name: after})


def _stated(readings: ReadingsOnGrid, name: str, key: str) -> str:
    """Return the lines of the study that state the sign or the offset of a joint, or both where both are no default."""
    joint = readings.recorded_as.joint(name)
    lines = [f"sign = {joint.sign:.0f}"] if key == "sign" else []
    lines += [f"offset = {joint.offset:.6g}"] if key == "offset" or joint.offset else []
    return "\n".join([f'[joints."{name}"]', *lines])
