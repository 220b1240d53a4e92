"""Kinematic tables: the composite body's moments of mass as linear functions of every link's inertial parameters.

With ``T`` the pose of a link in the base and ``J`` its pseudo-inertia, ``P = sum T J T'``, ``S = sum T J dT'`` and
``Q = sum T J d2T'`` hold all that the dynamics needs. Each is linear in the ten parameters of each link, so that a
recording is reduced once to tables of coefficients, and a simulation costs as much as one rigid body, however many
links there are.

A unit displacement of joint j moves every body beyond it by its screw, ``dT = X T`` with ``X = T_j [axis] T_j^-1`` in
base axes. With ``P``, ``S`` and ``Q`` summed over these bodies, the product rule gives in closed form all changes with
position, velocity and acceleration of each joint.
"""

from __future__ import annotations

from collections.abc import Container
from typing import NamedTuple, cast

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid.robot.inertial_parameters import BASIS
from bayesid.robot.kinematics import Kinematics, hat, joint_motion, joint_twist
from bayesid.robot.robot import Robot

__all__ = [
    "ENTRIES",
    "WIDTH",
    "Screws",
    "beyond",
    "composite_rows",
    "link_table",
    "row_sensitivity",
    "screws",
]

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
"""Columns of each moment of mass in a row of a table."""

WIDTH = 28
"""Number of columns of a table."""

_UPPER = ((0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2))


def link_table(robot: Robot, name: str, motion: Kinematics) -> Floats:
    """Return the coefficients of one link's ten parameters at T instants of a motion, shape (T, 28, 10).

    Parameters
    ----------
    robot : Robot
    name : str
        Link or load.
    motion : Kinematics
        Motion of the joint frames at T instants.
    """
    link = robot.link(name)
    pose, rate, acceleration = (change @ link.placement for change in joint_motion(motion, link.joint))
    table = _moments(pose, rate, acceleration, BASIS)
    xp = namespace(table)
    return cast("Floats", xp.ascontiguousarray(table.swapaxes(1, 2)) if xp is np else table.swapaxes(1, 2))


def _moments(pose: Floats, rate: Floats, acceleration: Floats, bodies: Floats) -> Floats:
    """Return the rows of pseudo-inertias (p, 4, 4) that move with a pose, in the order of `ENTRIES`, (T, p, 28)."""
    left = pose[:, None] @ bodies
    xp = namespace(left)
    composite, flow, surge = (left @ xp.swapaxes(other, 1, 2)[:, None] for other in (pose, rate, acceleration))
    return _rows_of_moments(composite, flow, surge)


def _rows_of_moments(composite: Traceable, flow: Traceable, surge: Traceable) -> Floats:
    """Return the rows (..., 28) of the sums ``P``, ``S`` and ``Q``, each of shape (..., 4, 4)."""
    xp = namespace(composite)
    spin, spin_rate = (
        xp.stack([matrix[..., a, b] - matrix[..., b, a] for a, b in ((1, 2), (2, 0), (0, 1))], axis=-1)
        for matrix in (flow, surge)
    )
    rows = xp.concatenate(
        [
            composite[..., 3, 3:],
            composite[..., 3, :3],
            flow[..., 3, :3],
            surge[..., 3, :3],
            composite[..., _UPPER[0], _UPPER[1]],
            (flow + xp.swapaxes(flow, -1, -2))[..., _UPPER[0], _UPPER[1]],
            spin,
            spin_rate,
        ],
        axis=-1,
    )
    return cast("Floats", rows)


def composite_rows(robot: Robot, motion: Kinematics, leave_out: Container[str] = ()) -> Floats:
    """Return the sum of the rows of all links with mass except those left out, shape (T, 28).

    Parameters
    ----------
    robot : Robot
    motion : Kinematics
        Motion of the joint frames at T instants.
    leave_out : container of str
        Names of links.
    """
    carried: dict[int, Floats] = {}
    for name, link in robot.links.items():
        if name not in leave_out and link.inertial.mass > 0.0:
            body = link.placement @ link.inertial.pseudo_inertia @ link.placement.T
            carried[link.joint] = carried.get(link.joint, np.zeros((4, 4))) + body
    xp = namespace(motion.pose)
    fixed = carried.pop(-1, np.zeros((4, 4)))  # what the base carries stays where it is
    whole = xp.zeros((len(motion.pose), 4, 12)) + np.concatenate([fixed, np.zeros((4, 8))], axis=1)
    for joint, moments in carried.items():
        moved = xp.concatenate([xp.swapaxes(part, 1, 2) for part in joint_motion(motion, joint)], axis=2)
        whole = whole + (motion.pose[:, joint].reshape(-1, 4) @ moments).reshape(-1, 4, 4) @ moved
    return _rows_of_moments(whole[..., :4], whole[..., 4:8], whole[..., 8:])


