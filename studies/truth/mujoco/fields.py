"""Force and torque fields on the base: air, sunlight, magnetism, leaks, and disturbances outside the catalogue."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.truth.numerics import Array, cross
from studies.truth.orbit import Orbit

__all__ = ["Field", "SpunWheel", "braking", "drag", "leak", "magnet", "outer_torque", "pulses", "snap", "sunlight"]

Field = Callable[[float, Array, Array], tuple[Array, Array]]
"""Time, rotation matrix base -> orbit axes, rate in base axes -> force and torque at the base origin, base axes."""


def _pushed(direction: Callable[[float], Array], force: float, cp: ArrayLike) -> Field:
    """Constant force along a direction given in orbit axes, at a point of the base."""
    point = np.asarray(cp, dtype=float)

    def push(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        vector = force * (attitude.T @ direction(time))
        return vector, cross(point, vector)

    return push


def drag(orbit: Orbit, force: float, cp: ArrayLike) -> Field:
    """Air drag: constant force [N] against the velocity at the centre of pressure [m, base frame]."""
    return _pushed(lambda time: -orbit.heading(time), force, cp)


def sunlight(orbit: Orbit, force: float, cp: ArrayLike) -> Field:
    """Solar pressure: constant force [N] away from the Sun at the centre of pressure [m, base frame]."""
    if orbit.sun is None:
        raise ValueError("solar pressure needs the Sun's direction; give Orbit(sun=...)")
    away = -orbit.from_node(orbit.sun)
    return _pushed(lambda time: away, force, cp)


def magnet(orbit: Orbit, moment: ArrayLike) -> Field:
    """Torque of a magnetic moment [A m2, base axes] in the Earth's field."""
    dipole = np.asarray(moment, dtype=float)
    return lambda time, attitude, rate: (np.zeros(3), cross(dipole, attitude.T @ orbit.magnetic_field(time)))


def leak(force: ArrayLike = (0.0, 0.0, 0.0), torque: ArrayLike = (0.0, 0.0, 0.0)) -> Field:
    """Constant force [N] and torque about the base origin [N m], base axes."""
    wrench = np.asarray(force, dtype=float), np.asarray(torque, dtype=float)
    return lambda time, attitude, rate: wrench


def braking(coefficients: ArrayLike) -> Field:
    """Torque against the rate, -coefficients * rate [N m s], base axes."""
    factor = np.asarray(coefficients, dtype=float)
    return lambda time, attitude, rate: (np.zeros(3), -factor * rate)


def pulses(torque: ArrayLike, *, every: float, length: float, start: float = 0.0) -> Field:
    """Torque pulses, base axes; their edges must be sample times."""
    vector = np.asarray(torque, dtype=float)

    def pulse(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        on = time >= start and (time - start) % every < length
        return np.zeros(3), vector if on else np.zeros(3)

    return pulse


def snap(torque: ArrayLike, *, start: float, decay: float) -> Field:
    """Torque, base axes, that appears at a sample time and dies away exponentially within `decay` [s]."""
    vector = np.asarray(torque, dtype=float)

    def jerk(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        return np.zeros(3), vector * (np.exp((start - time) / decay) if time >= start else 0.0)

    return jerk


def outer_torque(history: Callable[[float], ArrayLike]) -> Field:
    """Torque of any history in orbit axes [N m], which do not rotate."""
    return lambda time, attitude, rate: (np.zeros(3), attitude.T @ np.asarray(history(time), dtype=float))


@dataclass(frozen=True)
class SpunWheel:
    """Reaction of a wheel whose momentum [N m s] along an axis of the base is piecewise linear in time; a `Field`."""

    axis: Array
    times: Array
    momentum: Array

    def __call__(self, time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        """Return no force, and what the wheel takes from the base's momentum."""
        piece = min(max(int(np.searchsorted(self.times, time, side="right")) - 1, 0), len(self.times) - 2)
        slope = (self.momentum[piece + 1] - self.momentum[piece]) / (self.times[piece + 1] - self.times[piece])
        spin = self.momentum[piece] + slope * (time - self.times[piece])
        return np.zeros(3), -slope * self.axis - cross(rate, spin * self.axis)
