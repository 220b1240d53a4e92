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
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.robot.composite_tables import ENTRIES, WIDTH, composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import composite
from bayesid.simulation.instant import Environment, Instant
from bayesid.simulation.joint_torques import BaseMotion, Beyond, beyond_joints, joint_torques, no_joints
from bayesid.simulation.sensors import Channels, Sensed, Sensor, SensorKind
from bayesid.simulation.time_grid import lengthened, rounded

__all__ = ["SampledMotion", "WheelSensitivity", "first_rate_sd", "joint_sensitivity", "wheel_sensitivity"]

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
    (joints, 3, T, C) array
        Change of the columns of `Channels` per unit of position, velocity and acceleration of each joint.
    """
    sensed = _Readings(robot, state, seen, sensors, torques)
    result = np.zeros((state.position.shape[1], 3, *sensed.shape))
    for joint, slopes in enumerate(result):
        # rotation of the base per unit of joint position, which equals its rate per unit of joint velocity
        turn: Floats = sensed.still
        for derivative in (1, 0, 2):
            changed = [np.array(values) for values in state]
            changed[derivative][:, joint] += STEP
            tables = sensed.tables(JointState(*changed))
            after = sensed.read(*tables, STEP * turn if derivative == 0 else sensed.still)
            if derivative == 1:
                turn = sensed.rate_change(after)
            slopes[derivative] = sensed.change(after)
    return result


class WheelSensitivity(NamedTuple):
    """Change of the readings and of the base's rate, base axes, by errors of W wheels and a turn of the base.

    Attributes
    ----------
    readings : (W, 2, T, C) array
        Per unit of speed and of acceleration of each wheel.
    of_turn : (3, T, C) array
        Readings per unit of rotation of the base about each of its axes, the momentum in inertial axes being the same.
    rate : (W, T, 3) array
        Rate per unit of speed.
    rate_of_turn : (T, 3, 3) array
        Rate per unit of rotation about each axis, which is the last index.
    """

    readings: Floats
    of_turn: Floats
    rate: Floats
    rate_of_turn: Floats


def wheel_sensitivity(
    robot: Robot, state: JointState, seen: SampledMotion, sensors: Sequence[Sensor], torques: Sequence[int] = ()
) -> WheelSensitivity:
    """Linearise the sensors in the speed of the wheels and the attitude of the base; parameters as for the joints."""
    sensed = _Readings(robot, state, seen, sensors, torques)
    readings = np.zeros((len(robot.wheels), 2, *sensed.shape))
    rate = np.zeros((len(robot.wheels), sensed.shape[0], 3))
    for number, wheel in enumerate(robot.wheels):
        for derivative, entry in enumerate(("spin", "spin_rate")):
            spun = np.array(sensed.rows)
            spun[:, ENTRIES[entry]] += STEP * wheel.inertia * np.asarray(wheel.axis)
            after = sensed.read(spun, sensed.beyond, sensed.still)
            readings[number, derivative] = sensed.change(after)
            if derivative == 0:
                rate[number] = sensed.rate_change(after)[: sensed.shape[0]]
    turned = [sensed.read(sensed.rows, sensed.beyond, sensed.still + STEP * axis) for axis in np.eye(3)]
    return WheelSensitivity(
        readings,
        np.stack([sensed.change(after) for after in turned]),
        rate,
        np.stack([sensed.rate_change(after)[: sensed.shape[0]] for after in turned], axis=-1),
    )


class _Readings:
    """Readings at T instants, and how they change."""

    def __init__(
        self, robot: Robot, state: JointState, seen: SampledMotion, sensors: Sequence[Sensor], torques: Sequence[int]
    ) -> None:
        self._robot, self._torques = robot, list(torques)
        self._kinds = tuple(sensor.kind for sensor in sensors)
        count = len(state.position)
        self._length = rounded(count)
        self._mounted = _Mounted(
            np.stack([sensor.rotation for sensor in sensors]),
            np.stack([np.asarray(sensor.position, dtype=float) for sensor in sensors]),
        )
        self._quaternion, rate = lengthened(seen.quaternion, self._length), lengthened(seen.rate, self._length)
        self._environment = jax.tree.map(lambda x: lengthened(x, self._length), seen.environment)
        self.still = np.zeros((self._length, 3))
        self.rows, self.beyond = self.tables(state)
        self._momentum = np.asarray(_momentum(self._environment, self.rows, rate))
        self._before = self.read(self.rows, self.beyond, self.still)
        self.shape = count, Channels(self._kinds, tuple(map(str, self._torques))).count

    def tables(self, state: JointState) -> tuple[Floats, Beyond]:
        """Return the composite body and what is beyond each joint at a state of the joints."""
        moved = kinematics(self._robot, state)
        beyond = beyond_joints(self._robot, state, moved) if self._torques else no_joints(len(state.position), 0)
        return jax.tree.map(lambda x: lengthened(x, self._length), (composite_rows(self._robot, moved), beyond))

    def read(self, rows: Floats, beyond: Beyond, turned: Floats) -> _Reading:
        """Return the readings, given the rotation (T, 3) by which the base has turned in addition."""
        momentum = self._momentum - np.cross(turned, self._momentum)
        attitude = np.asarray(_turned(self._quaternion, turned))
        return _read(self._kinds, self._mounted, self._environment, rows, beyond, momentum, attitude)

    def rate_change(self, after: _Reading) -> Floats:
        """Return the change of the base's rate per step, (T, 3)."""
        return np.asarray((np.asarray(after.rate) - np.asarray(self._before.rate)) / STEP)

    def change(self, after: _Reading) -> Floats:
        """Return the change of the columns of `Channels` per step, (T, C)."""
        difference = np.asarray(_difference(self._kinds, self._before, after))[: self.shape[0]] / STEP
        sensed = difference.shape[1] - len(self._robot.joints if self._torques else ())
        return difference[:, [*range(sensed), *(sensed + column for column in self._torques)]]


