"""Proposal for a posterior in which some bodies are known hardly better than before: their prior is not approximated.

In coordinates linear in the inertial parameters (`LinearParameterisation`) the likelihood is nearly normal, even where
the prior, which keeps bodies physical, is far from it. The likelihood linearised at the mode is therefore combined with
the exact prior of the widely known bodies; everything else is normal given them and is integrated out. What is left
depends on ten or twenty coordinates and needs no simulation: emcee draws from it in seconds. Its draws, completed by
the normal part, are proposals of which nearly all are accepted (Liu 1994, The collapsed Gibbs sampler in Bayesian
computations, Journal of the American Statistical Association 89).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import emcee
import numpy as np
from emcee.moves import DEMove, DESnookerMove
from scipy.linalg import solve_triangular

from bayesid._math.arrays import Floats, Integers
from bayesid.inference.ensemble import autocorrelation_time
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior
from bayesid.inference.unknowns import MAPPED, Unknowns

__all__ = ["CollapsedProposal", "collapsed_proposal", "wide_coordinates"]

WIDE = 0.1
"""Standard deviation, in that of the prior, from which a coordinate makes its body a widely known one."""

LARGEST = 30
"""Largest number of coordinates of such bodies: differential evolution mixes slowly in many dimensions."""

WALKERS = 2 * MAPPED
"""Number of walkers: each half of them is mapped in one call."""

BLOCK, LONGEST = 250, 6000
"""Steps between two looks at the autocorrelation, and largest number of steps."""

BURN_IN = 5.0
"""Steps that are left out at first, in autocorrelation times."""

THIN = 0.2
"""Distance of the draws that are kept, in autocorrelation times."""


@dataclass(frozen=True)
class CollapsedProposal:
    """Posterior of a linearised likelihood: widely known bodies with their exact prior, all else normal given them.

    Attributes
    ----------
    unknowns : Unknowns
    mode : (n,) array
        Coordinates z at which the likelihood is linearised.
    wide : (b,) array of int
        Indices of the coordinates of the widely known bodies; the same in z and in the linear coordinates y.
    slope, curvature : (b,), (b, b) arrays
        Gradient and Hessian of minus the log likelihood by y of these bodies at the mode, all else integrated out.
    shift, regression : (a,), (a, b) arrays
        Mean of all other coordinates y, relative to the mode, and its derivative by y of these bodies.
    factor : (a, a) array
        Lower Cholesky factor of the precision of all other coordinates given these bodies.
    pool : (N, b) array
        Draws of the coordinates z of these bodies.
    effective_samples : float
        Number of independent draws that the pool is worth.
    """

    unknowns: Unknowns
    mode: Floats
    wide: Integers
    slope: Floats
    curvature: Floats
    shift: Floats
    regression: Floats
    factor: Floats
    pool: Floats
    effective_samples: float

    @cached_property
    def other(self) -> Integers:
        """Indices of all other coordinates."""
        return np.setdiff1d(np.arange(len(self.mode)), self.wide)

    def draw(self, count: int, rng: np.random.Generator | np.random.RandomState) -> Floats:
        """Draw points y from the distribution, shape (count, n).

        Parameters
        ----------
        count : int
            Number of draws.
        rng : numpy.random.Generator
        """
        z = self._with(self.pool[(rng.uniform(size=count) * len(self.pool)).astype(int)])
        y = self.unknowns.to_linear(z)
        away = y[:, self.wide] - self._centre[self.wide]
        normal = solve_triangular(self.factor, rng.normal(size=(len(self.shift), count)), trans="T", lower=True).T
        y[:, self.other] = self._centre[self.other] + self.shift + away @ self.regression.T + normal
        return y

    def log_density(self, y: Floats) -> Floats:
        """Return the log density at points, up to a constant, shape (count, n) -> (count,)."""
        z = self._with(self.unknowns.from_linear(y)[:, self.wide])
        away = y - self._centre
        rest = (away[:, self.other] - self.shift - away[:, self.wide] @ self.regression.T) @ self.factor
        value = self.log_marginal(z[:, self.wide]) - 0.5 * (rest**2).sum(axis=1) - self.unknowns.log_volume(z)
        return np.where(np.isfinite(value), value, -np.inf)

    def log_marginal(self, wide: Floats) -> Floats:
        """Return the log density over z of the widely known bodies, up to a constant, shape (count, b) -> (count,)."""
        away = self.unknowns.to_linear(self._with(wide))[:, self.wide] - self._centre[self.wide]
        with np.errstate(all="ignore"):  # bodies too heavy for a number
            quadratic = ((away @ self.curvature) * away).sum(axis=1)
            value = -0.5 * (wide**2).sum(axis=1) - away @ self.slope - 0.5 * quadratic
        return np.where(np.isfinite(value), value, -np.inf)

    @cached_property
    def _centre(self) -> Floats:
        """Coordinates y of the mode."""
        return self.unknowns.to_linear(self.mode[None])[0]

    def _with(self, wide: Floats) -> Floats:
        """Return the mode's coordinates z with those of the widely known bodies replaced, shape (count, n)."""
        z = np.repeat(self.mode[None], len(wide), axis=0)
        z[:, self.wide] = wide
        return z


