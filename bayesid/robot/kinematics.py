"""Motion of the joint frames relative to the base: poses with two derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, namespace
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot

__all__ = ["Kinematics", "Tip", "configuration", "hat", "joint_motion", "joint_twist", "kinematics"]


class Kinematics(NamedTuple):
    """Poses of the joint frames relative to the base and their first two derivatives, each (T, joints, 4, 4)."""

    pose: Floats
    rate: Floats
    acceleration: Floats


def kinematics(robot: Robot, state: JointState) -> Kinematics:
    """Return the motion of the joint frames by products of exponentials, of arrays of NumPy or of JAX.

    The pose of each joint is that of its parent, times a constant placement, times the exponential of its axis (Lynch &
    Park 2017, section 4.1); the derivatives follow by the product rule. Placements, axes and tree are Pinocchio's.

    Parameters
    ----------
    robot : Robot
    state : JointState
        State of all joints at T instants [rad or m].
    """
    xp = namespace(state.position)
    frames: list[tuple[Any, ...]] = []
    count = len(state.position)
    fixed, still = xp.broadcast_to(xp.eye(4), (count, 4, 4)), xp.zeros((count, 4, 4))
    for index, joint in enumerate(robot.joints):
        axis = xp.asarray(hat(joint_twist(robot, index)))
        q, speed, change = (part[:, index, None, None] for part in state)
        square = axis @ axis
        if joint.kind == "prismatic":
            turn = xp.eye(4) + q * axis
        else:
            turn = xp.eye(4) + xp.sin(q) * axis + (1.0 - xp.cos(q)) * square
        turn_rate = turn @ axis * speed
        turn_acceleration = turn @ (square * speed**2 + axis * change)
        parent = robot.model.parents[index + 2] - 2
        placement = xp.asarray(robot.model.jointPlacements[index + 2].homogeneous)
        pose, rate, acceleration = frames[parent] if parent >= 0 else (fixed, still, still)
        pose, rate, acceleration = pose @ placement, rate @ placement, acceleration @ placement
        frames.append(
            (
                pose @ turn,
                rate @ turn + pose @ turn_rate,
                acceleration @ turn + 2.0 * rate @ turn_rate + pose @ turn_acceleration,
            )
        )
    if not frames:
        return Kinematics(*np.zeros((3, count, 0, 4, 4)))
    pose, rate, acceleration = (xp.stack(parts, axis=1) for parts in zip(*frames, strict=True))
    return Kinematics(pose, rate, acceleration)


def configuration(robot: Robot, position: Floats) -> Floats:
    """Return Pinocchio's configuration of joint positions (joints,) with the base at the origin.

    Parameters
    ----------
    robot : Robot
    position : (joints,) array
        Joint positions [rad or m].
    """
    q = pin.neutral(robot.model)
    for index, value in enumerate(position):
        joint = robot.model.joints[index + 2]
        if joint.nq == 2:  # a continuous joint is stored as cosine and sine
            q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            q[joint.idx_q] = value
    return q


def joint_motion(motion: Kinematics, joint: int) -> tuple[Floats, Floats, Floats]:
    """Return the pose of a joint's frame with two derivatives, each (T, 4, 4); a negative index stands for the base.

    Parameters
    ----------
    motion : Kinematics
    joint : int
        Index into `Robot.joints`.
    """
    if joint < 0:
        still = np.zeros((len(motion.pose), 4, 4))
        return still + np.eye(4), still, still
    return motion.pose[:, joint], motion.rate[:, joint], motion.acceleration[:, joint]


def joint_twist(robot: Robot, joint: int) -> Floats:
    """Return the velocity of a joint's frame at unit speed of the joint, linear part first, in its axes, shape (6,).

    Parameters
    ----------
    robot : Robot
    joint : int
        Index into `Robot.joints`.
    """
    model = robot.model.joints[joint + 2]
    data = model.createData()
    model.calc(data, pin.neutral(robot.model), np.zeros(robot.model.nv))
    return np.asarray(data.S).ravel()


def hat(twist: Floats) -> Floats:
    """Return the 4x4 matrices of spatial velocities (..., 6), linear part first."""
    matrix = np.zeros((*twist.shape[:-1], 4, 4))
    x, y, z = np.moveaxis(twist[..., 3:], -1, 0)
    matrix[..., 0, 1], matrix[..., 0, 2] = -z, y
    matrix[..., 1, 0], matrix[..., 1, 2] = z, -x
    matrix[..., 2, 0], matrix[..., 2, 1] = -y, x
    matrix[..., :3, 3] = twist[..., :3]
    return matrix


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

        Parameters
        ----------
        robot : Robot
        name : str, optional
            Frame, such as a link.

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
            remedy = f"Choose a link or joint of the URDF: {', '.join(frames)}"
            raise InputError(f"no frame named {name!r}", file=robot.file, place="design.tip_frame", remedy=remedy)
        frame = frames[name]
        return cls(name, frame.parentJoint - 2, frame.placement.homogeneous)

    def motion(self, robot: Robot, state: JointState) -> tuple[Floats, Floats]:
        """Return the pose of the frame in the base and its derivative, each (T, 4, 4), for joint states at T instants.

        Arrays are NumPy's, or JAX's where the joint states are.

        Parameters
        ----------
        robot : Robot
        state : JointState
            Joint states, each of shape (T, joints).
        """
        pose, rate, _ = joint_motion(kinematics(robot, state), self.joint)
        return pose @ self.placement, rate @ self.placement
