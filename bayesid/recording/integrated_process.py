"""Increments of a position whose derivative of some order is white noise, with instants at which a derivative jumps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats

__all__ = ["HIGHER", "IntegratedProcess", "Jump", "covariances_by_distance", "jump_moments"]

HIGHER = 0.3
"""Variance of the jump of each derivative relative to that of the one below it, in scaled time."""


class Jump(NamedTuple):
    """Jump of a derivative of a position, of normal size and at an instant known to lie in one of some steps."""

    first: int  #: number of the first of the steps, which lie between two nodes each and follow one another
    derivative: int  #: 2 for the acceleration, 3 for the jerk
    #: variance of the jump times the probability of each of the equal parts of each step, in scaled time
    variances: tuple[tuple[float, ...], ...]

    @property
    def steps(self) -> range:
        """Numbers of the steps."""
        return range(self.first, self.first + len(self.variances))

    def within(self, steps: range) -> Jump:
        """Return the part of the jump in some of its steps, which are numbered anew from zero."""
        kept = self.variances[max(steps.start - self.first, 0) : max(steps.stop - self.first, 0)]
        return Jump(max(self.first - steps.start, 0), self.derivative, kept)

    @property
    def variance(self) -> float:
        """Variance of the jump wherever it is."""
        return float(sum(map(sum, self.variances)))


def jump_moments(derivative: int, order: int, step: Floats, weights: Floats) -> Floats:
    """Return the mean product of what a unit jump adds until the end of its step to a position and its derivatives.

    Where a derivative jumps, the higher ones do, too, independently and less far in scaled time (`HIGHER`).

    Parameters
    ----------
    derivative : int
        Order of the lowest derivative that jumps.
    order : int
        Number of states: the position and its derivatives.
    step : (n,) array
        Lengths of steps in scaled time.
    weights : (n, parts) array
        Weight of each of the equal parts of each step, in which the jump is uniform.

    Returns
    -------
    (n, order, order) array
    """
    summed = np.zeros((len(step), order, order))
    for jumping in range(derivative, order):
        unit, powers = _moments_of_unit_step(jumping, weights.shape[1])
        size = len(powers)
        moments = (weights @ unit.reshape(len(unit), -1)).reshape(-1, size, size)
        summed[:, :size, :size] += HIGHER ** (jumping - derivative) * moments * step[:, None, None] ** powers
    return summed


@lru_cache(maxsize=32)
def _moments_of_unit_step(derivative: int, parts: int) -> tuple[Floats, Floats]:
    """Return the moments for a step of one, and the power of the step with which each grows."""
    powers = derivative - np.arange(derivative + 1)
    factorial = np.array([math.factorial(power) for power in powers])
    total = np.asarray(powers[:, None] + powers, dtype=float)
    ends = np.linspace(1.0, 0.0, parts + 1)[:, None, None] ** (total + 1.0)
    return (ends[:-1] - ends[1:]) * parts / ((total + 1.0) * np.outer(factorial, factorial)), total


class IntegratedProcess:
    """Increments of the derivatives of a position between nodes, in scaled time.

    Parameters
    ----------
    step : (n - 1,) array
        Scaled time between nodes.
    order : int
        Order of the derivative of the position that is white noise; the states are the derivatives below it.
    jumps : sequence of Jump
        Jumps of a derivative below the order. The instant of a jump is uniform within each part of its steps.
    roughness : (n - 1,) array, optional
        Factor on the variance of the increments of each step, by default one; jumps are not changed by it.
    """

    def __init__(self, step: Floats, order: int, jumps: Sequence[Jump] = (), roughness: Floats | None = None) -> None:
        self.order, self.count = order, len(step)
        self._roughness = np.ones(len(step)) if roughness is None else roughness
        powers = np.arange(order)
        lift = powers[None, :] - powers[:, None]
        factorial = np.array([math.factorial(max(int(value), 0)) for value in lift.ravel()]).reshape(lift.shape)
        self.transition = np.where(lift >= 0, step[:, None, None] ** np.maximum(lift, 0) / factorial, 0.0)
        self._step = step
        inverse = np.linalg.inv(_unit(order))
        self._precision = inverse * step[:, None, None] ** -_exponent(order) / self._roughness[:, None, None]
        self._logdet = len(step) * np.linalg.slogdet(inverse)[1] - order**2 * np.log(step).sum()
        self._logdet -= order * np.log(self._roughness).sum()
        self._added: dict[int, Floats] = {}
        for jump in jumps:
            moments = jump_moments(jump.derivative, order, step[jump.steps], np.array(jump.variances))
            for place, moment in zip(jump.steps, moments, strict=True):
                self._added[place] = self._added.get(place, 0.0) + moment
        self._jumped = np.array(sorted(self._added), dtype=np.intp)
        self._jumps = np.array([self._added[place] for place in sorted(self._added)]).reshape(-1, order, order)

    @cached_property
    def _usual(self) -> Floats:
        """Covariance for an intensity of one in the steps that hold a jump."""
        roughness = self._roughness[self._jumped, None, None]
        return _unit(self.order) * self._step[self._jumped, None, None] ** _exponent(self.order) * roughness

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

    def covariance(self, intensity: float, place: int) -> Floats:
        """Return the covariance of the increments of one step, (order, order).

        Parameters
        ----------
        intensity : float
            Standard deviation of the white noise that is integrated, in scaled time.
        place : int
            Index of the step.
        """
        usual = _unit(self.order) * self._step[place] ** _exponent(self.order) * intensity**2 * self._roughness[place]
        return np.asarray(usual + self._added.get(place, 0.0))

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


def covariances_by_distance(factor: Floats, order: int) -> Iterator[Floats]:
    """Yield the covariances of all nodes of a Gaussian Markov chain with the node 0, 1, 2 and so on places after them.

    Write the precision as ``L L'`` with the lower factor ``L`` in blocks of one node each, which couple neighbours
    alone. The states then obey ``x_i = L_ii^-T e_i + G_i x_(i+1)`` with ``G_i = -L_ii^-T L_(i+1,i)'`` and independent
    standard normal ``e_i``, so that the covariance of a node with itself follows from that of the next one, and the
    covariance with a node ``d`` places on is ``G_i`` times the covariance of the next node with it (Takahashi, Fagan
    and Chen 1973; Rauch, Tung and Striebel 1965). The cost grows linearly with the number of nodes; columns of the
    inverse would make it grow with its square.

    Parameters
    ----------
    factor : (2 order, n order) array
        Lower Cholesky factor of the precision, ``factor[d, j] = L[j + d, j]``.
    order : int
        Number of states of a node.

    Yields
    ------
    (n - d, order, order) array
        Covariances of the states of node ``i`` with those of node ``i + d``.
    """
    count = factor.shape[1] // order
    diagonal, coupling = np.zeros((count, order, order)), np.zeros((count, order, order))
    for column in range(order):
        for row in range(2 * order):
            block = diagonal if row < order else coupling
            if row >= column:
                block[:, row % order, column] = factor[row - column, column::order]
    inverse = np.linalg.solve(diagonal, np.broadcast_to(np.eye(order), diagonal.shape))
    noise = inverse.transpose(0, 2, 1) @ inverse
    gain = -inverse.transpose(0, 2, 1) @ coupling.transpose(0, 2, 1)
    covariance = np.empty_like(diagonal)
    covariance[-1] = noise[-1]
    for node in range(count - 2, -1, -1):
        covariance[node] = noise[node] + gain[node] @ covariance[node + 1] @ gain[node].T
    while len(covariance):
        yield covariance
        covariance = gain[: len(covariance) - 1] @ covariance[1:]
