"""Limits that a manoeuvre must keep at every instant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.double_precision import in_double_precision
from bayesid.design.trajectory import Trajectory
from bayesid.robot.robot import Robot

__all__ = ["ACTIVE", "Limit", "Limits", "smooth_largest"]

QUIET = 1e-3  # largest fraction of the power of the base's motion that may lie in a quiet band
# power added on both sides of the ratio, so that it exists when the base does not move [(rad/s2)^2 s, (m/s2)^2 s]
NOTHING = 1e-20
SHARPNESS = 300.0  # sharpness of the smooth maximum, at which 500 equal values are overestimated by 2 % of the limit
PARTS = 8  # number of parts of a manoeuvre whose largest values are limited separately

ACTIVE = 0.97
"""Fraction of a limit above which it is called active, as the smooth maximum keeps motions slightly below it."""

REST = 1e-6  # largest joint speed that counts as rest at both ends [rad/s or m/s]


@dataclass(frozen=True)
class Limit:
    """Quantity that must not exceed a bound at any instant.

    Parameters
    ----------
    name : str
        Name of the limit.
    bound : float
        Largest allowed value, in the unit.
    unit : str
        Unit of the quantity.
    quantity : callable
        Function of the trajectory that returns values of any shape, none of which may exceed the bound.
    depends : bool
        True if the quantity depends on the inertial parameters.
    shrinks : bool
        True if a smaller motion reduces the quantity.
    """

    name: str
    bound: float
    unit: str
    quantity: Callable[[Trajectory], Array]
    depends: bool = False
    shrinks: bool = True

    @in_double_precision
    def largest(self, trajectory: Trajectory) -> Array:
        """Return the largest value along a trajectory."""
        return jnp.max(self.quantity(trajectory))


@dataclass(frozen=True)
class Limits:
    """Limits of a design in addition to the joint ranges and speeds of the robot; omitted limits do not apply.

    Parameters
    ----------
    tip_speed, tip_rate : float, optional
        Largest speed [m/s] and angular rate [rad/s] of the tip frame, relative to the base and to inertial space.
    joint_speed : float, optional
        Largest speed of any joint [rad/s or m/s].
    base_rotation : float, optional
        Largest rotation of the base since the start, about any axis [rad].
    quiet_band : (2,) tuple, optional
        Frequencies between which at most a thousandth of the power of the base's acceleration and angular acceleration
        may lie [Hz].
    """

    tip_speed: float | None = None
    tip_rate: float | None = None
    joint_speed: float | None = None
    base_rotation: float | None = None
    quiet_band: tuple[float, float] | None = None

    def of(self, robot: Robot) -> tuple[Limit, ...]:
        """Return all limits that apply to a robot."""
        limits = [*_joint_limits(robot)]
        if self.joint_speed is not None:
            unit = "rad/s" if all(joint.kind != "prismatic" for joint in robot.joints) else "rad/s or m/s"
            limits.append(Limit("joint_speed", self.joint_speed, unit, lambda t: jnp.abs(t.velocity)))
        if self.tip_speed is not None:
            limits.append(Limit("tip_speed", self.tip_speed, "m/s", lambda t: t.tip_speed, depends=True))
        if self.tip_rate is not None:
            limits.append(Limit("tip_rate", self.tip_rate, "rad/s", lambda t: t.tip_rate, depends=True))
        if self.base_rotation is not None:
            limits.append(Limit("base_rotation", self.base_rotation, "rad", lambda t: t.rotation, depends=True))
        if self.quiet_band is not None:
            limits.append(Limit("quiet_band", QUIET, "1", _power_within(self.quiet_band), shrinks=False))
        limits.append(Limit("rest", REST, "rad/s", lambda trajectory: jnp.abs(trajectory.velocity[jnp.array([0, -1])])))
        return tuple(limits)

    @property
    def finest(self) -> float:
        """Longest interval between instants at which the limits can be evaluated [s]."""
        return float("inf") if self.quiet_band is None else 0.25 / self.quiet_band[1]


def smooth_largest(limit: Limit, trajectory: Trajectory, bound: Array | float) -> Array:
    """Return smooth upper bounds of the largest values divided by the bound; at most one keeps the limit.

    There is one bound for each of several parts of the manoeuvre, so that an optimiser sees all peaks at once.

    Parameters
    ----------
    limit : Limit
    trajectory : Trajectory
    bound : float
        In the limit's unit.
    """
    values = limit.quantity(trajectory) / bound
    count = min(PARTS, len(values))
    longest = -(-len(values) // count)
    # the last value is repeated, so that all parts are of one length
    padded = values[np.minimum(np.arange(count * longest), len(values) - 1)].reshape(count, -1)
    top = jnp.max(padded, axis=1, keepdims=True)
    return top[:, 0] + jnp.log(jnp.sum(jnp.exp(SHARPNESS * (padded - top)), axis=1)) / SHARPNESS


def _joint_limits(robot: Robot) -> Sequence[Limit]:
    limits = []
    for index, joint in enumerate(robot.joints):
        if np.isfinite(joint.lower) and np.isfinite(joint.upper):
            middle, half = 0.5 * (joint.lower + joint.upper), 0.5 * (joint.upper - joint.lower)
            limits.append(
                Limit(
                    f"joint_range.{joint.name}",
                    half,
                    joint.unit,
                    lambda trajectory, i=index, m=middle: jnp.abs(trajectory.position[:, i] - m),  # type: ignore[misc]
                )
            )
        if np.isfinite(joint.velocity):
            limits.append(
                Limit(
                    f"joint_speed.{joint.name}",
                    joint.velocity,
                    f"{joint.unit}/s",
                    lambda trajectory, i=index: jnp.abs(trajectory.velocity[:, i]),  # type: ignore[misc]
                )
            )
    return limits


def _power_within(band: tuple[float, float]) -> Callable[[Trajectory], Array]:
    """Return the function that computes the fraction of the power of the base's motion in a band [Hz].

    The power is that of the angular acceleration (times 1 m) and of the acceleration of the base origin.
    """

    def quantity(trajectory: Trajectory) -> Array:
        times = np.asarray(trajectory.time)
        interval, duration = times[1] - times[0], times[-1]
        count = max(2, int(np.ceil(2.0 * duration * (band[1] - band[0]))) + 1)
        frequencies = np.linspace(*band, count)
        waves = np.exp(-2j * np.pi * frequencies[:, None] * times)
        signal = jnp.concatenate([trajectory.rate_change, trajectory.acceleration], axis=1)
        density = jnp.sum(jnp.abs(waves @ signal * interval) ** 2, axis=1)
        inside, total = 2.0 * jnp.trapezoid(density, frequencies), jnp.sum(signal**2) * interval
        return ((inside + NOTHING) / (total + NOTHING))[None]

    return quantity
