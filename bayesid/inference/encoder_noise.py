"""How errors of the joints' motion reach the sensors, at the same instant.

The angular momentum in inertial axes does not depend on what the joints are believed to do, so an error of joint
position, velocity or acceleration changes rate and accelerometer through the momentum's balance alone. An error of a
joint's position also turns the base, and with it the momentum in base axes; what external torques make of that is far
below any sensor's noise. Joint torques follow with the bodies that each joint carries; what friction makes of an error
of speed is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.robot.composite_tables import WIDTH, composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import composite
from bayesid.simulation.joint_torques import BaseMotion, Beyond, beyond_joints, joint_torques, no_joints

__all__ = ["JointSensitivity", "joint_sensitivity"]

STEP = 1e-6
"""Finite difference in joint position, velocity and acceleration [rad or m, per s, per s2]."""


class JointSensitivity(NamedTuple):
    """Change of the sensors per unit of joint position, velocity and acceleration, base axes.

    rate, accel and attitude (a small rotation), each of shape (joints, 3, T, 3); torque (joints, 3, T, n).
    """

    rate: Floats
    accel: Floats
    attitude: Floats
    torque: Floats


def joint_sensitivity(
    robot: Robot, state: JointState, rate: Floats, point: Floats, torques: Sequence[int] = ()
) -> JointSensitivity:
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
    torques : sequence of int
        The n joints whose torque is measured, indices into `Robot.joints`.
    """
    columns = list(torques)

    def tables(state: JointState) -> tuple[Floats, Beyond]:
        moved = kinematics(robot, state)
        beyond = beyond_joints(robot, state, moved) if columns else no_joints(len(state.position), 0)
        return composite_rows(robot, moved), beyond

    nominal, beyond = tables(state)
    momentum = np.asarray(_momentum(nominal, rate))
    before = [np.asarray(value) for value in _read(nominal, beyond, momentum, point)]
    count, joints = state.position.shape
    rates, accels = np.zeros((2, joints, 3, count, 3))
    attitude, torque = np.zeros_like(rates), np.zeros((joints, 3, count, len(columns)))
    for joint in range(joints):
        for derivative in (1, 0, 2):
            changed = [np.array(values) for values in state]
            changed[derivative][:, joint] += STEP
            rows, beyond = tables(JointState(*changed))
            turned = momentum - STEP * np.cross(attitude[joint, derivative], momentum)
            after = [np.asarray(value) for value in _read(rows, beyond, turned, point)]
            rates[joint, derivative], accels[joint, derivative], change = (
                (new - old) / STEP for new, old in zip(after, before, strict=True)
            )
            torque[joint, derivative] = change[:, columns]
            if derivative == 1:  # the base turns with the joints' position as its rate follows their velocity
                attitude[joint, 0] = rates[joint, 1]
    return JointSensitivity(rates, accels, attitude, torque)


@jax.jit
@jax.vmap
def _momentum(row: Array, rate: Array) -> Array:
    body = composite(row)
    return body.inertia @ rate + body.spin


@jax.jit
def _read(rows: Array, beyond: Beyond, momentum: Array, point: Array) -> tuple[Array, Array, Array]:
    return jax.vmap(_read_one, (0, 0, 0, None))(rows, beyond, momentum, point)


def _read_one(row: Array, beyond: Beyond, momentum: Array, point: Array) -> tuple[Array, Array, Array]:
    body = composite(row)
    rate = body.inverse @ (momentum - body.spin)
    change = body.inverse @ (-jnp.cross(rate, momentum) - body.inertia_rate @ rate - body.spin_rate)

    def acceleration(lever: Array) -> Array:
        return (
            -body.com_acceleration
            - 2.0 * jnp.cross(rate, body.com_rate)
            + jnp.cross(change, lever)
            + jnp.cross(rate, jnp.cross(rate, lever))
        )

    motion = BaseMotion(rate, change, acceleration(-body.com))
    none = jnp.zeros((WIDTH, 0))
    torque = joint_torques(beyond, none, jnp.zeros(0), motion, body.com, jnp.zeros((3, 3)))
    return rate, acceleration(point - body.com), torque
