"""Effect of kicks from outside: a contact, a part that separates, a micrometeoroid."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
from jax import Array

from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import PhysicalBound, three_digits
from bayesid.simulation.effects.events import Events
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Instant

__all__ = ["Kicks"]

CONTACT = 0.05
"""Largest rate that a kick gives the base [rad/s], three degrees per second; assumed, since more is no contact but a
collision."""


@register
class Kicks(Events):
    """Momentum and angular momentum that the robot receives from outside within much less than a sample interval.

    What was received keeps its direction in inertial space: with ``x`` the angular momentum received so far about the
    common centre of mass, ``x = sum (J - c x P) + u``, where ``u' = -w x x + sum c' x P`` carries it in base axes and
    leaves the lever where it was at the instant. As a momentum taken from the base it changes the rate at once,
    whatever the integration steps.

    A sensor that samples between does not see the push itself. One kick changes the motion by ``J - c x P`` alone, so
    that a diagnosis gives the angular momentum about the common centre of mass, with no momentum.

    Parameters
    ----------
    place : str
        As of `Events`.
    momentum : bool
        Whether the momentum is a parameter, beside the angular momentum about the base origin.
    """

    name = "kicks"
    summary = (
        "Something kicks the base from outside at an instant or a few, such as a contact or a part that separates."
    )
    separated_by = (
        "The rates jump and stay: the momentum does not come back, as it does from a wheel or a panel. Repeat the "
        "motion; a contact comes at the same posture, a hit from outside does not come again."
    )
    states = 3
    most_in_recording = 3

    def __init__(self, place: str = "", *, momentum: bool = True) -> None:
        linear = [(f"momentum.{axis}", "N s", 1.0) for axis in "xyz"] if momentum else []
        self.amplitude = (*linear, *((f"angular_momentum.{axis}", "N m s", 1.0) for axis in "xyz"))
        super().__init__(place)

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return kicks of angular momentum about the common centre of mass."""
        return [cls(momentum=False)]

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return what gives the base the largest rate of a kick."""
        size = RobotSize.of(model.robot)
        angular, reason = CONTACT * size.inertia, f"A kick turns the base by at most {CONTACT:g} rad/s"
        momentum = PhysicalBound("N s", angular / size.radius, f"{reason}, at the base's radius.")
        whole = PhysicalBound("N m s", angular, f"{reason}, and its inertia is {three_digits(size.inertia)} kg m2.")
        return (momentum, whole) if len(self.amplitude) > 3 else (whole,)

    def _received(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum received so far, and the angular momentum about the common centre of mass."""
        total = self.begun(instant.environment) @ self.each(values)
        linear = total[:3] if len(self.amplitude) > 3 else jnp.zeros(3)
        return linear, total[-3:] - jnp.cross(instant.body.com, linear) + inner

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return what was received, with the opposite sign, and its derivative in base axes."""
        _, received = self._received(values, instant, inner)
        return -received, jnp.cross(instant.rate, received)

    def derivative(self, values: Array, instant: Instant, inner: Array) -> Array:
        """Return the change of what was received in base axes, with its lever kept."""
        linear, received = self._received(values, instant, inner)
        return jnp.cross(instant.body.com_rate, linear) - jnp.cross(instant.rate, received)
