"""The end-effector: a frame of the robot whose motion is limited or predicted."""

from __future__ import annotations

from dataclasses import dataclass

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import joint_motion, kinematics
from bayesid.robot.robot import Robot

__all__ = ["Tip"]


@dataclass(frozen=True)
class Tip:
    """End-effector of the robot, which is a frame of its URDF.

    Parameters
    ----------
    name : str
        Name of the frame.
    joint : int
        Index into `Robot.joints` of the joint that carries the frame; -1 for the base.
    placement : (4, 4) array
        Pose of the frame in that joint's axes.
    """

    name: str
    joint: int
    placement: Floats

    @classmethod
    def of(cls, robot: Robot, name: str | None = None) -> Tip:
        """Return the frame of a name, by default the last frame of the last link.

        Raises
        ------
        InputError
            If the robot has no frame of that name.
        """
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

    def motion(self, robot: Robot, state: JointState) -> tuple[Floats, Floats]:
        """Return the pose of the frame in the base and its derivative, each (T, 4, 4), for joint states at T instants.

        Arrays are NumPy's, or JAX's where the joint states are.
        """
        pose, rate, _ = joint_motion(kinematics(robot, state), self.joint)
        return pose @ self.placement, rate @ self.placement
