"""Systematic faults of sensors, in sensor axes: six that every kind of sensor can have, and two of one kind each.

The reading is ``measured = (1 + scale) * (rotation(misalignment) * true(t - latency)) + bias + drift * t``; with a
positive latency the sample stamped t shows the past, and a clock that runs fast stamps ``true time * (1 + rate)``. The
true reading is known at the sample times and interpolated between them (`bayesid._math.resampling`); what a sensor
would have read before the first or after the last of them is taken from the slope there.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from typing import Any, ClassVar, Self

import jax
import jax.numpy as jnp
from jax import Array

from bayesid._math.resampling import resampled
from bayesid._math.small_matrices import rotation, turned
from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, three_digits
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Instant, Readings
from bayesid.simulation.sensors import SensorKind

__all__ = [
    "AccelPosition",
    "AttitudeMisalignment",
    "SensorBias",
    "SensorClock",
    "SensorDrift",
    "SensorLatency",
    "SensorMisalignment",
    "SensorScale",
    "SystematicFault",
]

MISMOUNTED = 0.1, "A sensor mounted without alignment measurement is misaligned by less than six degrees."
"""Largest rotation of a sensor against its stated mounting [rad], and the reason."""

WARM_UP = 600.0
"""Time within which an instrument that warms up changes by all of its constant error [s]; assumed."""


class SystematicFault(Effect):
    """Effect on the readings of one sensor.

    Attributes
    ----------
    sensor : SensorKind
        Kind of the sensor that is faulty.
    """

    sensor: ClassVar[SensorKind]

    @classmethod
    def lacks(cls, model: Situation) -> str | None:
        """Return the sensor where it is not declared."""
        return super().lacks(model) or (None if model.sensor(cls.sensor) else f"[{cls.sensor.section}]")

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the reading of the faulty sensor from the true reading, both of shape (T, axes).

        Parameters
        ----------
        values : (p,) array
            Values of the parameters.
        time : (T,) array
            Times of the samples [s].
        reading : (T, axes) array
            True readings, sensor axes.
        """
        raise NotImplementedError

    def read(self, values: Array, readings: Readings) -> Readings:
        """Return the readings with the fault of the sensor applied."""
        key = self.sensor.value
        return readings.replace(**{key: self.change(values, readings.time, readings.channels[key])})


class _FaultOfAnyKind(SystematicFault):
    """Fault that sensors of all kinds can have; `of` gives the effect for one kind.

    In the name SENSOR stands for the kind, and the summary has places for the words of its `Instrument`. A sensor whose
    residual is not the difference of two readings, such as an attitude, has faults of its own instead.
    """

    @classmethod
    @cache
    def of(cls, kind: SensorKind) -> type[Self]:
        """Return the fault of sensors of a kind."""
        instrument = kind.instrument
        words = {
            "instrument": instrument.name or f"{kind.value} sensor",
            "measures": instrument.measures,
            "idle": instrument.idle,
        }
        made = {
            "name": cls.name.replace("SENSOR", kind.value),
            "summary": cls.summary.format(**words),
            "sensor": kind,
            "__doc__": cls.__doc__,
            "__module__": type(kind).__module__,  # one of the user's own makes faults of the user's own
            "__reduce__": lambda self: (_restored, (cls, kind, vars(self))),
        }
        return type(f"{cls.__name__}[{type(kind).__qualname__}]", (cls,), made)

    @classmethod
    def members(cls) -> Sequence[type[Effect]]:
        """Return the faults of all registered kinds of sensors that can have it."""
        return [cls.of(kind) for kind in SensorKind.known() if cls.occurs_in(kind)]

    @classmethod
    def occurs_in(cls, kind: SensorKind) -> bool:
        """Return whether sensors of a kind can have the fault."""
        return kind.is_difference


def _restored(fault: type[_FaultOfAnyKind], kind: SensorKind, attributes: dict[str, Any]) -> _FaultOfAnyKind:
    """Return an effect of a class that is made and therefore not found by its name, for `pickle`."""
    effect = fault.of(kind)()
    vars(effect).update(attributes)
    return effect


