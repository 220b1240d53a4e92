"""Frames of the robot whose motion is limited or predicted."""

from __future__ import annotations

from dataclasses import dataclass

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.robot import Robot

__all__ = ["Tip"]


@dataclass(frozen=True)
class Tip:
    """A frame of the URDF: the joint that carries it and its pose (4, 4) in that joint's axes."""

    name: str
    joint: int
    placement: Floats

    @classmethod
    def of(cls, robot: Robot, name: str | None = None) -> Tip:
        """Return a frame by name; where left out, the last link's."""
        frames = {frame.name: frame for frame in robot.model.frames if frame.parentJoint > 0}
        if name is None:
            name = max(frames.values(), key=lambda frame: frame.parentJoint).name if robot.joints else robot.base
            last = [frame.name for frame in frames.values() if frame.parentJoint == frames[name].parentJoint]
            name = last[-1]
        if name not in frames:
            raise InputError(
                f"no frame named {name!r}",
                file=robot.file,
                place="design.tip_frame",
                remedy=f"Choose a link or joint of the URDF: {', '.join(frames)}",
            )
        frame = frames[name]
        return cls(name, frame.parentJoint - 2, frame.placement.homogeneous)
