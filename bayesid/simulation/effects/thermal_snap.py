"""Effect of a solar panel that snaps as it enters light or shadow."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Situation
from bayesid.simulation.effects.effect_parameters import PhysicalBound, three_digits
from bayesid.simulation.effects.events import Events
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Instant

__all__ = ["ThermalSnap"]

SNAP = 0.01
"""Largest rate that a snap gives the base [rad/s]; assumed, since a panel that is bent by the light weighs much less
than the base and moves by centimetres."""


@register
class ThermalSnap(Events):
    """Angular momentum that a panel takes from the base at an instant, relative to it, base axes.

    There are two forms. In the first, the panel takes the momentum at once and returns it exponentially with the decay
    time; afterwards the base has turned but is at rest again. This happens if the panel bends as fast as its
    temperature changes (J. D. Johnston and E. A. Thornton, Thermally induced dynamics of satellite solar panels,
    Journal of Spacecraft and Rockets 37, 2000). In the second, the panel takes the momentum gradually, with that time
    constant, and retains it; the base feels a torque that starts suddenly and decays. An event's shape is the decay
    time [s], and 1 if the momentum is retained, else 0.

    Parameters
    ----------
    place : str
        As of `Events`, such as ``1@52/4/0``.
    """

    name = "thermal-snap"
    summary = (
        "A panel or boom snaps, for example at sunrise or sunset: it exchanges momentum with the base and settles."
    )
    separated_by = (
        "The snap occurs at sunrise or sunset and does not depend on motion: record at rest across both, and repeat "
        "the motion at a different point of the orbit."
    )
    amplitude = tuple((f"angular_momentum.{axis}", "N m s", 0.1) for axis in "xyz")
    trial_shapes = tuple((decay, kept) for kept in (0.0, 1.0) for decay in (2.0, 4.0, 8.0, 16.0))

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return what gives the base the largest rate of a snap."""
        inertia = RobotSize.of(model.robot).inertia
        reason = f"A snap changes the rate of a base of {three_digits(inertia)} kg m2 by at most {SNAP:g} rad/s."
        return (PhysicalBound("N m s", SNAP * inertia, reason),)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum that the panel has, and its derivative."""
        environment = instant.environment
        decay, kept = jnp.asarray(self.shapes).T
        since = jnp.maximum(environment.time - jnp.asarray(self.times), 0.0)
        begun = self.begun(environment.time, environment.recording)
        left = begun * jnp.exp(-since / decay)
        share = jnp.where(kept > 0.5, begun - left, left)
        slope = jnp.where(kept > 0.5, left, -left) / decay
        amplitudes = self.each(values)
        return share @ amplitudes, slope @ amplitudes
