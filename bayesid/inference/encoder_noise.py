"""Sensitivity of the sensors to errors of the joints' motion at the same instant.

The angular momentum in inertial axes does not depend on the assumed motion of the joints, so that an error of joint
position, velocity or acceleration changes the base's rate and acceleration through the balance of momentum alone. An
error of a joint's position also turns the base, and with it the momentum in base axes; the change of external torques
by this rotation is far below any sensor's noise and is left out. The torque of a joint changes with the motion of the
bodies that it carries; the change of its friction by an error of speed is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid._math.double_precision import in_double_precision
from bayesid._math.kept_jit import kept_jit
from bayesid._math.small_matrices import cross, rotation, tilted
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.robot.composite_tables import ENTRIES, WIDTH, composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import composite
from bayesid.simulation.instant import Environment, Instant
from bayesid.simulation.joint_torques import BaseMotion, Beyond, beyond_joints, joint_torques, no_joints
from bayesid.simulation.sensors import Channels, Sensed, Sensor, SensorKind
from bayesid.simulation.time_grid import lengthened, rounded

__all__ = ["SampledMotion", "first_rate_sd", "joint_sensitivity"]

STEP = 1e-6
"""Step of the finite differences in joint position, velocity and acceleration [rad or m, per s, per s2]."""


class SampledMotion(NamedTuple):
    """Motion of the base at T instants: attitude quaternion (T, 4), rate (T, 3) in base axes, and environment."""

    quaternion: Floats
    rate: Floats
    environment: Environment


class _Mounted(NamedTuple):
    """Mounting of K sensors: rotation from sensor to base axes (K, 3, 3), and point in the base (K, 3) [m]."""

    rotation: Floats
    point: Floats


def joint_sensitivity(
    robot: Robot, state: JointState, seen: SampledMotion, sensors: Sequence[Sensor], torques: Sequence[int] = ()
) -> Floats:
    """Linearise the sensors in the motion of the joints, by finite differences of Pinocchio's kinematics.

    Parameters
    ----------
    robot : Robot
    state : JointState
        Motion of the joints at T instants.
    seen : SampledMotion
        Motion of the base at the same instants.
    sensors : sequence of Sensor
    torques : sequence of int
        Indices into `Robot.joints` of the joints whose torque is measured.

    Returns
    -------
    (joints + W, 3, T, C) array
        Change of the columns of `Channels` per unit of position, velocity and acceleration of each joint, and then of
        each of the robot's W wheels.
    """
    columns, kinds = list(torques), tuple(sensor.kind for sensor in sensors)
    count, joints = state.position.shape
    length = rounded(count)
    mounted = _Mounted(
        np.stack([sensor.rotation for sensor in sensors]),
        np.stack([np.asarray(sensor.position, dtype=float) for sensor in sensors]),
    )
    quaternion, rate = lengthened(seen.quaternion, length), lengthened(seen.rate, length)
    environment = jax.tree.map(lambda x: lengthened(x, length), seen.environment)

    def tables(state: JointState) -> tuple[Floats, Beyond]:
        moved = kinematics(robot, state)
        beyond = beyond_joints(robot, state, moved) if columns else no_joints(len(state.position), 0)
        return jax.tree.map(lambda x: lengthened(x, length), (composite_rows(robot, moved), beyond))

    rows, beyond = tables(state)
    momentum = np.asarray(_momentum(rows, rate))
    before = _read(kinds, mounted, environment, rows, beyond, momentum, quaternion)
    result = np.zeros((joints + len(robot.wheels), 3, count, Channels(kinds, tuple(map(str, columns))).count))

    def change(after: _Reading) -> Floats:
        difference = np.asarray(_difference(kinds, before, after))[:count] / STEP
        sensed = difference.shape[1] - len(robot.joints if columns else ())
        return difference[:, [*range(sensed), *(sensed + column for column in columns)]]

    for joint in range(joints):
        # rotation of the base per unit of joint position, which equals its rate per unit of joint velocity
        turn = np.zeros((length, 3))
        for derivative in (1, 0, 2):
            changed = [np.array(values) for values in state]
            changed[derivative][:, joint] += STEP
            turned = STEP * turn if derivative == 0 else np.zeros_like(turn)
            after = _read(
                kinds,
                mounted,
                environment,
                *tables(JointState(*changed)),
                momentum - np.cross(turned, momentum),
                np.asarray(_turned(quaternion, turned)),
            )
            if derivative == 1:
                turn = (np.asarray(after.rate) - np.asarray(before.rate)) / STEP
            result[joint, derivative] = change(after)
    for number, wheel in enumerate(robot.wheels, start=joints):
        for derivative, entry in ((1, "spin"), (2, "spin_rate")):
            spun = np.array(rows)
            spun[:, ENTRIES[entry]] += STEP * wheel.inertia * np.asarray(wheel.axis)
            result[number, derivative] = change(_read(kinds, mounted, environment, spun, beyond, momentum, quaternion))
    return result


@in_double_precision
def first_rate_sd(robot: Robot, motion: MeasuredMotion) -> Floats:
    """Return what errors of the smoothed joint speeds leave open of the base's rate at time 0, (3,) [rad/s].

    Later readings determine the momentum, so that joints that seem faster at time 0 make the base seem slower there;
    fits take the smoothed speeds for true.

    Parameters
    ----------
    robot : Robot
    motion : MeasuredMotion
    """
    first, count = np.zeros(1), len(robot.joints)
    if not count:
        return np.zeros(3)
    position = np.repeat(motion.evaluate(first).position, count, axis=0)
    rows = composite_rows(robot, kinematics(robot, JointState(position, np.eye(count), np.zeros((count, count)))))
    slopes = np.stack([np.asarray(body.inverse @ body.spin) for body in map(composite, rows)])
    return np.asarray(np.sqrt(motion.lag_covariance(first, 0)[:, 0, 0, 1, 1] @ slopes**2))


class _Reading(NamedTuple):
    """Angular velocity of the base (T, 3), readings of each sensor, and torques of all joints (T, n)."""

    rate: Array
    readings: tuple[Array, ...]
    torque: Array


@kept_jit()
@jax.vmap
def _momentum(row: Array, rate: Array) -> Array:
    body = composite(row)
    return body.inertia @ rate + body.spin


_turned = kept_jit()(jax.vmap(tilted))


@kept_jit(static=1)
def _difference(kinds: tuple[SensorKind, ...], before: _Reading, after: _Reading) -> Array:
    """Return the changes of all readings in the columns of `Channels`, with the torques of all joints, (T, C)."""
    parts = [
        jax.vmap(kind.residual)(new, old) for kind, new, old in zip(kinds, after.readings, before.readings, strict=True)
    ]
    return jnp.concatenate([*parts, after.torque - before.torque], axis=1)


@kept_jit(static=1)
def _read(
    kinds: tuple[SensorKind, ...],
    mounted: _Mounted,
    environment: Environment,
    rows: Array,
    beyond: Beyond,
    momentum: Array,
    quaternion: Array,
) -> _Reading:
    read = partial(_read_one, kinds, mounted)
    return jax.vmap(read)(environment, rows, beyond, momentum, quaternion)


def _read_one(
    kinds: tuple[SensorKind, ...],
    mounted: _Mounted,
    environment: Environment,
    row: Array,
    beyond: Beyond,
    momentum: Array,
    quaternion: Array,
) -> _Reading:
    body = composite(row)
    rate = body.inverse @ (momentum - body.spin)
    change = body.inverse @ (-cross(rate, momentum) - body.inertia_rate @ rate - body.spin_rate)
    acceleration = (
        -body.com_acceleration
        - 2.0 * cross(rate, body.com_rate)
        - cross(change, body.com)
        - cross(rate, cross(rate, body.com))
    )
    instant = Instant(environment, body, rotation(quaternion), rate, change, acceleration)
    readings = []
    for index, kind in enumerate(kinds):
        reading = kind.read(Sensed(instant, quaternion, jnp.asarray(mounted.point[index]), jnp.zeros(3)))
        readings.append(reading @ mounted.rotation[index] if kind.mounted else reading)
    motion, none = BaseMotion(rate, change, acceleration), jnp.zeros((WIDTH, 0))
    torque = joint_torques(beyond, none, jnp.zeros(0), motion, body.com, jnp.zeros((3, 3)))
    return _Reading(rate, tuple(readings), torque)
