"""Joints that a study names, which the robot must have."""

from __future__ import annotations

from pathlib import Path

from bayesid._io.errors import InputError
from bayesid.app.schema.validation_messages import suggest
from bayesid.robot.robot import Robot

__all__ = ["named_joint"]


def named_joint(name: str, robot: Robot, place: str, file: Path | None = None) -> int:
    """Return the index in `Robot.joints` of the joint that a study names at a place of its file.

    Raises
    ------
    InputError
        If the robot has no moving joint of that name.
    """
    names = [joint.name for joint in robot.joints]
    if name not in names:
        hint = suggest(name, names)
        raise InputError(
            f"the robot has no moving joint '{name}'",
            file=file,
            place=place,
            remedy=hint or (f"Choose one of {', '.join(names)}" if names else "Take it out"),
        )
    return names.index(name)
