"""Regressors: the equations of motion as matrices times inertial parameters.

Every regressor multiplies the ten parameters of each body (`InertialParameters.vector`) and is built on the tables of
`bayesid.robot.composite_tables`. Arrays of NumPy give arrays of NumPy; if any argument is an array of JAX, so is the
result. Vectors are in base axes; moments of force and of momentum are about the base origin.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar, cast

import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, namespace
from bayesid.robot.composite_tables import ENTRIES, link_table
from bayesid.robot.kinematics import Kinematics, joint_motion, joint_twist
from bayesid.robot.robot import Robot

__all__ = [
    "balance_regressor",
    "carried_bodies",
    "gradient_regressor",
    "joint_axes",
    "momentum_regressor",
    "torque_regressor",
]

A = TypeVar("A", Floats, Array)


def balance_regressor(tables: A, rate: A, rate_change: A, acceleration: A) -> A:
    """Return the regressor of the base's force balance, the paper's (19): force and torque about the base origin.

    Parameters
    ----------
    tables : (T, 28, p) array
        Tables of the bodies (`bayesid.robot.composite_tables`).
    rate, rate_change : (T, 3) arrays
        Angular velocity of the base and its derivative, base axes [rad/s, rad/s2].
    acceleration : (T, 3) array
        Specific force at the base origin, base axes [m/s2].

    Returns
    -------
    (T, 6, p) array
        Matrices that give, times the p inertial parameters, the wrench that moves the bodies in this way [N, N m];
        summed over all bodies of the robot it is the external wrench. The gravity gradient has a separate regressor
        (`gradient_regressor`).
    """
    xp = namespace(tables, rate, rate_change, acceleration)
    entry = _entries(tables)
    w, change, a = (vector[:, None] for vector in (rate, rate_change, acceleration))
    first, flow = entry["first"], entry["first_rate"]
    force = (
        entry["mass"] * a
        + entry["first_acceleration"]
        + 2.0 * xp.cross(w, flow)
        + xp.cross(change, first)
        + xp.cross(w, xp.cross(w, first))
    )
    momentum = _turned(entry["second"], w) + entry["spin"]
    torque = (
        _turned(entry["second"], change)
        + _turned(entry["second_rate"], w)
        + entry["spin_rate"]
        + xp.cross(w, momentum)
        + xp.cross(first, a)
    )
    return _rows(force, torque)


def momentum_regressor(tables: A, rate: A, velocity: A) -> A:
    """Return the regressor of linear momentum, and of angular momentum about the base origin, base axes.

    Parameters
    ----------
    tables : (T, 28, p) array
        Tables of the bodies (`bayesid.robot.composite_tables`).
    rate : (T, 3) array
        Angular velocity of the base, base axes [rad/s].
    velocity : (T, 3) array
        Velocity of the base origin in inertial space, base axes [m/s]; zero gives the momentum in a frame that moves
        with the base origin.

    Returns
    -------
    (T, 6, p) array
        Matrices that give, times the p inertial parameters, the momenta [N s, N m s].
    """
    xp = namespace(tables, rate, velocity)
    entry = _entries(tables)
    w, v = rate[:, None], velocity[:, None]
    linear = entry["mass"] * v + entry["first_rate"] + xp.cross(w, entry["first"])
    angular = _turned(entry["second"], w) + entry["spin"] + xp.cross(entry["first"], v)
    return _rows(linear, angular)


def gradient_regressor(tables: A, zenith: A, gradient: float) -> A:
    """Return the regressor of the gravity gradient, the paper's (14) and (16), expanded about the base origin.

    The balance then reads ``(balance_regressor - gradient_regressor) p = other external wrenches``, in which the
    acceleration is the specific force at the base origin: both sides are linear in the same parameters.

    Parameters
    ----------
    tables : (T, 28, p) array
        Tables of the bodies (`bayesid.robot.composite_tables`).
    zenith : (T, 3) array
        Unit vector from the Earth's centre, base axes.
    gradient : float
        Gravity gradient mu / R^3 [1/s2].

    Returns
    -------
    (T, 6, p) array
        Force and torque about the base origin, base axes [N, N m].
    """
    xp = namespace(tables, zenith)
    entry, up = _entries(tables), zenith[:, None]
    first = entry["first"]
    force = gradient * (3.0 * up * xp.sum(up * first, axis=-1, keepdims=True) - first)
    torque = 3.0 * gradient * xp.cross(_stretched(entry["second"], up), up)
    return _rows(force, torque)


def torque_regressor(
    robot: Robot, bodies: Sequence[str], motion: Kinematics, rate: A, rate_change: A, acceleration: A
) -> A:
    """Return the regressor of the full equations of motion, the paper's (23): wrench on the base, then joint torques.

    The torque of a joint is the virtual power, per unit of its speed, of the wrenches that move the bodies it carries.

    Parameters
    ----------
    robot : Robot
    bodies : sequence of str
        Links and loads, each of which has ten columns.
    motion : Kinematics
        Motion of the joint frames at T instants (`bayesid.robot.kinematics.kinematics`).
    rate, rate_change, acceleration : (T, 3) arrays
        Motion of the base, as for `balance_regressor`. A fixed base has no rates, and minus gravity as acceleration.

    Returns
    -------
    (T, 6 + joints, 10 bodies) array
        Matrices that give, times the parameters, the external force and torque on the base [N, N m], and the torques of
        the joints [N m] or the forces of prismatic joints [N]. Friction and the rotors of the drives are left out.
    """
    tables = [link_table(robot, name, motion) for name in bodies]
    xp = namespace(motion.pose, rate, rate_change, acceleration)
    wrench = balance_regressor(xp.concatenate(tables, axis=2), rate, rate_change, acceleration)
    carried = np.repeat(carried_bodies(robot, bodies), 10, axis=1)
    torque = xp.einsum("tjs,tsp->tjp", joint_axes(robot, motion), wrench) * carried
    return cast("A", xp.concatenate([wrench, torque], axis=1))


def joint_axes(robot: Robot, motion: Kinematics) -> Floats:
    """Return the twist at the base origin of the links that each joint carries at unit speed, (T, joints, 6).

    Parameters
    ----------
    robot : Robot
    motion : Kinematics
        Motion of the joint frames at T instants.
    """
    xp = namespace(motion.pose)
    axes = []
    for index in range(len(robot.joints)):
        pose = joint_motion(motion, index)[0]
        linear, angular = (pose[:, :3, :3] @ part for part in joint_twist(robot, index).reshape(2, 3))
        axes.append(xp.concatenate([linear + xp.cross(pose[:, :3, 3], angular), angular], axis=-1))
    empty = np.zeros((len(motion.pose), 0, 6))
    return cast("Floats", xp.stack(axes, axis=1) if axes else empty)


def carried_bodies(robot: Robot, bodies: Sequence[str]) -> Floats:
    """Return 1 where a joint carries a body and 0 elsewhere, shape (joints, bodies).

    Parameters
    ----------
    robot : Robot
    bodies : sequence of str
        Names of links or loads.
    """
    carried = np.zeros((len(robot.joints), len(bodies)))
    for column, name in enumerate(bodies):
        carried[robot.chain(robot.link(name).joint), column] = 1.0
    return carried


def _entries(tables: A) -> dict[str, A]:
    """Return the moments of mass in tables (T, 28, p), each of shape (T, p, width)."""
    xp = namespace(tables)
    rows = xp.swapaxes(tables, 1, 2)
    return {name: rows[..., columns] for name, columns in ENTRIES.items()}


def _rows(upper: A, lower: A) -> A:
    """Return the regressor (T, 6, p) of two vectors (T, p, 3)."""
    xp = namespace(upper, lower)
    return cast("A", xp.swapaxes(xp.concatenate([upper, lower], axis=-1), 1, 2))


def _stretched(second: A, vector: A) -> A:
    """Return second moments xx, yy, zz, xy, xz, yz (..., 6) times vectors (..., 3)."""
    xp = namespace(second, vector)
    xx, yy, zz, xy, xz, yz = xp.moveaxis(second, -1, 0)
    x, y, z = xp.moveaxis(vector, -1, 0)
    return cast("A", xp.stack([xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z], axis=-1))


def _turned(second: A, vector: A) -> A:
    """Return the inertia tensors of second moments (..., 6) times vectors (..., 3)."""
    return second[..., :3].sum(axis=-1, keepdims=True) * vector - _stretched(second, vector)
