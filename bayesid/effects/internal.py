"""Moving parts inside the base."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from bayesid.effects.base import Effect, Moment, Parameter, register

__all__ = ["WheelMomentum"]


@register
class WheelMomentum(Effect):
    """Residual momentum of reaction wheels at constant speed, in base axes.

    The prior of 1 N m s is the capacity of a small wheel: a resting attitude control leaves less than that.
    """

    name = "wheel-momentum"
    summary = (
        "Reaction wheels left spinning make the base a gyroscope: turning it about one axis turns it about another."
    )

    def __init__(self, sigma: float = 1.0) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def momentum(self, values: Array, moment: Moment, inner: Array) -> tuple[Array, Array]:
        """Return the wheels' momentum; they keep their speed."""
        return values, jnp.zeros(3)
