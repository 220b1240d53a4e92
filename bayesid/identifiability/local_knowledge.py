"""Posterior and prior knowledge of the bodies' quantities, linearised at one point.

Let ``J`` be the stacked Jacobian of the whitened residuals and of the prior, which is standard normal in the
coordinates ``z``. The coordinates then have the posterior covariance ``(J'J)^-1``. Quantities with the derivative ``D``
with respect to ``z`` have the posterior covariance ``C = D (J'J)^-1 D'`` and the prior covariance ``C0 = D D'``. The
inverse marginalises all other unknowns (rates, effects, links known to a few percent).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg as sla

from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import linearise
from bayesid.inference.posterior import Posterior

__all__ = ["Knowledge", "marginalised", "triangular"]


@dataclass(frozen=True)
class Knowledge:
    """Knowledge of the bodies' quantities before and after the data.

    Parameters
    ----------
    names : tuple of str
        Names of the n quantities, as in identification.json.
    values : (n,) array
        Values of the quantities at the linearisation point, in SI units.
    slope : (n, N) array
        Derivative of the quantities with respect to the N coordinates, of full row rank.
    jacobian : (m, N) array
        Derivative of the whitened residuals and of the prior's, of full column rank.
    """

    names: tuple[str, ...]
    values: Floats
    slope: Floats
    jacobian: Floats

    @classmethod
    def at(cls, posterior: Posterior, z: Floats) -> Knowledge:
        """Return the knowledge of a posterior linearised at some coordinates.

        Parameters
        ----------
        posterior : Posterior
            Posterior with its noise linearised.
        z : (N,) array
            Coordinates of the linearisation.
        """
        return cls(*linearise(posterior, z), posterior.jacobian(z))

    def having(self, rows: Floats) -> Knowledge:
        """Return the knowledge after further whitened measurements of the coordinates, rows (k, N)."""
        return Knowledge(self.names, self.values, self.slope, np.concatenate([self.jacobian, rows]))

    def fixing(self, coordinates: Sequence[int]) -> Knowledge:
        """Return what would be known if some coordinates were known exactly, those left keeping their order."""
        slope, jacobian = (np.delete(matrix, coordinates, axis=1) for matrix in (self.slope, self.jacobian))
        return Knowledge(self.names, self.values, slope, jacobian)

    @cached_property
    def coordinates(self) -> Floats:
        """Posterior covariance of the coordinates, shape (N, N)."""
        inverse = self._inverse_root
        return inverse @ inverse.T

    @cached_property
    def factor(self) -> Floats:
        """Factor F of the posterior covariance F F' of the quantities, shape (n, N)."""
        return self.slope @ self._inverse_root

    @cached_property
    def prior_factor(self) -> Floats:
        """Lower-triangular factor L of the prior covariance L L' of the quantities, shape (n, n)."""
        upper = triangular(self.slope.T)
        return (upper * np.where(np.diag(upper) < 0.0, -1.0, 1.0)[:, None]).T

    @property
    def covariance(self) -> Floats:
        """Posterior covariance of the quantities, shape (n, n)."""
        return self.factor @ self.factor.T

    @property
    def prior_covariance(self) -> Floats:
        """Prior covariance of the quantities, shape (n, n)."""
        return self.slope @ self.slope.T

    @property
    def sd(self) -> Floats:
        """Marginal posterior standard deviations, shape (n,)."""
        return np.linalg.norm(self.factor, axis=1)

    @property
    def prior_sd(self) -> Floats:
        """Prior standard deviations, shape (n,)."""
        return np.linalg.norm(self.slope, axis=1)

    @property
    def conditional_sd(self) -> Floats:
        """Posterior standard deviations if all other quantities of the bodies were known exactly, shape (n,)."""
        scaled = self.factor / self.sd[:, None]
        inverse = np.linalg.inv(triangular(scaled.T))  # inverse of R, where R'R is the correlation matrix
        return self.sd / np.linalg.norm(inverse, axis=1)

    @property
    def correlation(self) -> Floats:
        """Posterior correlations, shape (n, n)."""
        scaled = self.factor / self.sd[:, None]
        return scaled @ scaled.T

    @property
    def shrinkage(self) -> Floats:
        """One minus the ratio of posterior to prior standard deviation, shape (n,); 0 where nothing was learnt."""
        return 1.0 - self.sd / self.prior_sd

    @cached_property
    def _inverse_root(self) -> Floats:
        """Inverse of R in J = QR, which stays accurate where some directions are known a million times better."""
        upper = triangular(self.jacobian)
        return np.asarray(sla.solve_triangular(upper, np.eye(len(upper))))


def marginalised(jacobian: Floats, nuisance: Sequence[int]) -> Floats:
    """Return the rows that are left for the other coordinates where some are marginalised.

    Parameters
    ----------
    jacobian : (m, N) array
        Jacobian of whitened measurements, with the prior of the nuisance coordinates among its rows.
    nuisance : sequence of int
        The n coordinates to marginalise.

    Returns
    -------
    (N - n, N - n) array
        Upper triangular; its Gram matrix is the Schur complement of the Fisher information.
    """
    others = np.delete(np.arange(jacobian.shape[1]), nuisance)
    return triangular(jacobian[:, [*nuisance, *others]])[len(nuisance) :, len(nuisance) :]


def triangular(matrix: Floats) -> Floats:
    """Return the upper-triangular R of the decomposition matrix = QR."""
    return np.asarray(np.linalg.qr(matrix, mode="r"))
