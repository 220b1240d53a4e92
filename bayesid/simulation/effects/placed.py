"""Effects at a place of the robot, a link or a joint, whose name follows a colon in the label."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

from bayesid._io.errors import InputError
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect, Situation

__all__ = ["OnJoint", "Placed"]


class Placed(Effect):
    """Effect at a link or a joint."""

    def __init__(self, place: str = "") -> None:
        if not place:
            raise InputError(
                f"effect {self.name!r} does not state its place",
                remedy=f"Write {self.name}:NAME, with a name of the URDF",
            )
        self.place = place

    @property
    def label(self) -> str:
        """Name of the effect and of its place, separated by a colon."""
        return f"{self.name}:{self.place}"


class OnJoint(Placed):
    """Effect at one joint."""

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect at every moving joint."""
        return [cls(joint.name).attach(model.robot) for joint in model.robot.joints]

    def attach(self, robot: Robot) -> Self:
        """Return the effect after a check that the robot has the joint."""
        self.index_in(robot)
        return self

    def index_in(self, robot: Robot) -> int:
        """Return the index of the joint in `Robot.joints`."""
        names = [joint.name for joint in robot.joints]
        if self.place not in names:
            raise InputError(
                f"effect {self.label!r}: no moving joint {self.place!r}", remedy=f"Joints: {', '.join(names)}"
            )
        return names.index(self.place)
