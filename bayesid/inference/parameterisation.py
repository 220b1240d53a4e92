"""Parameterisations of a posterior: log-Cholesky coordinates, or coordinates linear in the inertial parameters.

Both describe the same posterior. Where one unknown body is determined well, the posterior is nearly normal in
log-Cholesky coordinates. Where several bodies are known to a few per cent and the data determine combinations of them
far more sharply, the ridge of the posterior is straight only in coordinates linear in the parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import gammaln

from bayesid._math.arrays import Floats
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior

__all__ = ["LinearParameterisation", "LogCholeskyParameterisation", "Parameterisation", "StudentT"]


class Parameterisation(Protocol):
    """Change of coordinates of a posterior, for many points at once, shape (n, size)."""

    posterior: Posterior

    def to_z(self, y: Floats) -> Floats:
        """Return the posterior's coordinates z, which are NaN outside the support."""
        ...

    def log_density(self, y: Floats) -> Floats:
        """Return the log posterior density over y, shape (n,)."""
        ...

    def log_densities(self, y: Floats) -> Floats:
        """Return the log posterior density over y, together with the log likelihoods of R recordings, (n, 1 + R)."""
        ...

    def proposal(self, optimum: Optimum) -> StudentT:
        """Return a Student-t proposal over y about the mode."""
        ...


class LogCholeskyParameterisation:
    """Coordinates z of the posterior itself, in which bodies are log-Cholesky coordinates."""

    def __init__(self, posterior: Posterior) -> None:
        self.posterior = posterior

    def to_z(self, y: Floats) -> Floats:
        """Return the coordinates unchanged."""
        return y

    def log_density(self, y: Floats) -> Floats:
        """Return the log posterior density, shape (n,)."""
        return self.posterior.log_density(y)

    def log_densities(self, y: Floats) -> Floats:
        """Return the log posterior density, together with the log likelihoods of R recordings, shape (n, 1 + R)."""
        return self.posterior.log_densities(y)

    def proposal(self, optimum: Optimum) -> StudentT:
        """Return a Student-t proposal about the mode with the Laplace covariance."""
        return StudentT.about(optimum.z, optimum.covariance)


class LinearParameterisation:
    """Coordinates linear in the inertial parameters (`Unknowns.to_linear`)."""

    def __init__(self, posterior: Posterior) -> None:
        self.posterior = posterior

    def to_z(self, y: Floats) -> Floats:
        """Return the posterior's coordinates z, which are NaN where no physical body exists."""
        return self.posterior.unknowns.from_linear(y)

    def log_density(self, y: Floats) -> Floats:
        """Return the log posterior density over y, shape (n,), minus infinity where no physical body exists."""
        return self.log_densities(y)[:, 0]

    def log_densities(self, y: Floats) -> Floats:
        """Return `log_density`, together with the log likelihoods of R recordings, shape (n, 1 + R)."""
        z = self.to_z(y)
        physical = np.all(np.isfinite(z), axis=1)
        inside = np.where(np.isfinite(z), z, 0.0)
        values = self.posterior.log_densities(inside)
        values[:, 0] -= self.posterior.unknowns.log_volume(inside)
        values[~physical] = -np.inf
        return values

    def proposal(self, optimum: Optimum) -> StudentT:
        """Return a Student-t proposal about the mode with the Laplace covariance transformed to y."""
        slope = self.posterior.unknowns.linear_slope(optimum.z)
        return StudentT.about(
            self.posterior.unknowns.to_linear(optimum.z[None])[0], slope @ optimum.covariance @ slope.T
        )


@dataclass(frozen=True)
class StudentT:
    """Multivariate Student-t distribution, the proposal of importance sampling and of the independence move.

    SciPy's `multivariate_t` refuses eigenvalues of the scale matrix in a ratio above 4e9, which posteriors can have.

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

        Parameters
        ----------
        mean : (n,) array
            Mode.
        covariance : (n, n) array
            Of the Laplace approximation.
        """
        return cls(mean, np.linalg.cholesky(covariance), max(8.0, 2.0 * len(mean)))

    def draw(self, count: int, rng: np.random.Generator | np.random.RandomState) -> Floats:
        """Draw points from the distribution, shape (count, n).

        Parameters
        ----------
        count : int
            Number of draws.
        rng : numpy.random.Generator
        """
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
