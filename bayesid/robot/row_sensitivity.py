"""Change of the composite body's moments of mass with position, velocity and acceleration of each joint.

A unit displacement of joint j moves every body beyond it by its screw, ``dT = X T`` with ``X = T_j [axis] T_j^-1`` in
base axes. With ``P``, ``S`` and ``Q`` of `bayesid.robot.composite_tables` summed over these bodies, the product rule
gives all changes in closed form.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Traceable
from bayesid.robot.composite_tables import rows_of_moments
from bayesid.robot.inertial_parameters import BASIS
from bayesid.robot.kinematics import Kinematics, hat, joint_twist
from bayesid.robot.robot import Robot

__all__ = ["Screws", "beyond", "row_sensitivity", "screws"]


class Screws(NamedTuple):
    """Screws of all joints in base axes as matrices, with two derivatives, each (T, joints, 4, 4)."""

    screw: Array
    rate: Array
    acceleration: Array


def screws(robot: Robot, motion: Kinematics) -> Screws:
    """Return the screws of all joints of a robot, which must have joints."""
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


def row_sensitivity(robot: Robot, motion: Kinematics, own: Screws, bodies: dict[str, Array]) -> Traceable:
    """Return the changes of the summed row per unit of joint position, velocity and acceleration.

    Parameters
    ----------
    robot : Robot
    motion : Kinematics
        Motion of the joint frames at T instants.
    own : Screws
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
    screw = own.screw
    turned, turned_rate, turned_acceleration = (jnp.swapaxes(part, -1, -2) for part in own)
    pushed = composite @ turned
    slower = composite @ turned_rate + flow @ turned
    nothing = jnp.zeros_like(pushed)
    by_position = rows_of_moments(
        screw @ composite + pushed,
        screw @ flow + slower,
        screw @ surge + composite @ turned_acceleration + 2.0 * flow @ turned_rate + surge @ turned,
    )
    by_velocity = rows_of_moments(nothing, pushed, 2.0 * slower)
    by_acceleration = rows_of_moments(nothing, nothing, pushed)
    return jnp.stack([by_position, by_velocity, by_acceleration])


def beyond(robot: Robot) -> Floats:
    """Return one where the second joint is the first or lies beyond it, otherwise zero, shape (joints, joints)."""
    count = len(robot.joints)
    carries = np.eye(count)
    for joint in range(count):
        parent = robot.model.parents[joint + 2] - 2
        if parent >= 0:
            carries[:, joint] += carries[:, parent]
    return carries