@in_double_precision
def first_rate_sd(robot: Robot, motion: Motion, wheels: WheelMotion | None = None) -> Floats:
    """Return what errors of the smoothed speeds of joints and wheels leave open of the base's rate at time 0, (3,).

    Later readings determine the momentum, so that joints that seem faster at time 0 make the base seem slower there;
    fits take the smoothed speeds for true. In rad/s.

    Parameters
    ----------
    robot : Robot
    motion : Motion
    wheels : WheelMotion, optional
    """
    first, count = np.zeros(1), len(robot.joints)
    spins: Floats = np.zeros((0, 3))
    variances: Floats = np.zeros(0)
    position = motion.evaluate(first).position
    if isinstance(motion, MeasuredMotion) and count:
        moving = JointState(np.repeat(position, count, axis=0), np.eye(count), np.zeros((count, count)))
        rows = composite_rows(robot, kinematics(robot, moving))
        spins = np.stack([np.asarray(composite(row).spin) for row in rows])
        variances = motion.lag_covariance(first, 0)[:, 0, 0, 1, 1]
    if wheels is not None and wheels.rotors:
        spins = np.concatenate([spins, [wheel.inertia * np.asarray(wheel.axis) for wheel in wheels.rotors]])
        variances = np.concatenate([variances, wheels.lag_covariance(first, 0)[:, 0, 0, 1, 1]])
    still = JointState(position, np.zeros((1, count)), np.zeros((1, count)))
    (row,) = composite_rows(robot, kinematics(robot, still))
    return np.asarray(np.sqrt(variances @ (spins @ np.asarray(composite(row).inverse)) ** 2))


class _Reading(NamedTuple):
    """Angular velocity of the base (T, 3), readings of each sensor, and torques of all joints (T, n)."""

    rate: Array
    readings: tuple[Array, ...]
    torque: Array


@kept_jit()
@jax.vmap
def _momentum(environment: Environment, row: Array, rate: Array) -> Array:
    body = composite(row)
    return body.inertia @ rate + body.spin + environment.wheel_momentum


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
    rate = body.inverse @ (momentum - body.spin - environment.wheel_momentum)
    spin_rate = body.spin_rate + environment.wheel_torque
    change = body.inverse @ (-cross(rate, momentum) - body.inertia_rate @ rate - spin_rate)
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
