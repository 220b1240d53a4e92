"""Effect of a star sensor that is turned against its stated mounting."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
from jax import Array

from bayesid._math.rotation import tilted
from bayesid.simulation.effects.effect_parameters import Parameter
from bayesid.simulation.effects.physical_bound import PhysicalBound
from bayesid.simulation.effects.register import register
from bayesid.simulation.effects.sensor_faults import MISMOUNTED, SensorFault
from bayesid.simulation.sensors import SensorKind

if TYPE_CHECKING:
    from bayesid.simulation.model import Model

__all__ = ["AttitudeMisalignment"]


@register
class AttitudeMisalignment(SensorFault):
    """Constant rotation of the measured attitude in base axes, the prior being two degrees per axis.

    The measured base axes are the true ones turned by the rotation vector (x, y, z) in base axes, which is also the
    sense of the sensor's noise and residual: ``measured = true * rotation(x, y, z)`` for attitudes from base to orbit
    axes.

    The reading at the first sample shows it where the recording's initial attitude is exact. Where that attitude is
    unknown, its error takes up the rotation at that instant. What is left then shows while the base turns about another
    axis, by the angle of turn times the misalignment, and where the recorded rate, or the direction of the Earth in a
    gravity gradient, tells the true axes. The same error in all recordings, with initial attitudes of their own, is a
    misalignment more than it is any of those.
    """

    name = "attitude-misalignment"
    summary = "The star sensor is turned against its stated mounting: every measured attitude has the same error."
    separated_by = (
        "It is the same rotation in base axes in every attitude: turn the base by large angles about each axis in turn."
    )
    sensor = SensorKind.ATTITUDE

    def __init__(self, sigma: float = 0.03) -> None:
        self.parameters = tuple(Parameter(axis, "rad", sigma) for axis in "xyz")

    def physical_bounds(self, model: Model) -> tuple[PhysicalBound, ...]:
        """Return the rotation of a sensor that nobody measured."""
        return (PhysicalBound("rad", *MISMOUNTED),)

    def change(self, values: Array, time: Array, reading: Array) -> Array:
        """Return the turned attitudes, quaternions (T, 4)."""
        square = values @ values
        # tilted() turns by twice the arctangent of half of what it is given
        vector = values * (1.0 + square / 12.0 + square**2 / 120.0)
        return jax.vmap(tilted, (0, None))(reading, vector)
