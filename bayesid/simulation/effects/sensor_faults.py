"""Faults of sensors, in sensor axes; those of their clocks are in `bayesid.simulation.effects.clock_faults`.

The reading is ``measured = (1 + scale) * (rotation(misalignment) * true(t - latency)) + bias + drift * t``; with a
positive latency the sample stamped t shows the past.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax.numpy as jnp
from jax import Array

from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter
from bayesid.simulation.effects.instant import Instant, Readings
from bayesid.simulation.effects.physical_bound import PhysicalBound, three_digits
from bayesid.simulation.effects.register import register
from bayesid.simulation.sensors import SensorKind

if TYPE_CHECKING:
    from bayesid.simulation.model import Model

__all__ = [
    "AccelBias",
    "AccelDrift",
    "AccelMisalignment",
    "AccelPosition",
    "AccelScale",
    "RateBias",
    "RateDrift",
    "RateMisalignment",
    "RateScale",
    "SensorFault",
]


RATE_BIAS, ACCEL_BIAS = 1.745e-3, 0.049
"""Constant errors of the poorest instruments [rad/s, m/s2]: 0.1 degree per second and 5 milli-g.

They are the largest of the grades in El-Sheimy and Youssef, Inertial sensors technologies for navigation applications,
Satellite Navigation 1:2, 2020, table 1.
"""

MISMOUNTED = 0.1, "A sensor that was mounted without a measurement of its axes is within six degrees of them."
"""Largest rotation of a sensor against its stated mounting [rad], and the reason."""

WARM_UP = 600.0
"""Time within which an instrument that warms up changes by all of its constant error [s]; assumed."""


class SensorFault(Effect):
    """Effect on the readings of one sensor.

    Attributes
    ----------
    sensor : SensorKind
        Kind of the sensor that is faulty.
    """

    sensor: ClassVar[SensorKind]

    @classmethod
    def lacks(cls, model: Model) -> str | None:
        """Return the sensor where it is not declared."""
        return super().lacks(model) or (None if model.sensor(cls.sensor) else f"[sensors.{cls.sensor.value}]")

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the reading of the faulty sensor from the true reading, both of shape (T, 3)."""
        raise NotImplementedError

    def read(self, values: Array, readings: Readings) -> Readings:
        """Return the readings with the fault of the sensor applied."""
        key = self.sensor.value
        return readings.replace(**{key: self.change(values, readings.time, readings.channels[key])})


class _Axes(SensorFault):
    """Fault with one parameter per sensor axis."""

    unit: ClassVar[str]
    sigma: ClassVar[float]
    largest: ClassVar[float]
    reason: ClassVar[str]

    def __init__(self, sigma: float | tuple[float, float, float] | None = None) -> None:
        given = self.sigma if sigma is None else sigma
        values = (given,) * 3 if isinstance(given, int | float) else given
        self.parameters = tuple(
            Parameter(axis, self.unit, float(value)) for axis, value in zip("xyz", values, strict=True)
        )

    def physical_bounds(self, model: Model) -> tuple[PhysicalBound, ...]:
        """Return the bound that the class states for instruments of the poorest grade."""
        return (PhysicalBound(self.unit, self.largest, self.reason),)


class _Bias(_Axes):
    separated_by = (
        "It is present at rest and does not depend on motion: record a longer rest before and after the motion, and "
        "run the motion the other way; the readings due to the motion change their sign, a bias does not."
    )

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        return reading + values


class _Drift(_Axes):
    separated_by = (
        "It grows with time and does not depend on motion: record a longer rest before and after the motion, and "
        "repeat the motion the other way."
    )

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        return reading + values * time[:, None]


class _Scale(_Axes):
    unit = "1"
    largest, reason = 0.1, "The scale of a sensor without calibration is within a tenth of its nominal value."
    separated_by = (
        "It grows with the reading: move the other way and faster, with larger readings about each axis in turn."
    )

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        return (1.0 + values) * reading


class _Misalignment(_Axes):
    unit = "rad"
    largest, reason = MISMOUNTED
    separated_by = "It mixes the axes: turn about one axis at a time, with large readings."

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        return reading @ _rotation(values).T


@register
class RateBias(_Bias):
    """Constant error of the measured rate; the default prior is ten degrees per hour."""

    name = "rate-bias"
    summary = "The rate sensor reads a constant when the base is at rest."
    sensor, unit, sigma = SensorKind.RATE, "rad/s", 5.0e-5
    largest, reason = RATE_BIAS, "Gyroscopes of the poorest grade are wrong by 0.1 degree per second."


