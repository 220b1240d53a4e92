"""Faults of the sensors: measured = true + bias, in sensor axes."""

from __future__ import annotations

from jax import Array

from bayesid.effects.base import Effect, Parameter, Readings, register

__all__ = ["AccelBias", "RateBias"]


@register
class RateBias(Effect):
    """Constant error of the measured rate; the default prior is a degree per hour and a half."""

    name = "rate-bias"
    summary = "The rate sensor reads a constant when the base is at rest."

    def __init__(self, sigma: float | tuple[float, float, float] = 7.0e-6) -> None:
        self.parameters = _axes("rad/s", sigma)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Add the bias."""
        return readings._replace(rate=readings.rate + values)


@register
class AccelBias(Effect):
    """Constant error of the accelerometer; the default prior is 10 micro-g."""

    name = "accel-bias"
    summary = "The accelerometer reads a constant in free fall."

    def __init__(self, sigma: float | tuple[float, float, float] = 1.0e-4) -> None:
        self.parameters = _axes("m/s2", sigma)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Add the bias."""
        return readings._replace(accel=readings.accel + values)


def _axes(unit: str, sigma: float | tuple[float, float, float]) -> tuple[Parameter, ...]:
    values = (sigma,) * 3 if isinstance(sigma, int | float) else sigma
    return tuple(Parameter(axis, unit, float(value)) for axis, value in zip("xyz", values, strict=True))
