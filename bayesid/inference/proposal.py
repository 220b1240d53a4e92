"""Multivariate Student-t about the mode, the proposal of importance sampling and of the independence move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln

from bayesid._math.arrays import Floats

__all__ = ["StudentT"]


@dataclass(frozen=True)
class StudentT:
    """Multivariate Student-t distribution.

    Parameters
    ----------
    mean : (n,) array
        Centre of the distribution.
    factor : (n, n) array
        Lower Cholesky factor of the scale matrix.
    freedom : float
        Degrees of freedom.
    """

    mean: Floats
    factor: Floats
    freedom: float

    @classmethod
    def about(cls, mean: Floats, covariance: Floats) -> StudentT:
        """Return the proposal for a posterior of this mode and covariance.

        Its degrees of freedom are twice the number of dimensions and at least eight: the tails are heavier than the
        posterior's, but not so heavy that most draws in many dimensions lie outside the posterior.
        """
        return cls(mean, np.linalg.cholesky(covariance), max(8.0, 2.0 * len(mean)))

    def draw(self, count: int, rng: np.random.Generator | np.random.RandomState) -> Floats:
        """Draw points from the distribution, shape (count, n)."""
        normal = rng.normal(size=(count, len(self.mean)))
        mixing = np.sqrt(self.freedom / rng.chisquare(self.freedom, size=count))
        return self.mean + mixing[:, None] * (normal @ self.factor.T)

    def log_density(self, z: Floats) -> Floats:
        """Return the log density at points, shape (count, n) -> (count,)."""
        n, nu = len(self.mean), self.freedom
        scaled = np.linalg.solve(self.factor, (z - self.mean).T)
        constant = gammaln(0.5 * (nu + n)) - gammaln(0.5 * nu) - 0.5 * n * np.log(nu * np.pi)
        constant -= np.log(np.diag(self.factor)).sum()
        return constant - 0.5 * (nu + n) * np.log1p((scaled**2).sum(axis=0) / nu)