class _FaultByAxis(_FaultOfAnyKind):
    """Fault with one parameter for each axis of the sensor.

    Parameters
    ----------
    sigma : float or tuple of float, optional
        Standard deviation of the prior, of all axes or of each, in `unit`.
    """

    def __init__(self, sigma: float | tuple[float, ...] | None = None) -> None:
        axes = self.sensor.axes[: self.sensor.size]
        widths = self.typical() if sigma is None else sigma
        values = (widths,) * len(axes) if isinstance(widths, int | float) else widths
        unit = self.unit()
        self.parameters = tuple(Parameter(axis, unit, float(value)) for axis, value in zip(axes, values, strict=True))

    @classmethod
    def unit(cls) -> str:
        """Return the unit of the parameters."""
        return "1"

    @classmethod
    def typical(cls) -> float:
        """Return the standard deviation of the prior."""
        return 0.03


@register
class SensorBias(_FaultByAxis):
    """Constant error of a sensor; the default prior is that of the type of sensor."""

    name = "SENSOR-bias"
    summary = "The {instrument} reads a constant value {idle}."
    separated_by = (
        "The error is present at rest and does not depend on motion: record longer rest periods before and after the "
        "motion, with different motions in between."
    )

    @classmethod
    def unit(cls) -> str:
        """Return the unit of the readings."""
        return cls.sensor.unit

    @classmethod
    def typical(cls) -> float:
        """Return the constant error of the kind's instruments."""
        return cls.sensor.instrument.bias_sigma

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the error of the poorest instruments, where the kind states it."""
        poorest = self.sensor.instrument.poorest
        if poorest is None:
            return super().physical_bounds(model)
        return (PhysicalBound(self.unit(), poorest.error, f"{poorest.instruments} have an error of {poorest.words}."),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the readings with a constant added."""
        return reading + values


@register
class SensorDrift(_FaultByAxis):
    """Error of a sensor that grows with time; with the default prior it gains about the prior bias in a minute."""

    name = "SENSOR-drift"
    summary = "The {instrument}'s zero drifts steadily, for example during warm-up."
    separated_by = (
        "The error grows with time and does not depend on motion: record longer rest periods before and after the "
        "motion."
    )

    @classmethod
    def unit(cls) -> str:
        """Return the unit of the readings per second, such as m/s3 for m/s2."""
        unit = cls.sensor.unit
        power = re.search(r"/s(\d?)$", unit)
        return f"{unit}/s" if power is None else f"{unit[: power.start()]}/s{int(power[1] or 1) + 1}"

    @classmethod
    def typical(cls) -> float:
        """Return the drift of the kind's instruments."""
        return cls.sensor.instrument.drift_sigma or cls.sensor.instrument.bias_sigma / 60.0

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the error that the poorest instruments gain while they warm up, where the kind states it."""
        poorest = self.sensor.instrument.poorest
        if poorest is None:
            return super().physical_bounds(model)
        reason = f"{poorest.instruments} drift by {poorest.words} within ten minutes of warm-up."
        return (PhysicalBound(self.unit(), poorest.error / WARM_UP, reason),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the readings with an error added that grows from zero at time 0."""
        return reading + values * time[:, None]


@register
class SensorScale(_FaultByAxis):
    """Error of a sensor's scale factor; the prior is 3 %, far above that of a calibrated sensor."""

    name = "SENSOR-scale"
    summary = "The {instrument} reads too high or too low in proportion to {measures}."
    separated_by = (
        "The error grows with the reading: move in reverse and faster, with larger readings on each axis in turn."
    )

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the error of an uncalibrated scale."""
        reason = "The scale of an uncalibrated sensor is within 10 % of its nominal value."
        return (PhysicalBound("1", 0.1, reason),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the readings multiplied."""
        return (1.0 + values) * reading


@register
class SensorMisalignment(_FaultByAxis):
    """Rotation of a vector sensor relative to its stated mounting; the prior is two degrees per axis."""

    name = "SENSOR-misalignment"
    summary = "The {instrument} is rotated relative to its stated mounting."
    separated_by = "The error couples the axes: excite one axis of the sensor at a time, with large readings."

    @classmethod
    def occurs_in(cls, kind: SensorKind) -> bool:
        """Return whether the readings are vectors in sensor axes."""
        return kind.is_difference and kind.mounted

    @classmethod
    def unit(cls) -> str:
        """Return the unit of an angle."""
        return "rad"

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the rotation of a sensor whose alignment was not measured."""
        return (PhysicalBound("rad", *MISMOUNTED),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the readings rotated."""
        return reading @ rotation(turned(jnp.array([0.0, 0.0, 0.0, 1.0]), values)).T


