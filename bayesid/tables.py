"""Kinematic tables: the composite body's moments of mass as linear functions of every link's inertial parameters.

With ``T`` a link's pose in the base and ``J`` its pseudo-inertia, ``P = sum T J T'``, ``S = sum T J dT'`` and
``Q = sum T J d2T'`` hold everything the dynamics needs. Each is linear in the ten parameters of each link, so a
recording is reduced once to coefficient tables, and a simulation costs one rigid body however many links there are.
"""

from __future__ import annotations

from collections.abc import Container
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from bayesid.arrays import Floats
from bayesid.inertia import BASIS
from bayesid.motion import JointState
from bayesid.robot import Robot

__all__ = ["ENTRIES", "Kinematics", "composite_rows", "kinematics", "link_table"]


ENTRIES = {
    "mass": slice(0, 1),
    "first": slice(1, 4),  # first moment of mass about the base origin, then its two derivatives
    "first_rate": slice(4, 7),
    "first_acceleration": slice(7, 10),
    "second": slice(10, 16),  # second moment of mass: xx, yy, zz, xy, xz, yz
    "second_rate": slice(16, 22),
    "spin": slice(22, 25),  # angular momentum relative to the base, about its origin
    "spin_rate": slice(25, 28),
}
"""Columns of a table row."""

WIDTH = 28

_UPPER = ((0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2))


class Kinematics(NamedTuple):
    """Motion of the joint frames relative to the base, in base axes.

    pose (T, joints, 4, 4); twist and its derivative (T, joints, 6), linear part first, spatial (at the base origin).
    """

    pose: Floats
    twist: Floats
    twist_rate: Floats


def kinematics(robot: Robot, state: JointState) -> Kinematics:
    """Run Pinocchio's second-order forward kinematics with the base at rest."""
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
    rotation, offset = pose[..., :3, :3], pose[..., :3, 3]
    linear = np.einsum("tjab,otjb->otja", rotation, motion[..., :3])
    angular = np.einsum("tjab,otjb->otja", rotation, motion[..., 3:])
    linear += np.cross(np.broadcast_to(offset, angular.shape), angular)
    spatial = np.concatenate([linear, angular], axis=-1)
    return Kinematics(pose, spatial[0], spatial[1])


def configuration(robot: Robot, position: Floats) -> Floats:
    """Return Pinocchio's configuration for joint positions with the base at the origin."""
    q = pin.neutral(robot.model)
    for index, value in enumerate(position):
        joint = robot.model.joints[index + 2]
        if joint.nq == 2:  # a continuous joint is stored as cosine and sine
            q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
        else:
            q[joint.idx_q] = value
    return q


def link_table(robot: Robot, name: str, motion: Kinematics) -> Floats:
    """Coefficients of one link's ten parameters, shape (T, 28, 10)."""
    link = robot.link(name)
    pose, rate, acceleration = (change @ link.placement for change in _joint(motion, link.joint))
    table = np.swapaxes(_moments(pose, rate, acceleration, BASIS), 1, 2)
    return np.ascontiguousarray(table)


def _joint(motion: Kinematics, joint: int) -> tuple[Floats, Floats, Floats]:
    """Pose of a joint's frame and its two derivatives, each (T, 4, 4); of the base's where ``joint`` is negative."""
    if joint < 0:
        still = np.zeros((len(motion.pose), 4, 4))
        return still + np.eye(4), still, still
    twist, twist_rate = _hat(motion.twist[:, joint]), _hat(motion.twist_rate[:, joint])
    pose = motion.pose[:, joint]
    return pose, twist @ pose, (twist_rate + twist @ twist) @ pose


def _moments(pose: Floats, rate: Floats, acceleration: Floats, bodies: Floats) -> Floats:
    """Table rows of pseudo-inertias (p, 4, 4) moving with a pose, shape (T, p, 28)."""
    left = pose[:, None] @ bodies
    composite, flow, surge = (left @ np.swapaxes(other, 1, 2)[:, None] for other in (pose, rate, acceleration))
    rows = np.zeros((*composite.shape[:2], WIDTH))
    rows[..., ENTRIES["mass"]] = composite[..., 3, 3:]
    rows[..., ENTRIES["first"]] = composite[..., 3, :3]
    rows[..., ENTRIES["first_rate"]] = flow[..., 3, :3]
    rows[..., ENTRIES["first_acceleration"]] = surge[..., 3, :3]
    rows[..., ENTRIES["second"]] = composite[..., _UPPER[0], _UPPER[1]]
    rows[..., ENTRIES["second_rate"]] = (flow + np.swapaxes(flow, -1, -2))[..., _UPPER[0], _UPPER[1]]
    for entry, matrix in (("spin", flow), ("spin_rate", surge)):
        rows[..., ENTRIES[entry]] = np.stack(
            [matrix[..., a, b] - matrix[..., b, a] for a, b in ((1, 2), (2, 0), (0, 1))], axis=-1
        )
    return rows


def _hat(twist: Floats) -> Floats:
    """4x4 matrix of spatial velocities, linear part first."""
    matrix = np.zeros((*twist.shape[:-1], 4, 4))
    x, y, z = np.moveaxis(twist[..., 3:], -1, 0)
    matrix[..., 0, 1], matrix[..., 0, 2] = -z, y
    matrix[..., 1, 0], matrix[..., 1, 2] = z, -x
    matrix[..., 2, 0], matrix[..., 2, 1] = -y, x
    matrix[..., :3, 3] = twist[..., :3]
    return matrix


def composite_rows(robot: Robot, motion: Kinematics, leave_out: Container[str] = ()) -> Floats:
    """Table rows of all links with mass but the named ones, summed, shape (T, 28)."""
    carried: dict[int, Floats] = {}
    for name, link in robot.links.items():
        if name not in leave_out and link.inertial.mass > 0.0:
            body = link.placement @ link.inertial.pseudo_inertia @ link.placement.T
            carried[link.joint] = carried.get(link.joint, np.zeros((4, 4))) + body
    rows: Floats = np.zeros((len(motion.pose), WIDTH))
    for joint, moments in carried.items():
        rows = rows + _moments(*_joint(motion, joint), moments[None])[:, 0]
    return rows
