"""How errors of the joints' motion reach the sensors, at the same instant.

The angular momentum in inertial axes does not depend on what the joints are believed to do, so an error of joint
position, velocity or acceleration changes rate and accelerometer through the momentum's balance alone. An error of a
joint's position also turns the base, and with it the momentum in base axes; what external torques make of that is far
below any sensor's noise.
"""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid.arrays import Floats
from bayesid.dynamics import composite
from bayesid.motion import JointState
from bayesid.robot import Robot
from bayesid.tables import composite_rows, kinematics

__all__ = ["JointSensitivity", "joint_sensitivity"]

STEP = 1e-6
"""Finite difference in joint position, velocity and acceleration [rad or m, per s, per s2]."""


class JointSensitivity(NamedTuple):
    """Change of the sensors per unit of joint position, velocity and acceleration, base axes.

    rate, accel and attitude (a small rotation), each of shape (joints, 3, T, 3).
    """

    rate: Floats
    accel: Floats
    attitude: Floats


def joint_sensitivity(robot: Robot, state: JointState, rate: Floats, point: Floats) -> JointSensitivity:
    """Linearise the sensors in the joints' motion, by finite differences through Pinocchio's kinematics.

    Parameters
    ----------
    robot : Robot
    state : JointState
        At T times.
    rate : (T, 3) array
        Angular velocity of the base, base axes [rad/s].
    point : (3,) array
        Mounting point of the accelerometer in the base [m].
    """
    nominal = composite_rows(robot, kinematics(robot, state))
    momentum = np.asarray(_momentum(nominal, rate))
    before = [np.asarray(value) for value in _read(nominal, momentum, point)]
    count, joints = state.position.shape
    rates, accels = np.zeros((2, joints, 3, count, 3))
    attitude = np.zeros_like(rates)
    for joint in range(joints):
        for derivative in (1, 0, 2):
            changed = [np.array(values) for values in state]
            changed[derivative][:, joint] += STEP
            rows = composite_rows(robot, kinematics(robot, JointState(*changed)))
            turned = momentum - STEP * np.cross(attitude[joint, derivative], momentum)
            after = _read(rows, turned, point)
            rates[joint, derivative] = (np.asarray(after[0]) - before[0]) / STEP
            accels[joint, derivative] = (np.asarray(after[1]) - before[1]) / STEP
            if derivative == 1:  # the base turns with the joints' position as its rate follows their velocity
                attitude[joint, 0] = rates[joint, 1]
    return JointSensitivity(rates, accels, attitude)


@jax.jit
@jax.vmap
def _momentum(row: Array, rate: Array) -> Array:
    body = composite(row)
    return body.inertia @ rate + body.spin


@jax.jit
def _read(rows: Array, momentum: Array, point: Array) -> tuple[Array, Array]:
    return jax.vmap(_read_one, (0, 0, None))(rows, momentum, point)


def _read_one(row: Array, momentum: Array, point: Array) -> tuple[Array, Array]:
    body = composite(row)
    rate = body.inverse @ (momentum - body.spin)
    change = body.inverse @ (-jnp.cross(rate, momentum) - body.inertia_rate @ rate - body.spin_rate)
    lever = point - body.com
    accel = (
        -body.com_acceleration
        - 2.0 * jnp.cross(rate, body.com_rate)
        + jnp.cross(change, lever)
        + jnp.cross(rate, jnp.cross(rate, lever))
    )
    return rate, accel
