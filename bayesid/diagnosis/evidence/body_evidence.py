"""Evidence of a body of positive mass at a bounded place, from the Gram of its ten moments.

The evidence is Laplace's approximation (L. Tierney and J. B. Kadane, Accurate approximations for posterior moments and
marginal densities, JASA 81, 1986) about a mode that is found by damped least squares (D. W. Marquardt, An algorithm for
least-squares estimation of nonlinear parameters, J. SIAM 11, 1963).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesid._math.arrays import Floats, log_sum
from bayesid._math.least_squares import levenberg_marquardt

__all__ = ["MissingBody", "outer_moments", "rigid_moments"]

ROUNDING = 1e-14  # smallest eigenvalue of an information on scaled moments, relative to the largest
TOLERANCE = 1e-8  # of the search for the mode
STEP = 1e-6  # of the derivative of the moments, relative to the prior's widths
PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # a symmetric matrix in the order of the ten moments


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
        """Return the Laplace approximation of the log evidence of the body relative to none, averaged over its size.

        Parameters
        ----------
        matrix : (10, 10) array
            Information on the moments.
        score : (10,) array
            The likelihood of moments ``a`` relative to none is ``exp(-score'a - a'matrix a / 2)``.
        lightest : float
            Mass below which the data cannot see it [kg].
        """
        length = np.sqrt(np.diag(matrix))
        ridge = np.diag(1e-9 * np.maximum(length, 1e-9 * length.max(initial=1.0)) ** 2)
        linear = -np.linalg.solve(matrix + ridge, score)
        bodies = [
            _SizedBody(min(lightest, 0.5 * self.heaviest), self.heaviest, self.reach, radius, self.moments)
            for radius in self.radii
        ]
        values = [max(body.log_evidence(x, matrix, score) for x in body.starts(linear)) for body in bodies]
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


@dataclass(frozen=True)
class _SizedBody:
    """A body of one radius of gyration, in prior standard deviations ``x``.

    The logarithm of the mass has the mean and the variance of a uniform one between the lightest and the heaviest, the
    place is normal about the origin, the reach being two standard deviations, and the inertia per mass about the body's
    own centre is normal about zero; of a point there is none.
    """

    lightest: float
    heaviest: float
    reach: float
    radius: float
    moments: Callable[[Floats], Floats]

    @cached_property
    def mean(self) -> Floats:
        """Mean of the logarithm of the mass, the place and, of a body with extent, its six moments per mass."""
        size = 10 if self.radius > 0.0 else 4
        return np.concatenate([[0.5 * np.log(self.lightest * self.heaviest)], np.zeros(size - 1)])

    @cached_property
    def sd(self) -> Floats:
        """Standard deviations of the same."""
        spread = max(np.log(self.heaviest / self.lightest), 1e-3) / np.sqrt(12.0)
        extent = np.full(len(self.mean) - 4, self.radius**2)
        return np.concatenate([[spread], np.full(3, 0.5 * self.reach), extent])

    def amplitudes(self, x: Floats) -> Floats:
        """Return the ten moments, shape (..., 10)."""
        return self.moments(self.mean + self.sd * x)

    def slope(self, x: Floats) -> Floats:
        """Return the derivatives of the moments, shape (10, n), by central differences."""
        steps = STEP * np.eye(len(x))
        return (self.amplitudes(x + steps) - self.amplitudes(x - steps)).T / (2.0 * STEP)

    def starts(self, linear: Floats) -> list[Floats]:
        """Return starting points: the linear fit, (10,), where it has a mass, and light bodies in its direction."""
        starts: list[Floats] = []
        first = linear[1:4]
        length = float(np.linalg.norm(first))
        masses = [linear[0]] if linear[0] > self.lightest else []
        masses += [length / (share * self.reach) for share in (0.1, 0.4) if length > 0.0]
        for mass in masses or [np.sqrt(self.lightest * self.heaviest)]:
            mass = float(np.clip(mass, self.lightest, self.heaviest))
            place = np.clip(first / mass, -self.reach, self.reach)
            theta = np.concatenate([[np.log(mass)], place, np.zeros(len(self.mean) - 4)])
            starts.append((theta - self.mean) / self.sd)
        return starts

    def log_evidence(self, x: Floats, matrix: Floats, score: Floats) -> float:
        """Return the log evidence about the mode that a Levenberg-Marquardt search reaches from a point."""
        length = np.sqrt(np.diag(matrix))
        length[length == 0.0] = 1.0
        values, vectors = np.linalg.eigh(matrix / np.outer(length, length))
        seen = values > ROUNDING * values[-1]
        whitening = vectors[:, seen].T / np.sqrt(values[seen])[:, None]
        pull = whitening @ (score / length)
        root = (values[seen][:, None] * whitening) * length

        def residual(x: Floats) -> Floats:
            return np.concatenate([root @ self.amplitudes(x) + pull, x])

        def derivative(x: Floats) -> Floats:
            return np.concatenate([root @ self.slope(x), np.eye(len(x))])

        mode = levenberg_marquardt(residual, derivative, x, TOLERANCE)
        least, x = float(mode.cost - 0.5 * pull @ pull), mode.x
        slope = self.slope(x)
        return -least - 0.5 * float(np.linalg.slogdet(slope.T @ matrix @ slope + np.eye(len(x)))[1])