@register
class AccelPosition(SystematicFault):
    """Error of the accelerometer's mounting point: true less stated position, base axes; the prior is 5 cm.

    The gravity gradient over the error is omitted, since it is below 2e-7 m/s2 for 5 cm in any orbit; for an error of
    several metres it reaches 1e-5 m/s2.
    """

    name = "accel-position"
    summary = "The accelerometer is not at its stated position and measures a different acceleration."
    separated_by = (
        "The error grows with the base's rate squared and angular acceleration: rotate the base faster about each axis "
        "in turn."
    )
    sensor = SensorKind.ACCEL

    def __init__(self, sigma: float = 0.05) -> None:
        self.parameters = tuple(Parameter(axis, "m", sigma) for axis in "xyz")

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the radius of the base, within which the accelerometer is located."""
        radius = RobotSize.of(model.robot).radius
        reason = f"An accelerometer on the base is within its radius of {three_digits(radius)} m."
        return (PhysicalBound("m", radius, reason),)

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the acceleration by rotation over the error of position."""
        return jnp.cross(instant.rate_change, values) + jnp.cross(instant.rate, jnp.cross(instant.rate, values))

    read = Effect.read


@register
class AttitudeMisalignment(SystematicFault):
    """Constant rotation of the measured attitude in base axes, the prior being two degrees per axis.

    The measured base axes are the true ones turned by the rotation vector (x, y, z) in base axes, which is also the
    sense of the sensor's noise and residual: ``measured = true * rotation(x, y, z)`` for attitudes from base to orbit
    axes.

    The reading at the first sample determines it if the recording's initial attitude is exact. If that attitude is
    unknown, its error absorbs the rotation at that instant. The remainder appears while the base rotates about another
    axis, as the angle of rotation times the misalignment, and where the recorded rate, or the direction of the Earth in
    a gravity gradient, determines the true axes. The same error in several recordings with
    separate initial attitudes is more probably a misalignment than an error of each of these attitudes.
    """

    name = "attitude-misalignment"
    summary = "The star tracker is rotated relative to its stated mounting: every measured attitude has the same error."
    separated_by = (
        "The error is the same rotation in base axes at every attitude: rotate the base by large angles about each "
        "axis."
    )
    sensor = SensorKind.ATTITUDE

    def __init__(self, sigma: float = 0.03) -> None:
        self.parameters = tuple(Parameter(axis, "rad", sigma) for axis in "xyz")

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the rotation of a sensor whose alignment was not measured."""
        return (PhysicalBound("rad", *MISMOUNTED),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the turned attitudes, quaternions (T, 4)."""
        return jax.vmap(turned, (0, None))(reading, values)


@register
class SensorLatency(_FaultOfAnyKind):
    """Delay of a sensor; the prior is a few cycles of a slow data bus."""

    name = "SENSOR-latency"
    summary = "The {instrument}'s samples are stamped late: each contains an earlier reading."
    separated_by = (
        "The error grows with speed: repeat the same motion twice as fast; the effects of body errors remain "
        "proportional to the motion, whereas those of a delay grow with frequency."
    )

    def __init__(self, sigma: float = 0.2) -> None:
        self.parameters = (Parameter("delay", "s", sigma),)

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return a cycle of slow telemetry."""
        return (PhysicalBound("s", 1.0, "Slow telemetry stamps its samples once per second."),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the true readings of earlier times."""
        return resampled(time - values[0], time, reading)


@register
class SensorClock(_FaultOfAnyKind):
    """Error of a sensor's clock: stamped = true time (1 + rate); the prior is ten times the error of a crystal clock.

    If the clock is slow, the last samples were taken after the stamped end of the recording, by ``-rate`` times its
    length.
    """

    name = "SENSOR-clock"
    summary = "The {instrument}'s clock runs fast or slow: its samples drift relative to the motion of the arm."
    separated_by = (
        "The delay grows with time: repeat the same motion early and late in one recording; a constant "
        "delay is not a clock error."
    )

    def __init__(self, sigma: float = 1.0e-3) -> None:
        self.parameters = (Parameter("rate", "1", sigma),)

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the error of a nominal sampling rate that is rounded."""
        reason = (
            "A crystal clock is accurate to 1e-4; time stamps computed from a rounded sampling rate, such as 100 "
            "instead of 101 samples per second, are wrong by 1 %."
        )
        return (PhysicalBound("1", 1.0e-2, reason),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the true readings of the true times."""
        return resampled(time / (1.0 + values[0]), time, reading)
