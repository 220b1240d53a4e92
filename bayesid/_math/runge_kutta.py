"""Step of the classical Runge-Kutta method of fourth order, and the slope where it ends."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

__all__ = ["STAGE_TIMES", "TABLEAU", "runge_kutta_stages", "runge_kutta_step", "split_nodes", "stage_inputs"]

G = TypeVar("G")
"""Type of the derivative's inputs at an instant."""

TABLEAU = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [1.0 / 2.0, 0.0, 0.0, 0.0],
        [0.0, 1.0 / 2.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
    ]
)
"""Weights of the four slopes in the state at which each slope is taken; the fifth state is that at the end."""

STAGE_TIMES = (0, 1, 1, 2, 2)
"""Time of each stage in halves of the step."""


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
        State at the end of the step, and its derivatives at the beginning and at the end.
    """
    states, slopes = runge_kutta_stages(derivative, state, size, stage_inputs(start, middle, end))
    return states[-1], slopes[0], slopes[-1]


def split_nodes(nodes: G) -> tuple[G, G, G]:
    """Return what stands at the beginnings, middles and ends of K steps, from arrays over their 2 K + 1 instants."""

    def part(first: int, stop: int | None) -> G:
        return jax.tree.map(lambda x: x[first:stop:2], nodes)

    return part(0, -1), part(1, None), part(2, None)


def stage_inputs(start: G, middle: G, end: G) -> G:
    """Return the inputs of the derivative at the five stages of a step, leading axis 5.

    Parameters
    ----------
    start, middle, end
        Inputs at the beginning, middle and end of the step.
    """
    return jax.tree.map(lambda *parts: jnp.stack(parts), start, middle, middle, end, end)


def runge_kutta_stages(
    derivative: Callable[[Array, Any], Array], state: Array, size: Array, inputs: Any
) -> tuple[Array, Array]:
    """Return the states at the five stages of a step and the slopes there, each with the leading axis 5.

    The slopes are taken in a loop: the derivative then stands once in the compiled code and not five times, which
    halves the time of its compilation.

    Parameters
    ----------
    derivative, state, size
        As of `runge_kutta_step`.
    inputs
        Inputs of the derivative at the stages (`stage_inputs`).
    """

    def stage(slopes: Array, given: tuple[Array, Array, Any]) -> tuple[Array, tuple[Array, Array]]:
        weights, index, inputs = given
        here = state + size * jnp.tensordot(weights, slopes, 1)
        slope = derivative(here, inputs)
        # the slope at the end belongs to no further state
        return slopes.at[index].set(slope, mode="drop"), (here, slope)

    given = (jnp.asarray(TABLEAU), jnp.arange(len(TABLEAU)), inputs)
    _, (states, slopes) = jax.lax.scan(stage, jnp.zeros((4, *state.shape)), given)
    return states, slopes
