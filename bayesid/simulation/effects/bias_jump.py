"""Effects of a sensor's constant error that jumps at an instant."""

from __future__ import annotations

from typing import ClassVar

from jax import Array

from bayesid.simulation.effects.effect import Situation
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.effects.events import Events
from bayesid.simulation.effects.register import register
from bayesid.simulation.effects.systematic_faults import SensorBias
from bayesid.simulation.instant import Readings
from bayesid.simulation.sensors import SensorKind

__all__ = ["AccelBiasJump", "BiasJump", "RateBiasJump"]


class BiasJump(Events):
    """Jump of a sensor's constant error at an instant of a recording, which stays until its end; sensor axes.

    A jump is at most as large as the constant error of the same class of instruments (`SensorBias`).
    """

    sensor: ClassVar[SensorKind]
    separated_by = (
        "The reading jumps but the motion does not: the other sensors of the base do not respond. Record at rest, "
        "across changes of range or supply: the bias of a faulty instrument jumps at rest, too."
    )

    @classmethod
    def lacks(cls, model: Situation) -> str | None:
        """Return the sensor where it is not declared."""
        return None if model.sensor(cls.sensor) else f"[{cls.sensor.section}]"

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the constant error of the poorest instruments."""
        return SensorBias.of(self.sensor)().physical_bounds(model)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Return the readings with the jumps added."""
        key = self.sensor.value
        begun = self.begun(readings.time, readings.recording)
        return readings.replace(**{key: readings.channels[key] + begun @ self.each(values)})


def _of_axes(kind: SensorKind) -> tuple[tuple[str, str, float], ...]:
    return tuple((axis, kind.unit, kind.instrument.bias_sigma) for axis in "xyz")


@register
class RateBiasJump(BiasJump):
    """Jump of the gyro's constant error."""

    name = "rate-bias-jump"
    summary = "The bias of the gyro jumps at one instant, for example after a change of temperature or range."
    sensor = SensorKind.RATE
    amplitude = _of_axes(SensorKind.RATE)


@register
class AccelBiasJump(BiasJump):
    """Jump of the accelerometer's constant error."""

    name = "accel-bias-jump"
    summary = "The bias of the accelerometer jumps at one instant, for example after a shock or a change of range."
    sensor = SensorKind.ACCEL
    amplitude = _of_axes(SensorKind.ACCEL)
