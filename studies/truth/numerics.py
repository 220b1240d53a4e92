"""Numerical steps that several simulators share: a Runge-Kutta step, a quintic step, a cross product."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]


def cross(a: Array, b: Array) -> Array:
    """Cross product along the last axis; numpy's is slow on small arrays."""
    result = np.empty(np.broadcast_shapes(a.shape, b.shape))
    result[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    result[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    result[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result


def quintic_step(x: float) -> tuple[float, float, float]:
    """Value, slope and second derivative of a quintic that goes from 0 to 1, at rest at both ends and beyond them."""
    x = min(max(x, 0.0), 1.0)
    value, slope = x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * x**2 * (1.0 - x) ** 2
    return value, slope, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)


def runge_kutta_step(
    derivative: Callable[[float, Array, float], Array], time: float, state: Array, step: float
) -> Array:
    """State after one classical Runge-Kutta step.

    Parameters
    ----------
    derivative : callable
        Time, state and the time at which actions are looked up -> derivative of the state. Actions are held between
        samples and jump at the end of a step: the last stage looks up those just before it.
    time, step : float; start and length of the step [s]
    state : (n,) array
    """
    middle = time + 0.5 * step
    k1 = derivative(time, state, time)
    k2 = derivative(middle, state + 0.5 * step * k1, middle)
    k3 = derivative(middle, state + 0.5 * step * k2, middle)
    k4 = derivative(time + step, state + step * k3, time + step * (1.0 - 1e-9))
    return state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def substeps(start: float, stop: float, largest: float) -> Iterator[tuple[float, float]]:
    """Start and size of the equal steps, none above the largest, that lead from start to stop, either way [s]."""
    count = int(np.ceil(abs(stop - start) / largest - 1e-9))
    for index in range(count):
        size = (stop - start) / count
        yield start + index * size, size
