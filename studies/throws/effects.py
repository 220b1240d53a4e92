"""What acts on a thrown device beyond rigid-body motion, written as a user of the package would write it.

All sizes are those of a small flight controller with one reaction wheel along z, thrown by hand in air.
"""

from __future__ import annotations

from typing import ClassVar

import jax.numpy as jnp
from jax import Array
from jax.typing import ArrayLike

from bayesid.simulation.effects import AccelBias, Effect, Instant, Parameter, Readings, Wrench
from bayesid.simulation.effects.physical_bound import PhysicalBound
from bayesid.simulation.model import Model
from studies.throws.data import SMOOTH, WHEEL_INERTIA

__all__ = [
    "AirDrag",
    "GSensitivity",
    "GyroCross",
    "SmoothForce",
    "SmoothTorque",
    "ThrowBias",
    "WheelDelay",
    "WheelImbalance",
    "WheelTilt",
]

STEP = 0.0025
"""Longest integration step [s], half of the interval between samples."""


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


class GSensitivity(Effect):
    """Gyro that reads a little of the specific force: a full matrix, whose rows are the gyro's axes."""

    name = "g-sensitivity"
    summary = "The gyro reads a little of the specific force."

    def __init__(self, sigma: float = 2e-4) -> None:
        self.parameters = tuple(Parameter(a + b, "rad s/m", sigma) for a in "xyz" for b in "xyz")

    def physical_bounds(self, model: Model) -> tuple[PhysicalBound, ...]:
        """Return the sensitivity of a poor micromechanical gyro."""
        return (PhysicalBound("rad s/m", 6e-4, "Micromechanical gyros read up to 0.3 degree per second and g."),)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Add a share of the specific force."""
        return readings.replace(rate=readings.rate + readings.accel @ values.reshape(3, 3).T)


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


class WheelDelay(Effect):
    """The recorded momentum of the wheel is late: the true one is ahead by its slope times the delay.

    The second derivative, which only an accelerometer would see where the wheel's torque jumps, is left out.
    """

    name = "wheel-delay"
    summary = "The recorded speed of the wheel is late."

    def __init__(self, sigma: float = 0.002) -> None:
        self.parameters = (Parameter("delay", "s", sigma),)

    def physical_bounds(self, model: Model) -> tuple[PhysicalBound, ...]:
        """Return the time of one reading of the wheel at its lowest speed."""
        return (PhysicalBound("s", 0.006, "A reading is an average over an electrical period, up to 6 ms here."),)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the missing momentum."""
        return values[0] * instant.environment.wheel_torque, jnp.zeros(3)


class WheelImbalance(Effect):
    """Imbalance of the wheel, static and dynamic, which shakes the body once in a turn; its phase differs by throw.

    The angle of the wheel is the integral of its recorded speed, or of a share of it where the motor has more poles
    than the record takes it to have. The samples are filtered, and so is what turns faster.

    Parameters
    ----------
    share : float
        Speed of the wheel relative to the recorded one.
    static, dynamic : float
        Standard deviations of the imbalance [kg m, kg m2].
    """

    name = "wheel-imbalance"
    summary = "The wheel is out of balance and shakes the body once in a turn."
    per_recording = True
    states = 1
    constant_names = ("share",)

    def __init__(self, share: float = 1.0, static: float = 1e-7, dynamic: float = 3e-9) -> None:
        self.share = share
        parts = ("static", "kg m", static), ("dynamic", "kg m2", dynamic)
        self.parameters = tuple(Parameter(f"{name}.{way}", unit, sd) for name, unit, sd in parts for way in ("c", "s"))

    def derivative(self, values: Array, instant: Instant, inner: Array) -> Array:
        """Return the speed of the wheel."""
        return self._speed(instant)[None]

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the force of the eccentric mass, which acts near the sensors."""
        return Wrench(self._speed(instant) ** 2 * self._turned(values[:2], instant, inner), jnp.zeros(3))

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum of the wheel across its axis, and its derivative at the present speed."""
        speed = self._speed(instant)
        momentum = speed * self._turned(values[2:], instant, inner)
        return momentum, speed * jnp.cross(jnp.array([0.0, 0.0, 1.0]), momentum)

    def _speed(self, instant: Instant) -> Array:
        return jnp.asarray(self.share * instant.environment.wheel_momentum[2] / WHEEL_INERTIA)

    def _turned(self, pair: Array, instant: Instant, inner: Array) -> Array:
        """Return a vector across the axis that turns with the wheel, as the filter of the samples leaves it."""
        u = self._speed(instant) * SMOOTH
        gain = (1.0 + 0.5 * u**2) * jnp.exp(-0.5 * u**2)
        c, s = jnp.cos(inner[0]), jnp.sin(inner[0])
        return gain * jnp.stack([pair[0] * c - pair[1] * s, pair[0] * s + pair[1] * c, jnp.zeros(())])


class AirDrag(Effect):
    """Rotational drag of the air, linear in the rate: torque = -diag(values) rate."""

    name = "air-drag"
    summary = "Air slows the rotation."

    def __init__(self, sigma: float) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the drag torque."""
        return Wrench(jnp.zeros(3), -values * instant.rate)


class Smooth(Effect):
    """Vector that nothing else explains: piecewise linear in time, with independent normal values at its knots."""

    per_recording = True
    unit: ClassVar[str]

    def __init__(self, duration: float, knots: int, sigma: float) -> None:
        self.knots, self.spacing, self.sigma = knots, duration / (knots - 1), sigma
        names = [f"{axis}{knot}" for knot in range(knots) for axis in "xyz"]
        self.parameters = tuple(Parameter(name, self.unit, sigma) for name in names)

    def course(self, values: ArrayLike, time: ArrayLike) -> Array:
        """Return the vector at times of any shape, given the values at the knots (knots * 3,): shape (..., 3)."""
        distance = jnp.abs(jnp.asarray(time)[..., None] / self.spacing - jnp.arange(self.knots))
        return jnp.maximum(0.0, 1.0 - distance) @ jnp.asarray(values).reshape(self.knots, 3)


class SmoothTorque(Smooth):
    """Unexplained torque on the body."""

    name = "smooth-torque"
    summary = "A smooth torque of unknown cause acts on the body, another one in every throw."
    unit = "N m"

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque of the instant."""
        return Wrench(jnp.zeros(3), self.course(values, instant.environment.time))


class SmoothForce(Smooth):
    """Unexplained specific force that the accelerometer reads, such as the drag of the air on a moving plate."""

    name = "smooth-force"
    summary = "A smooth force of unknown cause acts on the body, another one in every throw."
    unit = "m/s2"

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the force of the instant per mass."""
        return self.course(values, instant.environment.time)


class ThrowBias(AccelBias):
    """Constant error of the accelerometer, another one in every throw; it stands in for the drag force as well."""

    name = "throw-bias"
    per_recording = True

    @property
    def longest_step(self) -> float:
        """Integration step that suits half a second [s]."""
        return STEP
