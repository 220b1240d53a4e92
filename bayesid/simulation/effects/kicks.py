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
    """External impulses, each much shorter than a sample interval.

    Each kick gives the robot a momentum and an angular momentum, which are constant in inertial space from then on.
    The rate of the base jumps at the instant of the kick, whatever the integration step.

    The accelerometer takes no sample during the push, so the motion of the base depends only on the angular momentum of
    a kick about the common centre of mass, and that is what a diagnosis reports.

    Parameters
    ----------
    place : str
        As of `Events`.
    momentum : bool
        Whether the momentum is a parameter, in addition to the angular momentum about the base origin.
    """

    name = "kicks"
    summary = (
        "The base receives an external impulse at one or a few instants, such as a contact or the separation of a part."
    )
    separated_by = (
        "The rates jump and do not return, unlike after an exchange of momentum with a wheel or a panel. Repeat the "
        "motion: a contact recurs at the same posture, an external hit does not."
    )
    states = 3
    # with J and P the angular momentum about the base origin and the momentum of each kick, the angular momentum about
    # the common centre of mass is x = sum (J - c x P) + u, with u' = -w x x + sum c' x P in base axes
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
        angular, reason = CONTACT * size.inertia, f"A kick changes the rate of the base by at most {CONTACT:g} rad/s"
        momentum = PhysicalBound("N s", angular / size.radius, f"{reason}, acting at the base's radius.")
        whole = PhysicalBound(
            "N m s", angular, f"{reason}, and the inertia of the base is {three_digits(size.inertia)} kg m2."
        )
        return (momentum, whole) if len(self.amplitude) > 3 else (whole,)

    def _received(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum received so far, and the angular momentum about the common centre of mass."""
        environment = instant.environment
        total = self.begun(environment.time, environment.recording) @ self.each(values)
        linear = total[:3] if len(self.amplitude) > 3 else jnp.zeros(3)
        return linear, total[-3:] - jnp.cross(instant.body.com, linear) + inner

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return what was received, with the opposite sign, and its derivative in base axes."""
        _, received = self._received(values, instant, inner)
        return -received, jnp.cross(instant.rate, received)

    def derivative(self, values: Array, instant: Instant, inner: Array) -> Array:
        """Return the change of what was received in base axes, with a constant lever."""
        linear, received = self._received(values, instant, inner)
        return jnp.cross(instant.body.com_rate, linear) - jnp.cross(instant.rate, received)
