"""Proposal for a posterior in which some bodies are known hardly better than before: their prior is not approximated.

In coordinates linear in the inertial parameters (`LinearParameterisation`) the likelihood is nearly normal, even where
the prior, which keeps bodies physical, is far from it. The likelihood linearised at the mode is therefore combined with
the exact prior of the widely known bodies; everything else is normal given them and is integrated out. What is left
depends on ten or twenty coordinates and needs no simulation: emcee draws from it in seconds. Its draws, completed by
the normal part, are proposals of which nearly all are accepted (Liu 1994, The collapsed Gibbs sampler in Bayesian
computations, Journal of the American Statistical Association 89).
"""

from __future__ import annotations

from collections.abc import Sequence
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

JUDGED = 8
"""One walker in so many is taken for the autocorrelation: its time is a mean over walkers, and transforms take long."""

LINEAR, SNOOKER = 0.5, 0.1
"""Shares of moves in linear coordinates and of snooker moves, which emcee proposes in a loop, walker by walker."""

THIN = 0.2
"""Distance of the draws that are kept, in autocorrelation times."""


class LinearMove(DEMove):
    """Differential evolution in the linear coordinates of widely known bodies, where a normal likelihood is no curve.

    Parameters
    ----------
    proposal : CollapsedProposal
    """

    def __init__(self, proposal: CollapsedProposal) -> None:
        super().__init__()
        self.proposal = proposal

    def get_proposal(self, s: Floats, c: Sequence[Floats], random: np.random.RandomState) -> tuple[Floats, Floats]:
        """Return a proposal for each walker and the log ratio of the volumes before and after it.

        Parameters
        ----------
        s : (count, b) array
            Walkers to move.
        c : sequence of (., b) arrays
            All others.
        random : numpy.random.RandomState
        """
        linear = self.proposal.linear
        with np.errstate(all="ignore"):  # bodies too heavy for a number
            proposed, _ = super().get_proposal(linear(s), [linear(part) for part in c], random)
        z = self.proposal.from_linear(proposed)
        physical = np.isfinite(z).all(axis=1)
        z[~physical] = s[~physical]
        ratio = self.proposal.log_volume(s) - self.proposal.log_volume(z)
        return z, np.where(physical, ratio, -np.inf)


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
        away = self.linear(wide) - self._centre[self.wide]
        with np.errstate(all="ignore"):  # bodies too heavy for a number
            quadratic = ((away @ self.curvature) * away).sum(axis=1)
            value = -0.5 * (wide**2).sum(axis=1) - away @ self.slope - 0.5 * quadratic
        return np.where(np.isfinite(value), value, -np.inf)

    def linear(self, wide: Floats) -> Floats:
        """Return the linear coordinates of the widely known bodies, shape (count, b) -> (count, b)."""
        return self.unknowns.to_linear(self._with(wide))[:, self.wide]

    def from_linear(self, wide: Floats) -> Floats:
        """Return what `linear` maps to linear coordinates, not finite where no body has them."""
        y = np.repeat(self._centre[None], len(wide), axis=0)
        y[:, self.wide] = wide
        return self.unknowns.from_linear(y)[:, self.wide]

    def log_volume(self, wide: Floats) -> Floats:
        """Return the log determinant of the slope of `linear`, up to a constant, shape (count, b) -> (count,)."""
        return self.unknowns.log_volume(self._with(wide))

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
    moves = [(DEMove(), 1.0 - LINEAR - SNOOKER), (LinearMove(inner), LINEAR), (DESnookerMove(), SNOOKER)]
    sampler = emcee.EnsembleSampler(WALKERS, len(wide), inner.log_marginal, moves=moves, vectorize=True)
    start = _starts(inner, optimum.covariance[np.ix_(wide, wide)], state)
    sampler.random_state = state.get_state()
    while True:
        start = sampler.run_mcmc(start, BLOCK, skip_initial_state_check=True)
        chain = sampler.get_chain()
        tau = autocorrelation_time(chain[:, ::JUDGED])
        left = chain[min(int(np.ceil(BURN_IN * tau)), len(chain) // 2) :]
        worth = left.shape[0] * left.shape[1] / tau
        if len(chain) >= LONGEST or (len(chain) >= 4.0 * BURN_IN * tau and worth >= 2.0 * effective_samples):
            break
    pool = left[:: max(1, int(THIN * tau))].reshape(-1, len(wide))
    return replace(inner, pool=pool, effective_samples=worth)


def _starts(inner: CollapsedProposal, covariance: Floats, state: np.random.RandomState) -> Floats:
    """Return a point for each walker, normal about the mode in z or in linear coordinates, the more probable one."""
    mode, normal = inner.mode[inner.wide], state.normal(size=(WALKERS, len(inner.wide)))
    away = normal @ np.linalg.cholesky(covariance).T
    slope = inner.unknowns.linear_slope(inner.mode)[np.ix_(inner.wide, inner.wide)]
    curved, straight = mode + away, inner.from_linear(inner.linear(mode[None]) + away @ slope.T)
    straight = np.where(np.isfinite(straight).all(axis=1, keepdims=True), straight, curved)
    with np.errstate(invalid="ignore"):  # where neither has a density
        gain = inner.log_marginal(straight) - inner.log_marginal(curved)
    return np.where(gain[:, None] > 0.0, straight, curved)


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