@register
class AccelBias(_Bias):
    """Constant error of the accelerometer; the default prior is 10 micro-g."""

    name = "accel-bias"
    summary = "The accelerometer reads a constant in free fall."
    sensor, unit, sigma = SensorKind.ACCEL, "m/s2", 1.0e-4
    largest, reason = ACCEL_BIAS, "Accelerometers of the poorest grade are wrong by 5 milli-g."


@register
class RateDrift(_Drift):
    """Error of the measured rate that grows with time; in a minute it gains about the prior bias."""

    name = "rate-drift"
    summary = "The rate sensor's zero wanders steadily, as when it warms up."
    sensor, unit, sigma = SensorKind.RATE, "rad/s2", 1.0e-6
    largest = RATE_BIAS / WARM_UP
    reason = "Gyroscopes of the poorest grade gain 0.1 degree per second within ten minutes of warming up."


@register
class AccelDrift(_Drift):
    """Error of the accelerometer that grows with time; in a minute it gains about the prior bias."""

    name = "accel-drift"
    summary = "The accelerometer's zero wanders steadily, as when it warms up."
    sensor, unit, sigma = SensorKind.ACCEL, "m/s3", 2.0e-6
    largest = ACCEL_BIAS / WARM_UP
    reason = "Accelerometers of the poorest grade gain 5 milli-g within ten minutes of warming up."


@register
class RateScale(_Scale):
    """Error of the rate sensor's scale factor; the prior is 3 %, far above that of a calibrated sensor."""

    name = "rate-scale"
    summary = "The rate sensor reads too much or too little in proportion to the rate."
    sensor, sigma = SensorKind.RATE, 0.03


@register
class AccelScale(_Scale):
    """Error of the accelerometer's scale factor; the prior is 3 %, far above that of a calibrated sensor."""

    name = "accel-scale"
    summary = "The accelerometer reads too much or too little in proportion to the acceleration."
    sensor, sigma = SensorKind.ACCEL, 0.03


@register
class RateMisalignment(_Misalignment):
    """Rotation of the rate sensor against its stated mounting; the prior is two degrees per axis."""

    name = "rate-misalignment"
    summary = "The rate sensor is turned against its stated mounting."
    sensor, sigma = SensorKind.RATE, 0.03


@register
class AccelMisalignment(_Misalignment):
    """Rotation of the accelerometer against its stated mounting; the prior is two degrees per axis."""

    name = "accel-misalignment"
    summary = "The accelerometer is turned against its stated mounting."
    sensor, sigma = SensorKind.ACCEL, 0.03


@register
class AccelPosition(_Axes):
    """Error of the accelerometer's mounting point: true less stated position, base axes; the prior is 5 cm.

    The gravity gradient over the error is left out, since it is below 2e-7 m/s2 for 5 cm in any orbit.
    """

    name = "accel-position"
    summary = "The accelerometer is mounted elsewhere than stated and reads another part of the base's rotation."
    separated_by = (
        "It grows with the base's rate squared and angular acceleration: turn the base faster about each axis in turn."
    )
    sensor, unit, sigma = SensorKind.ACCEL, "m", 0.05

    def physical_bounds(self, model: Model) -> tuple[PhysicalBound, ...]:
        """Return the radius of the base, somewhere within which the accelerometer is."""
        radius = RobotSize.of(model.robot).radius
        reason = f"An accelerometer of the base is somewhere within its radius of {three_digits(radius)} m."
        return (PhysicalBound(self.unit, radius, reason),)

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the acceleration by rotation over the error of position."""
        return jnp.cross(instant.rate_change, values) + jnp.cross(instant.rate, jnp.cross(instant.rate, values))

    read = Effect.read


def _rotation(vector: Array) -> Array:
    """Return the rotation matrix of a rotation vector, by a series that is smooth at zero."""
    x, y, z = vector
    zero = jnp.zeros(())
    hat = jnp.stack([jnp.stack([zero, -z, y]), jnp.stack([z, zero, -x]), jnp.stack([-y, x, zero])])
    square = vector @ vector
    return (
        jnp.eye(3)
        + hat * (1.0 - square / 6.0 + square**2 / 120.0)
        + hat @ hat * (0.5 - square / 24.0 + square**2 / 720.0)
    )
