"""Motion of the robot along a planned manoeuvre, and its derivatives with respect to the manoeuvre's parameters."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.robot.joint_state import JointState
from bayesid.simulation.instant import Instant

__all__ = ["BaseAtStart", "Trajectory", "base_quantities", "trajectory_of"]


class Trajectory(NamedTuple):
    """Motion of the robot at T instants."""

    time: Floats  #: (T,) instants [s]
    #: (T, joints) positions [rad, m] and speeds [rad/s, m/s] of the joints
    position: Array
    velocity: Array
    #: (T,) speed [m/s] and angular rate [rad/s] of the tip, the larger of those relative to base and inertial space
    tip_speed: Array
    tip_rate: Array
    rotation: Array  #: (T,) angle of the base's rotation since the start [rad]
    #: (T, 6) displacement of the base origin [m] and Cardan angles x, y, z of the base [rad], in the axes of the start
    excursion: Array
    #: (T, 3) angular velocity [rad/s] and acceleration [rad/s2] of the base, and acceleration of its origin [m/s2], in
    #: base axes
    rate: Array
    rate_change: Array
    acceleration: Array


class BaseAtStart(NamedTuple):
    """Attitude (3, 3) of the base at the start of a manoeuvre, and centre of mass (3,) in base axes [m]."""

    attitude: Array
    com: Array


def base_quantities(instant: Instant, start: BaseAtStart, tip: Array) -> Array:
    """Return the quantities of a trajectory at one instant that depend on the motion of the base, shape (18,).

    Parameters
    ----------
    instant : Instant
        Motion of the base at this instant.
    start : BaseAtStart
    tip : (24,) array
        Upper three rows of the pose of the tip in the base, and of its derivative.

    Returns
    -------
    (18,) array
        Tip speed, tip rate, rotation, excursion, rate, change of rate and acceleration, as `Trajectory` has them.
    """
    pose, flow = tip.reshape(2, 3, 4)
    turning = flow[:3, :3] @ pose[:3, :3].T
    relative_rate = jnp.stack([turning[2, 1], turning[0, 2], turning[1, 0]])
    body = instant.body
    drift = -body.com_rate - jnp.cross(instant.rate, body.com)  # velocity of the base origin
    speed = drift + jnp.cross(instant.rate, pose[:3, 3]) + flow[:3, 3]
    turned = start.attitude.T @ instant.attitude
    displaced = start.com - turned @ body.com
    return jnp.concatenate(
        [
            jnp.maximum(_norm(speed), _norm(flow[:3, 3]))[None],
            jnp.maximum(_norm(relative_rate + instant.rate), _norm(relative_rate))[None],
            _angle(turned)[None],
            displaced,
            _cardan(turned),
            instant.rate,
            instant.rate_change,
            instant.acceleration,
        ]
    )


def trajectory_of(time: Floats, joints: JointState, base: Array) -> Trajectory:
    """Return a trajectory, or its change, from the motion of the joints and the quantities of the base.

    Parameters
    ----------
    time : (T,) array
        Instants [s].
    joints : JointState
        Motion of the joints, or its change.
    base : (T, 18) or (T, 18, n) array
        Quantities as of `base_quantities`, or their change along n directions.
    """
    tip_speed, tip_rate, rotation = (base[:, index] for index in range(3))
    excursion, rate, change, acceleration = (base[:, a:b] for a, b in ((3, 9), (9, 12), (12, 15), (15, 18)))
    position, velocity = jnp.asarray(joints.position), jnp.asarray(joints.velocity)
    return Trajectory(time, position, velocity, tip_speed, tip_rate, rotation, excursion, rate, change, acceleration)


def _norm(vector: Array) -> Array:
    """Return the length of a vector (3,), smooth at zero."""
    return jnp.sqrt(jnp.sum(vector**2) + 1e-24)


def _angle(turned: Array) -> Array:
    """Return the angle of a rotation matrix, smooth at zero."""
    vector = jnp.stack([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
    return jnp.arctan2(_norm(vector), jnp.trace(turned) - 1.0)


def _cardan(turned: Array) -> Array:
    """Return the Cardan angles x, y, z, shape (3,), of a rotation matrix Rx Ry Rz."""
    y = jnp.arcsin(jnp.clip(turned[0, 2], -1.0 + 1e-12, 1.0 - 1e-12))
    x = jnp.arctan2(-turned[1, 2], turned[2, 2])
    z = jnp.arctan2(-turned[0, 1], turned[0, 0])
    return jnp.stack([x, y, z])
