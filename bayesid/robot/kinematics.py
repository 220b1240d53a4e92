"""Motion of the joint frames relative to the base: poses with two derivatives, by Pinocchio or in JAX."""

from __future__ import annotations

from typing import NamedTuple, cast

import jax.numpy as jnp
import numpy as np
import pinocchio as pin
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot

__all__ = ["Kinematics", "configuration", "joint_motion", "joint_twist", "kinematics", "traced_kinematics"]


class Kinematics(NamedTuple):
    """Poses of the joint frames relative to the base and their first two derivatives, each (T, joints, 4, 4)."""

    pose: Floats
    rate: Floats
    acceleration: Floats


def kinematics(robot: Robot, state: JointState) -> Kinematics:
    """Return the motion of the joint frames: by Pinocchio, or of arrays of JAX by `traced_kinematics`."""
    return _kinematics(robot, state) if isinstance(state.position, np.ndarray) else traced_kinematics(robot, state)


def _kinematics(robot: Robot, state: JointState) -> Kinematics:
    """Return the motion of the joint frames by Pinocchio's second-order forward kinematics, with the base at rest."""
    model, data = robot.model, robot.model.createData()
    count, joints = state.position.shape
    pose = np.tile(np.eye(4), (count, joints, 1, 1))
    motion = np.zeros((2, count, joints, 6))
    velocity, acceleration = np.zeros(model.nv), np.zeros(model.nv)
    for row in range(count):
        q = configuration(robot, state.position[row])
        velocity[6:], acceleration[6:] = state.velocity[row], state.acceleration[row]
        pin.forwardKinematics(model, data, q, velocity, acceleration)
        for joint in range(joints):
            placement = data.oMi[joint + 2]
            pose[row, joint, :3, :3], pose[row, joint, :3, 3] = placement.rotation, placement.translation
            motion[0, row, joint], motion[1, row, joint] = data.v[joint + 2].vector, data.a[joint + 2].vector
    twist, twist_rate = _hat(motion)  # in the axes of the joint itself
    return Kinematics(pose, pose @ twist, pose @ (twist_rate + twist @ twist))


def traced_kinematics(robot: Robot, state: JointState) -> Kinematics:
    """Return the motion of the joint frames by products of exponentials in JAX, which can be differentiated.

    The pose of each joint is that of its parent, times a constant placement, times the exponential of its axis (Lynch &
    Park 2017, section 4.1); the derivatives follow by the product rule.
    """
    frames: list[tuple[Array, ...]] = []
    still = jnp.zeros((len(state.position), 4, 4))
    for index in range(len(robot.joints)):
        axis = jnp.asarray(_hat(joint_twist(robot, index)))
        q, speed, change = (part[:, index, None, None] for part in state)
        turn = jnp.eye(4) + jnp.sin(q) * axis + (1.0 - jnp.cos(q)) * (axis @ axis)
        if robot.joints[index].kind == "prismatic":
            turn = jnp.eye(4) + q * axis
        turn_rate = turn @ axis * speed
        turn_acceleration = turn @ axis @ axis * speed**2 + turn @ axis * change
        parent = robot.model.parents[index + 2] - 2
        pose, rate, acceleration = frames[parent] if parent >= 0 else (still + jnp.eye(4), still, still)
        pose, rate, acceleration = (
            part @ jnp.asarray(robot.model.jointPlacements[index + 2].homogeneous)
            for part in (pose, rate, acceleration)
        )
        frames.append(
            (
                pose @ turn,
                rate @ turn + pose @ turn_rate,
                acceleration @ turn + 2.0 * rate @ turn_rate + pose @ turn_acceleration,
            )
        )
    pose, rate, acceleration = (jnp.stack(parts, axis=1) for parts in zip(*frames, strict=True))
    return Kinematics(*cast("tuple[Floats, Floats, Floats]", (pose, rate, acceleration)))


def configuration(robot: Robot, position: Floats) -> Floats:
    """Return Pinocchio's configuration of joint positions (joints,) with the base at the origin."""
    q = pin.neutral(robot.model)
    for index, value in enumerate(position):
        joint = robot.model.joints[index + 2]
        if joint.nq == 2:  # a continuous joint is stored as cosine and sine
            q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            q[joint.idx_q] = value
    return q


def joint_motion(motion: Kinematics, joint: int) -> tuple[Floats, Floats, Floats]:
    """Return the pose of a joint's frame with two derivatives, each (T, 4, 4); a negative index stands for the base."""
    if joint < 0:
        still = np.zeros((len(motion.pose), 4, 4))
        return still + np.eye(4), still, still
    return motion.pose[:, joint], motion.rate[:, joint], motion.acceleration[:, joint]


def joint_twist(robot: Robot, joint: int) -> Floats:
    """Return the velocity of a joint's frame at unit speed of the joint, linear part first, in its axes, shape (6,)."""
    model = robot.model.joints[joint + 2]
    data = model.createData()
    model.calc(data, pin.neutral(robot.model), np.zeros(robot.model.nv))
    return np.asarray(data.S).ravel()


def _hat(twist: Floats) -> Floats:
    """Return the 4x4 matrices of spatial velocities (..., 6), linear part first."""
    matrix = np.zeros((*twist.shape[:-1], 4, 4))
    x, y, z = np.moveaxis(twist[..., 3:], -1, 0)
    matrix[..., 0, 1], matrix[..., 0, 2] = -z, y
    matrix[..., 1, 0], matrix[..., 1, 2] = z, -x
    matrix[..., 2, 0], matrix[..., 2, 1] = -y, x
    matrix[..., :3, 3] = twist[..., :3]
    return matrix