class Screws(NamedTuple):
    """Screws of all joints in base axes as matrices, with two derivatives, each (T, joints, 4, 4)."""

    screw: Array
    rate: Array
    acceleration: Array


def screws(robot: Robot, motion: Kinematics) -> Screws:
    """Return the screws of all joints of a robot, which must have joints.

    Parameters
    ----------
    robot : Robot
    motion : Kinematics
        Motion of the joint frames at T instants.
    """
    axes = jnp.asarray(hat(np.stack([joint_twist(robot, index) for index in range(len(robot.joints))])))
    pose, rate, acceleration = (jnp.asarray(part) for part in motion)
    turn = jnp.swapaxes(pose[..., :3, :3], -1, -2)
    shift = -turn @ pose[..., :3, 3:]
    last = jnp.broadcast_to(jnp.array([0.0, 0.0, 0.0, 1.0]), (*pose.shape[:2], 1, 4))
    back = jnp.concatenate([jnp.concatenate([turn, shift], axis=-1), last], axis=-2)
    flow = rate @ back
    flow_rate = acceleration @ back - flow @ flow
    screw = pose @ axes @ back
    screw_rate = flow @ screw - screw @ flow
    change = flow_rate @ screw + flow @ screw_rate - screw_rate @ flow - screw @ flow_rate
    return Screws(screw, screw_rate, change)


def row_sensitivity(robot: Robot, motion: Kinematics, joint_screws: Screws, bodies: dict[str, Array]) -> Traceable:
    """Return the changes of the summed row per unit of joint position, velocity and acceleration.

    Parameters
    ----------
    robot : Robot
    motion : Kinematics
        Motion of the joint frames at T instants.
    joint_screws : Screws
        Screws of the joints at these instants.
    bodies : dict of str to (10,) array
        Linear inertial parameters of the links that are not as in the robot.

    Returns
    -------
    (3, T, joints, 28) array
    """
    count = len(robot.joints)
    carried = [jnp.zeros((4, 4))] * count
    for name, link in robot.links.items():
        if link.joint >= 0:
            vector = bodies.get(name)
            own_moments = link.inertial.pseudo_inertia if vector is None else jnp.einsum("p,pij->ij", vector, BASIS)
            carried[link.joint] = carried[link.joint] + link.placement @ own_moments @ link.placement.T
    left = jnp.asarray(motion.pose) @ jnp.stack(carried)
    composite, flow, surge = (
        jnp.einsum("jk,tkab->tjab", beyond(robot), left @ jnp.swapaxes(jnp.asarray(part), -1, -2)) for part in motion
    )
    screw = joint_screws.screw
    turned, turned_rate, turned_acceleration = (jnp.swapaxes(part, -1, -2) for part in joint_screws)
    pushed = composite @ turned
    slower = composite @ turned_rate + flow @ turned
    nothing = jnp.zeros_like(pushed)
    by_position = _rows_of_moments(
        screw @ composite + pushed,
        screw @ flow + slower,
        screw @ surge + composite @ turned_acceleration + 2.0 * flow @ turned_rate + surge @ turned,
    )
    by_velocity = _rows_of_moments(nothing, pushed, 2.0 * slower)
    by_acceleration = _rows_of_moments(nothing, nothing, pushed)
    return jnp.stack([by_position, by_velocity, by_acceleration])


def beyond(robot: Robot) -> Floats:
    """Return one where the second joint is the first or lies beyond it, otherwise zero, shape (joints, joints)."""
    count = len(robot.joints)
    carries = np.zeros((count, count))
    for joint in range(count):
        carries[robot.chain(joint), joint] = 1.0
    return carries
