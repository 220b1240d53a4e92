"""Expected probability that a manoeuvre leads to a decision between rivals, simulated in Gram space.

With the information ``A`` about the amplitudes of all rivals that other unknowns leave, readings speak on them through
the score alone. Where one rival acts with amplitudes ``a`` the score is ``A a + L e`` with ``A = L L'`` and a standard
normal ``e``, and the evidence of each rival follows from its part of the score in closed form, averaged over scales
(D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992). A decision gives the true rival, equally probable
beforehand, a probability of 0.9 or more. Amplitudes and ``e`` are drawn once for all manoeuvres, so that the
probability is a function of ``A``, which has a gradient once the jump at a decision is blurred by half a nat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.linalg import solve_triangular
from jax.scipy.special import logsumexp, ndtr
from numpy.typing import NDArray
from scipy.special import ndtri
from scipy.stats import qmc

from bayesid._math.arrays import Floats
from bayesid._math.double_precision import in_double_precision
from bayesid.design.rival_prior import RivalPrior, ScaleGrid

__all__ = [
    "DECISION",
    "DecisionRate",
    "RivalDraws",
    "decided_margins",
    "decision_margins",
    "log_evidence",
    "smooth_rates",
]

DECISION = 0.9
"""Probability of the true rival at which the rivals count as distinguished."""

WIDTH = 0.5
"""Standard deviation of the normal distribution by which a search blurs the jump at a decision [nats]."""

ROUNDED = 1e-9  # share of each amplitude's information that is added, so that a rounded matrix stays definite
BLOCK = 2000  # draws that are evaluated at once
UNSEEN = 1e-4  # information about an amplitude of the largest size that is added, where no reading reacts to it


class DecisionRate(NamedTuple):
    """Share of simulated readings that lead to a decision for the true rival."""

    rate: float  #: the share
    standard_error: float  #: its standard error
    draws: int  #: number of independent draws of size, direction and noise

    @classmethod
    def of(cls, decided: NDArray[np.bool_]) -> DecisionRate:
        """Return the share of decisions in independent draws, shape (d,)."""
        rate = float(np.mean(decided))
        return cls(rate, float(np.sqrt(rate * (1.0 - rate) / len(decided))), len(decided))


@dataclass(frozen=True)
class RivalDraws:
    """Draws that are the same for all manoeuvres.

    Attributes
    ----------
    amplitudes : sequence of (d, k) arrays
        Amplitudes of each rival where it acts, in units of their largest plausible sizes.
    noise : (d, K) array
        Standard normal numbers for the score of all K amplitudes.
    """

    amplitudes: Sequence[Floats]
    noise: Floats

    @classmethod
    def even(cls, priors: Sequence[RivalPrior], count: int, rng: np.random.Generator) -> RivalDraws:
        """Return evenly spread draws, scrambled Sobol points, whose mean varies less than that of independent ones."""
        return cls._of(priors, lambda columns: qmc.Sobol(columns, rng=rng).random(count))

    @classmethod
    def independent(cls, priors: Sequence[RivalPrior], count: int, rng: np.random.Generator) -> RivalDraws:
        """Return independent draws."""
        return cls._of(priors, lambda columns: rng.uniform(size=(count, columns)))

    @classmethod
    def _of(cls, priors: Sequence[RivalPrior], uniform: Any) -> RivalDraws:
        amplitudes, total = [], sum(len(prior.scale_of) for prior in priors)
        tiny = np.finfo(float).tiny
        widest = max(prior.dimensions for prior in priors)
        points = np.clip(uniform(widest + total), tiny, 1.0 - 1e-16)
        amplitudes = [prior.amplitudes(points[:, : prior.dimensions]) for prior in priors]
        return cls(amplitudes, ndtri(points[:, widest:]))


def log_evidence(information: Array, scores: Array, grid: ScaleGrid) -> Array:
    """Return the log evidence of a rival relative to none, averaged over its scales, shape (d,).

    Parameters
    ----------
    information : (k, k) array
        Information about the amplitudes.
    scores : (d, k) array
    grid : ScaleGrid
    """
    deviations = jnp.asarray(grid.deviations)
    scaled = deviations[:, :, None] * information * deviations[:, None, :]
    lower = jnp.linalg.cholesky(scaled + jnp.eye(len(information)))
    half_log_det = jnp.log(jnp.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
    root = solve_triangular(lower, jnp.eye(len(information)) * deviations[:, None, :], lower=True)
    covariance = jnp.swapaxes(root, 1, 2) @ root
    row, column = np.triu_indices(len(information))
    weights = covariance[:, row, column] * np.where(row == column, 0.5, 1.0)
    products = scores[:, row] * scores[:, column]
    return logsumexp(products @ weights.T + grid.log_weights - half_log_det, axis=1)


def decision_margins(information: Array | Floats, priors: Sequence[RivalPrior], draws: RivalDraws) -> Array:
    """Return the log odds of the true rival in excess of those of a decision, shape (rivals, d).

    Parameters
    ----------
    information : (K, K) array
        Information about the amplitudes of all rivals, one after another, in units of their largest plausible sizes.
    priors : sequence of RivalPrior
        Prior of each rival.
    draws : RivalDraws
    """
    matrix, root = _definite(jnp.asarray(information))
    ends = np.cumsum([len(prior.scale_of) for prior in priors])
    groups = [slice(end - len(prior.scale_of), end) for end, prior in zip(ends, priors, strict=True)]
    noise = jnp.asarray(draws.noise) @ root.T
    needed = float(np.log(DECISION / (1.0 - DECISION)))
    margins = []
    for index, (group, amplitudes) in enumerate(zip(groups, draws.amplitudes, strict=True)):
        scores = jnp.asarray(amplitudes) @ matrix[group] + noise
        evidences = [
            log_evidence(matrix[other, other], scores[:, other], prior.grid)
            for other, prior in zip(groups, priors, strict=True)
        ]
        others = jnp.stack([value for place, value in enumerate(evidences) if place != index])
        margins.append(evidences[index] - logsumexp(others, axis=0) - needed)
    return jnp.stack(margins)


@in_double_precision
def decided_margins(information: Floats, priors: Sequence[RivalPrior], draws: RivalDraws) -> Floats:
    """Return `decision_margins` as numbers, block after block of the draws."""
    blocks = [
        RivalDraws([part[start : start + BLOCK] for part in draws.amplitudes], draws.noise[start : start + BLOCK])
        for start in range(0, len(draws.noise), BLOCK)
    ]
    return np.concatenate([np.asarray(decision_margins(information, priors, block)) for block in blocks], axis=1)


def smooth_rates(margins: Array) -> Array:
    """Return the shares of decisions, (rivals,), the jump at a margin of zero blurred by `WIDTH`."""
    return ndtr(margins / WIDTH).mean(axis=1)


def _definite(information: Array) -> tuple[Array, Array]:
    """Return the information about amplitudes, definite in spite of rounding, and its Cholesky factor."""
    scale = jnp.sqrt(jnp.maximum(jnp.diag(information), 0.0) + UNSEEN)
    even = information / jnp.outer(scale, scale)
    least = jax.lax.stop_gradient(jnp.linalg.eigvalsh(even)[0])
    even = even + (ROUNDED + jnp.maximum(-least, 0.0)) * jnp.eye(len(scale))
    return even * jnp.outer(scale, scale), scale[:, None] * jnp.linalg.cholesky(even)
