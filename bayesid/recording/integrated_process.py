"""Increments of a position whose derivative of some order is white noise, with instants at which a derivative jumps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats

__all__ = ["IntegratedProcess", "Jump"]


class Jump(NamedTuple):
    """Jump of a derivative of a position, of normal size and at an instant known to lie in one of some steps.

    Attributes
    ----------
    first : int
        Number of the first of the steps, which lie between two nodes each and follow one another.
    derivative : int
        2 for the acceleration, 3 for the jerk.
    variances : tuple of float
        Variance of the jump times the probability of each step, in scaled time.
    """

    first: int
    derivative: int
    variances: tuple[float, ...]


class IntegratedProcess:
    """Increments of the derivatives of a position between nodes, in scaled time.

    Parameters
    ----------
    step : (n - 1,) array
        Scaled time between nodes.
    order : int
        Order of the derivative of the position that is white noise; the states are the derivatives below it.
    jumps : sequence of Jump
        Jumps of a derivative below the order. The instant of a jump is uniform within its step.
    """

    def __init__(self, step: Floats, order: int, jumps: Sequence[Jump] = ()) -> None:
        self.order, self.count = order, len(step)
        powers = np.arange(order)
        lift = powers[None, :] - powers[:, None]
        factorial = np.array([math.factorial(max(int(value), 0)) for value in lift.ravel()]).reshape(lift.shape)
        self.transition = np.where(lift >= 0, step[:, None, None] ** np.maximum(lift, 0) / factorial, 0.0)
        self._step = step
        inverse = np.linalg.inv(_unit(order))
        self._precision = inverse * step[:, None, None] ** -_exponent(order)
        self._logdet = len(step) * np.linalg.slogdet(inverse)[1] - order**2 * np.log(step).sum()
        variance: dict[int, Floats] = {}
        for jump in jumps:
            own = jump.derivative + 1
            for place, size in enumerate(jump.variances, start=jump.first):
                added = variance.setdefault(place, np.zeros((order, order)))
                # white noise of the next derivative within the step has the moments of one jump at a uniform time
                added[:own, :own] += size * _unit(own) * step[place] ** (_exponent(own) - 1)
        self._jumped = np.array(sorted(variance), dtype=np.intp)
        self._jumps = np.array([variance[place] for place in sorted(variance)]).reshape(-1, order, order)

    @cached_property
    def _usual(self) -> Floats:
        """Covariance for an intensity of one in the steps that hold a jump."""
        return _unit(self.order) * self._step[self._jumped, None, None] ** _exponent(self.order)

    def precision(self, intensity: float) -> tuple[Floats, float]:
        """Return the precisions of the increments, (n - 1, order, order), and the sum of their log determinants."""
        process = self._precision * intensity**-2
        logdet = self._logdet - 2.0 * self.count * self.order * math.log(intensity)
        if len(self._jumped):
            covariance = self._usual * intensity**2 + self._jumps
            scale = 1.0 / np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
            scaled = np.linalg.inv(covariance * scale[:, :, None] * scale[:, None, :])
            wider = 0.5 * (scaled + scaled.transpose(0, 2, 1)) * scale[:, :, None] * scale[:, None, :]
            logdet -= float(np.linalg.slogdet(process[self._jumped])[1].sum())
            logdet += float((np.linalg.slogdet(scaled)[1] + 2.0 * np.log(scale).sum(axis=1)).sum())
            process[self._jumped] = wider
        return process, logdet

    def increments(self, states: Floats) -> Floats:
        """Return what the states (n, order) add to those carried over from the node before, (n - 1, order)."""
        return np.asarray(states[1:] - np.einsum("kij,kj->ki", self.transition, states[:-1]))


def _exponent(order: int) -> Floats:
    """Return the powers of a step in the covariance of the increments."""
    powers = np.arange(order, dtype=float)
    return np.asarray(2 * order - 1 - powers[:, None] - powers[None, :])


def _unit(order: int) -> Floats:
    """Return the covariance of the increments over a step of one for an intensity of one."""
    denominator = np.array([math.factorial(order - 1 - power) for power in range(order)])
    return np.asarray(1.0 / (_exponent(order) * np.outer(denominator, denominator)))
