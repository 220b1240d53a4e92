"""What acts on a thrown device beyond rigid-body motion, written as a user of the package would write it.

All sizes are those of a small flight controller with one reaction wheel along z, thrown by hand in air.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from bayesid.simulation.effects import AccelBias, Effect, Instant, Parameter, Readings, Wrench

__all__ = ["AirDrag", "GyroCross", "SmoothTorque", "ThrowBias", "WheelTilt"]


class GyroCross(Effect):
    """Cross-axis sensitivity of the gyro, a symmetric matrix without diagonal: the scale factors stay one."""

    name = "gyro-cross"
    summary = "Each gyro axis reads a little of the two others."

    def __init__(self, sigma: float = 0.01) -> None:
        self.parameters = tuple(Parameter(axes, "1", sigma) for axes in ("xy", "xz", "yz"))

    def read(self, values: Array, readings: Readings) -> Readings:
        """Mix the axes."""
        xy, xz, yz = values
        one = jnp.ones(())
        matrix = jnp.stack([jnp.stack([one, xy, xz]), jnp.stack([xy, one, yz]), jnp.stack([xz, yz, one])])
        return readings.replace(rate=readings.rate @ matrix)


class WheelTilt(Effect):
    """The wheel's axis is not quite the gyro's z axis: its recorded momentum has components along x and y."""

    name = "wheel-tilt"
    summary = "The wheel is mounted at a small angle."

    def __init__(self, sigma: float = 0.05) -> None:
        self.parameters = tuple(Parameter(axis, "rad", sigma) for axis in "xy")

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return what the recorded momentum lacks, and its derivative."""
        tilt = jnp.concatenate([values, jnp.zeros(1)])
        return tilt * instant.environment.wheel_momentum[2], tilt * instant.environment.wheel_torque[2]


class AirDrag(Effect):
    """Rotational drag of the air, linear in the rate: torque = -diag(values) rate."""

    name = "air-drag"
    summary = "Air slows the rotation."

    def __init__(self, sigma: float) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the drag torque."""
        return Wrench(jnp.zeros(3), -values * instant.rate)


class SmoothTorque(Effect):
    """Torque that nothing else explains: piecewise linear in time, with independent normal values at its knots."""

    name = "smooth-torque"
    summary = "A smooth torque of unknown cause acts on the body."
    per_recording = True

    def __init__(self, duration: float, knots: int, sigma: float) -> None:
        self.knots, self.spacing = knots, duration / (knots - 1)
        self.parameters = tuple(Parameter(f"{axis}{knot}", "N m", sigma) for knot in range(knots) for axis in "xyz")

    def torque(self, values: ArrayLike, time: ArrayLike) -> Array:
        """Return the torque at times of any shape, given the values at the knots (knots * 3,): shape (..., 3) [N m]."""
        distance = jnp.abs(jnp.asarray(time)[..., None] / self.spacing - jnp.arange(self.knots))
        return jnp.maximum(0.0, 1.0 - distance) @ jnp.asarray(values).reshape(self.knots, 3)

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque of the instant."""
        return Wrench(jnp.zeros(3), self.torque(values, instant.environment.time))


class ThrowBias(AccelBias):
    """Constant error of the accelerometer, another one in every throw; it stands in for the drag force as well."""

    name = "throw-bias"
    per_recording = True
