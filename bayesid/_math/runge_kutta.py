"""One step of the classical Runge-Kutta method of fourth order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from jax import Array

__all__ = ["runge_kutta_step"]

G = TypeVar("G")


def runge_kutta_step(
    derivative: Callable[[Array, Any], Array], state: Array, size: Array, start: G, middle: G, end: G
) -> tuple[Array, Array, Array]:
    """Advance a state by one step.

    Parameters
    ----------
    derivative : callable
        Derivative of a state, given what is known of the instant.
    size : scalar array
        Length of the step.
    start, middle, end
        What is known at the beginning, middle and end of the step.

    Returns
    -------
    state, first, last : arrays
        The new state, and the derivatives with which the method entered and left the step (k1 and k4).
    """
    k1 = derivative(state, start)
    k2 = derivative(state + 0.5 * size * k1, middle)
    k3 = derivative(state + 0.5 * size * k2, middle)
    k4 = derivative(state + size * k3, end)
    return state + size / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), k1, k4
