"""Mode of the posterior by least squares with the exact Jacobian, and the Laplace approximation about it.

Tierney & Kadane 1986, Accurate approximations for posterior moments and marginal densities, Journal of the American
Statistical Association 81.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.least_squares import levenberg_marquardt
from bayesid.inference.balanced_start import balanced_start
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior

__all__ = ["Optimum", "fit", "maximise"]


TOLERANCE = 1e-10
"""Relative tolerance of the least-squares solver, far below any standard deviation of the posterior."""

STARTS = 8
"""Number of random starting points that are tried if neither the first optimum nor that from the balance of momentum
explains the data."""

MOST_EVALUATIONS, MOST_OF_A_START, MOST_AGAIN = 800, 50, 200
"""Largest number of evaluations of the residuals: in a fit, from one of those starting points, and from a mode found.

Fits of data that the model can follow take 10 to 70, and 400 from the oddest starting points.
"""

SUSPICIOUS = 4.0
"""Chi-square per sample above which an optimum may be a local one."""


@dataclass(frozen=True)
class Optimum:
    """Mode of the posterior and the normal approximation about it.

    Attributes
    ----------
    z : (n,) array
        Standard-normal coordinates of the mode.
    covariance : (n, n) array
        Covariance of the Laplace approximation, the inverse of the Gauss-Newton Hessian.
    chi2 : float
        Chi-square of the data, without the prior.
    cost : float
        Negative log posterior density, up to a constant.
    evaluations : int
        Number of evaluations of residuals and Jacobians.
    converged : bool
        Whether the solver met its tolerance.
    """

    z: Floats
    covariance: Floats
    chi2: float
    cost: float
    evaluations: int
    converged: bool

    def log_evidence(self, posterior: Posterior) -> float:
        """Return the Laplace approximation of the log evidence."""
        n = posterior.size
        half_logdet = float(np.log(np.diag(np.linalg.cholesky(self.covariance))).sum())
        return float(posterior.log_density(self.z[None])[0]) + 0.5 * n * np.log(2.0 * np.pi) + half_logdet


def fit(posterior: Posterior, start: Floats, at_most: int = MOST_EVALUATIONS) -> Optimum:
    """Return the optimum that Levenberg-Marquardt reaches.

    Parameters
    ----------
    posterior : Posterior
    start : (n,) array
        Starting point.
    at_most : int
        Largest number of evaluations of the residuals.
    """
    solution = levenberg_marquardt(posterior.least_squares, posterior.jacobian, start, TOLERANCE, at_most)
    jacobian = posterior.jacobian(solution.x)
    return Optimum(
        z=solution.x,
        covariance=_inverse(jacobian.T @ jacobian),
        chi2=float((posterior.residuals(solution.x) ** 2).sum()),
        cost=float(solution.cost),
        evaluations=int(solution.nfev + (solution.njev or 0)),
        converged=solution.status in (1, 2, 3, 4),
    )


def maximise(posterior: Posterior, rng: np.random.Generator, start: Floats | None = None) -> tuple[Posterior, Optimum]:
    """Find the mode, linearise the encoders' noise there, and find the mode again.

    Parameters
    ----------
    posterior : Posterior
    rng : numpy.random.Generator
        Source of further starting points if the first optima explain the data badly.
    start : (n,) array, optional
        Starting point, by default the prior's centre with the measured initial rates.

    Returns
    -------
    Posterior, Optimum
        The posterior with its noise linearised at the mode, and the mode.
    """
    first = posterior.starting_point() if start is None else start
    best = fit(posterior, first)
    evaluations = best.evaluations
    if best.chi2 > SUSPICIOUS * posterior.samples and (balanced := balanced_start(posterior)) is not None:
        other = fit(posterior, balanced)
        evaluations += other.evaluations
        best = min(best, other, key=lambda optimum: optimum.cost)
    if best.chi2 > SUSPICIOUS * posterior.samples:
        for _ in range(STARTS):
            away = 0.5 * rng.normal(size=first.size)
            away[posterior.unknowns.layout.all_bodies.stop :] = 0.0
            other = fit(posterior, first + away, MOST_OF_A_START)
            evaluations += other.evaluations
            if other.cost < best.cost:
                best = other
    refined = relinearised(posterior, best.z)
    optimum = fit(refined, best.z, MOST_AGAIN)
    return refined, replace(optimum, evaluations=evaluations + optimum.evaluations)


def _inverse(hessian: Floats) -> Floats:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    scaled = hessian * np.outer(scale, scale)
    inverse = np.linalg.pinv(scaled, hermitian=True)
    return inverse * np.outer(scale, scale)
