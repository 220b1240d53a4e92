"""Faults of the clocks by which sensors stamp their samples: a constant delay, and a clock that runs fast or slow.

Both shift the reading in time: the sample stamped t shows the true reading at ``(t - delay)`` or at ``t / (1 + rate)``.
The true reading is known at the sample times and interpolated between them (`bayesid._math.resampling`); what a sensor
would have read before the first or after the last of them is taken from the slope there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from jax import Array

from bayesid._math.resampling import resampled
from bayesid.simulation.effects.effect_parameters import Parameter
from bayesid.simulation.effects.physical_bound import PhysicalBound
from bayesid.simulation.effects.register import register
from bayesid.simulation.effects.sensor_faults import SensorFault
from bayesid.simulation.sensors import SensorKind

if TYPE_CHECKING:
    from bayesid.simulation.model import Model

__all__ = ["AccelClock", "AccelLatency", "RateClock", "RateLatency"]


class _Retimed(SensorFault):
    """Fault of a sensor that reads the truth at another time than it says."""

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        return resampled(self.true_time(values, time), time, reading)

    def true_time(self, values: Array, time: Array) -> Array:
        """Return the true times of samples that are stamped with the times (T,)."""
        raise NotImplementedError


class _Latency(_Retimed):
    separated_by = (
        "It grows with speed: repeat the same motion twice as fast; errors of bodies stay in proportion to the motion, "
        "those of a delay grow with frequency."
    )

    def __init__(self, sigma: float = 0.2) -> None:
        self.parameters = (Parameter("delay", "s", sigma),)

    def physical_bounds(self, model: Model) -> tuple[PhysicalBound, ...]:
        """Return a cycle of slow telemetry."""
        return (PhysicalBound("s", 1.0, "A slow telemetry stamps its samples once in a second."),)

    def true_time(self, values: Array, time: Array) -> Array:
        return time - values[0]


class _Clock(_Retimed):
    separated_by = (
        "It is a delay that grows with time: repeat the same motion early and late in one recording; a delay that "
        "stays the same is no fault of the clock's rate."
    )

    def __init__(self, sigma: float = 1.0e-3) -> None:
        self.parameters = (Parameter("rate", "1", sigma),)

    def physical_bounds(self, model: Model) -> tuple[PhysicalBound, ...]:
        """Return the error of a nominal sampling rate that is rounded."""
        reason = (
            "A crystal keeps time to 1e-4; time stamps that are counted with a rounded sampling rate, such as 100 in "
            "place of 101 samples per second, are wrong by 1 %."
        )
        return (PhysicalBound("1", 1.0e-2, reason),)

    def true_time(self, values: Array, time: Array) -> Array:
        return time / (1.0 + values[0])


@register
class RateLatency(_Latency):
    """Delay of the rate sensor; the prior is a few cycles of a slow data bus."""

    name = "rate-latency"
    summary = "The rate sensor's samples are stamped late: each shows the past."
    sensor = SensorKind.RATE


@register
class AccelLatency(_Latency):
    """Delay of the accelerometer; the prior is a few cycles of a slow data bus."""

    name = "accel-latency"
    summary = "The accelerometer's samples are stamped late: each shows the past."
    sensor = SensorKind.ACCEL


@register
class RateClock(_Clock):
    """Error of the clock of the rate sensor: stamped = true time (1 + rate); the prior is ten times a crystal's error.

    Where the clock is slow, the last samples lie after the end of the recording by ``-rate`` times its length.
    """

    name = "rate-clock"
    summary = "The rate sensor's clock runs fast or slow: its samples drift away from the motion of the arm."
    sensor = SensorKind.RATE


@register
class AccelClock(_Clock):
    """Error of the accelerometer's clock: stamped = true time (1 + rate); the prior is ten times a crystal's error.

    Where the clock is slow, the last samples lie after the end of the recording by ``-rate`` times its length.
    """

    name = "accel-clock"
    summary = "The accelerometer's clock runs fast or slow: its samples drift away from the motion of the arm."
    sensor = SensorKind.ACCEL