def wide_coordinates(unknowns: Unknowns, optimum: Optimum) -> Integers:
    """Return the indices of the coordinates of all bodies, effects on links included, that are known widely.

    Parameters
    ----------
    unknowns : Unknowns
    optimum : Optimum
    """
    layout = unknowns.layout
    # bodies that the prior correlates have linear coordinates all together
    bodies = [layout.body(index) for index in range(layout.bodies)] if unknowns.mixing is None else [layout.all_bodies]
    sd = np.sqrt(np.diag(optimum.covariance))
    parts = [part for part in (*bodies, *(part for _, part in layout.changed_bodies)) if (sd[part] > WIDE).any()]
    return np.concatenate([np.arange(part.start, part.stop) for part in parts] or [np.zeros(0, dtype=int)])


def collapsed_proposal(
    posterior: Posterior, optimum: Optimum, rng: np.random.Generator, effective_samples: float = 4000.0
) -> CollapsedProposal | None:
    """Return the proposal about a mode, or None where no body is known widely, or too many are.

    Parameters
    ----------
    posterior : Posterior
        Posterior with its noise linearised at the mode.
    optimum : Optimum
        Mode of the posterior and its Laplace approximation.
    rng : numpy.random.Generator
        Source of all random numbers.
    effective_samples : float
        Number of independent draws of the widely known bodies to make; twice as many are made.
    """
    unknowns = posterior.unknowns
    wide = wide_coordinates(unknowns, optimum)
    if posterior.flat_prior or not 0 < len(wide) <= LARGEST:
        return None
    inner = _linearised(posterior, optimum, wide)
    state = np.random.RandomState(rng.integers(2**32, size=8, dtype=np.uint32))
    moves = [(DEMove(), 0.75), (DESnookerMove(), 0.25)]
    sampler = emcee.EnsembleSampler(WALKERS, len(wide), inner.log_marginal, moves=moves, vectorize=True)
    factor = np.linalg.cholesky(optimum.covariance[np.ix_(wide, wide)])
    start = optimum.z[wide] + state.normal(size=(WALKERS, len(wide))) @ factor.T
    sampler.random_state = state.get_state()
    while True:
        start = sampler.run_mcmc(start, BLOCK, skip_initial_state_check=True)
        chain = sampler.get_chain()
        tau = autocorrelation_time(chain)
        left = chain[min(int(np.ceil(BURN_IN * tau)), len(chain) // 2) :]
        worth = left.shape[0] * left.shape[1] / tau
        if len(chain) >= LONGEST or (len(chain) >= 4.0 * BURN_IN * tau and worth >= 2.0 * effective_samples):
            break
    pool = left[:: max(1, int(THIN * tau))].reshape(-1, len(wide))
    return replace(inner, pool=pool, effective_samples=worth)


def _linearised(posterior: Posterior, optimum: Optimum, wide: Integers) -> CollapsedProposal:
    """Return the proposal without its draws."""
    unknowns, z = posterior.unknowns, optimum.z
    residual = posterior.residuals(z).ravel()
    inverse = np.linalg.inv(unknowns.linear_slope(z))
    slopes = posterior.jacobian(z)[: len(residual)] @ inverse
    other = np.setdiff1d(np.arange(len(z)), wide)
    gradient, hessian = slopes.T @ residual, slopes.T @ slopes
    slope = inverse[np.ix_(other, other)]  # z of the other coordinates by their y
    mixed = hessian[np.ix_(other, wide)]
    factor = np.linalg.cholesky(hessian[np.ix_(other, other)] + slope.T @ slope)
    pull = solve_triangular(factor, gradient[other] + slope.T @ z[other], lower=True)
    drag = solve_triangular(factor, mixed, lower=True)
    return CollapsedProposal(
        unknowns,
        z,
        wide,
        slope=gradient[wide] - drag.T @ pull,
        curvature=hessian[np.ix_(wide, wide)] - drag.T @ drag,
        shift=-solve_triangular(factor, pull, trans="T", lower=True),
        regression=-solve_triangular(factor, drag, trans="T", lower=True),
        factor=factor,
        pool=np.zeros((0, len(wide))),
        effective_samples=0.0,
    )
