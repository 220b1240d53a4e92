"""Evidence of a body of positive mass at a bounded place, from the Gram of its ten moments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from bayesid._math.arrays import Floats
from bayesid._math.log_sum import log_sum

__all__ = ["MissingBody", "MissingBodyPrior", "body_log_evidence", "outer_moments", "rigid_moments"]

ITERATIONS = 60
"""Most steps of the search for the mode."""

STEP = 1e-6
"""Step of the derivative of the moments, relative to the prior's widths."""

PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Entries of a symmetric matrix in the order of the ten moments."""


@dataclass(frozen=True)
class MissingBodyPrior:
    """Prior of a body that the model lacks.

    The logarithm of the mass has the mean and the variance of a uniform one, the place is normal about the origin, and
    the inertia per mass about the body's own centre is normal about zero.

    Attributes
    ----------
    lightest, heaviest : float
        Range of the mass [kg].
    reach : float
        Largest distance from the origin, two standard deviations of the place [m].
    radius : float
        Radius of gyration of the body itself [m]; 0 for a point.
    """

    lightest: float
    heaviest: float
    reach: float
    radius: float = 0.0

    @property
    def mean(self) -> Floats:
        """Mean of the logarithm of the mass, the place and, of a body with extent, its six moments per mass."""
        size = 10 if self.radius > 0.0 else 4
        return np.concatenate([[0.5 * np.log(self.lightest * self.heaviest)], np.zeros(size - 1)])

    @property
    def sd(self) -> Floats:
        """Standard deviations of the same."""
        spread = max(np.log(self.heaviest / self.lightest), 1e-3) / np.sqrt(12.0)
        own = np.full(6, self.radius**2) if self.radius > 0.0 else np.zeros(0)
        return np.concatenate([[spread], np.full(3, 0.5 * self.reach), own])


@dataclass(frozen=True)
class MissingBody:
    """What is known beforehand of a body that a cause adds.

    Attributes
    ----------
    heaviest : float
        Largest mass [kg].
    reach : float
        Largest distance from the origin [m].
    radii : tuple of float
        Radii of gyration that are equally probable [m]; 0 for a point.
    moments : callable
        The ten moments that are the cause's amplitudes, of the logarithm of the mass, the place and so on.
    """

    heaviest: float
    reach: float
    radii: tuple[float, ...]
    moments: Callable[[Floats], Floats]

    def log_evidence(self, matrix: Floats, score: Floats, lightest: float) -> float:
        """Return the log evidence of the body relative to no body, averaged over its size.

        Parameters
        ----------
        matrix : (10, 10) array
            Information on the moments.
        score : (10,) array
        lightest : float
            Mass below which the data cannot see it [kg].
        """
        length = np.sqrt(np.diag(matrix))
        ridge = np.diag(1e-9 * np.maximum(length, 1e-9 * length.max(initial=1.0)) ** 2)
        linear = -np.linalg.solve(matrix + ridge, score)
        light = min(lightest, 0.5 * self.heaviest)
        values = [
            body_log_evidence(
                matrix, score, MissingBodyPrior(light, self.heaviest, self.reach, radius), self.moments, linear
            )
            for radius in self.radii
        ]
        return log_sum(values) - float(np.log(len(values)))


def rigid_moments(theta: Floats) -> Floats:
    """Return mass, first moment and inertia about the origin of rigid bodies, shape (..., 10) for (..., n)."""
    mass, place = np.exp(theta[..., :1]), theta[..., 1:4]
    square = (place**2).sum(axis=-1)
    second = np.stack([(square if i == j else 0.0) - place[..., i] * place[..., j] for i, j in PAIRS], axis=-1)
    if theta.shape[-1] > 4:
        second = second + theta[..., 4:]
    return np.concatenate([mass, mass * place, mass * second], axis=-1)


def outer_moments(theta: Floats) -> Floats:
    """Return mass, first and second moment of mass of point masses, shape (..., 10) for (..., n)."""
    mass, place = np.exp(theta[..., :1]), theta[..., 1:4]
    second = np.stack([place[..., i] * place[..., j] for i, j in PAIRS], axis=-1)
    return np.concatenate([mass, mass * place, mass * second], axis=-1)


def body_log_evidence(
    matrix: Floats, score: Floats, prior: MissingBodyPrior, moments: Callable[[Floats], Floats], linear: Floats
) -> float:
    """Return the Laplace approximation of the log evidence of a body relative to no body.

    Parameters
    ----------
    matrix : (10, 10) array
        Information on the ten moments.
    score : (10,) array
        The likelihood of moments ``a`` relative to none is ``exp(-score'a - a'matrix a / 2)``.
    prior : MissingBodyPrior
    moments : callable
        The ten moments of the logarithm of the mass, the place and so on, the last axis for the last axis.
    linear : (10,) array
        Moments from which a search starts, such as those that a linear fit gives.
    """
    return max(_from(start, matrix, score, prior, moments) for start in _starts(prior, linear))


def _starts(prior: MissingBodyPrior, linear: Floats) -> list[Floats]:
    """Return starting points: the linear fit where it has a mass, and light bodies at the linear fit's direction."""
    starts = []
    first = linear[1:4]
    length = float(np.linalg.norm(first))
    masses = [linear[0]] if linear[0] > prior.lightest else []
    masses += [length / (share * prior.reach) for share in (0.1, 0.4) if length > 0.0]
    for mass in masses or [np.sqrt(prior.lightest * prior.heaviest)]:
        mass = float(np.clip(mass, prior.lightest, prior.heaviest))
        place = np.clip(first / mass, -prior.reach, prior.reach)
        starts.append(np.concatenate([[np.log(mass)], place, np.zeros(len(prior.mean) - 4)]))
    return starts


def _from(
    theta: Floats, matrix: Floats, score: Floats, prior: MissingBodyPrior, moments: Callable[[Floats], Floats]
) -> float:
    """Return the log evidence about the mode that a Levenberg-Marquardt search reaches, in prior deviations."""
    mean, sd = prior.mean, prior.sd
    x = (theta - mean) / sd
    damping = 1e-2

    def cost(x: Floats) -> float:
        a = moments(mean + sd * x)
        return float(score @ a + 0.5 * a @ matrix @ a + 0.5 * x @ x)

    here = cost(x)
    for _ in range(ITERATIONS):
        slope = _slope(x, mean, sd, moments)
        a = moments(mean + sd * x)
        hessian = slope.T @ matrix @ slope + np.eye(len(x))
        gradient = slope.T @ (score + matrix @ a) + x
        step = -sla.solve(hessian + damping * np.diag(np.diag(hessian)), gradient, assume_a="pos")
        there = cost(x + step)
        if np.isfinite(there) and there <= here:
            x, damping, change = x + step, 0.2 * damping, here - there
            here = there
            if change < 1e-4:
                break
        else:
            damping *= 8.0
            if damping > 1e9:
                break
    slope = _slope(x, mean, sd, moments)
    half_log_det = 0.5 * float(np.linalg.slogdet(slope.T @ matrix @ slope + np.eye(len(x)))[1])
    return -here - half_log_det


def _slope(x: Floats, mean: Floats, sd: Floats, moments: Callable[[Floats], Floats]) -> Floats:
    """Return the derivatives of the moments in prior deviations, shape (10, n), by central differences."""
    steps = STEP * np.eye(len(x))
    return (moments(mean + sd * (x + steps)) - moments(mean + sd * (x - steps))).T / (2.0 * STEP)
