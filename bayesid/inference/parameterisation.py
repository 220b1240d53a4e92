"""Coordinates to propose in: log-Cholesky, or linear in the inertial parameters.

Both describe the same posterior. Where one unknown body is determined well, log-Cholesky coordinates are nearly normal.
Where several are known to a few percent and the data tie their combinations together far more sharply, the ridge is
straight only in coordinates linear in the parameters.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior
from bayesid.inference.proposal import StudentT

__all__ = ["LinearParameterisation", "LogCholeskyParameterisation", "Parameterisation"]


class Parameterisation(Protocol):
    """A change of coordinates of a posterior, for many points at once, shape (n, size)."""

    posterior: Posterior

    def to_z(self, y: Floats) -> Floats:
        """Return the posterior's coordinates; not a number outside the support."""
        ...

    def log_density(self, y: Floats) -> Floats:
        """Log posterior density over y, shape (n,)."""
        ...

    def proposal(self, optimum: Optimum) -> StudentT:
        """Return a Student-t over y about the mode."""
        ...


class LogCholeskyParameterisation:
    """The posterior's own coordinates."""

    def __init__(self, posterior: Posterior) -> None:
        self.posterior = posterior

    def to_z(self, y: Floats) -> Floats:
        """Return the points themselves."""
        return y

    def log_density(self, y: Floats) -> Floats:
        """Log posterior density, shape (n,)."""
        return self.posterior.log_density(y)

    def proposal(self, optimum: Optimum) -> StudentT:
        """Return a Student-t about the mode with the Laplace covariance."""
        return StudentT.about(optimum.z, optimum.covariance)


class LinearParameterisation:
    """Coordinates linear in the inertial parameters (`Unknowns.to_linear`)."""

    def __init__(self, posterior: Posterior) -> None:
        self.posterior = posterior

    def to_z(self, y: Floats) -> Floats:
        """Return the posterior's coordinates; not a number where no physical body exists."""
        return self.posterior.unknowns.from_linear(y)

    def log_density(self, y: Floats) -> Floats:
        """Log posterior density over y, shape (n,); minus infinity where no physical body exists."""
        z = self.to_z(y)
        physical = np.all(np.isfinite(z), axis=1)
        inside = np.where(np.isfinite(z), z, 0.0)
        value = self.posterior.log_density(inside) - self.posterior.unknowns.log_volume(inside)
        return np.where(physical, value, -np.inf)

    def proposal(self, optimum: Optimum) -> StudentT:
        """Return a Student-t about the mode with the Laplace covariance carried over."""
        slope = self.posterior.unknowns.linear_slope(optimum.z)
        return StudentT.about(
            self.posterior.unknowns.to_linear(optimum.z[None])[0], slope @ optimum.covariance @ slope.T
        )
