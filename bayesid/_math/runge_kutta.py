"""Step of the classical Runge-Kutta method of fourth order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from jax import Array

__all__ = ["runge_kutta_step"]

G = TypeVar("G")
"""Type of the derivative's inputs at an instant."""


def runge_kutta_step(
    derivative: Callable[[Array, Any], Array], state: Array, size: Array, start: G, middle: G, end: G
) -> tuple[Array, Array, Array]:
    """Advance a state by one step.

    Parameters
    ----------
    derivative : callable
        Function of a state and of the inputs at an instant that returns the derivative of the state.
    state : array
        State at the beginning of the step.
    size : scalar array
        Length of the step.
    start, middle, end
        Inputs of the derivative at the beginning, middle and end of the step.

    Returns
    -------
    state, first, last : arrays
        State at the end of the step, and the first and last derivatives of the method (k1 and k4).
    """
    k1 = derivative(state, start)
    k2 = derivative(state + 0.5 * size * k1, middle)
    k3 = derivative(state + 0.5 * size * k2, middle)
    k4 = derivative(state + size * k3, end)
    return state + size / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4), k1, k4
