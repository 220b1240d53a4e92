"""Evidence by importance sampling from a Student-t about the mode, trusted only where Pareto k-hat allows.

Geweke 1989, Bayesian inference in econometric models using Monte Carlo integration, Econometrica 57; Vehtari, Simpson,
Gelman, Yao & Gabry 2024, Pareto smoothed importance sampling, Journal of Machine Learning Research 25.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.mode import Optimum
from bayesid.inference.parameterisation import LinearParameterisation, LogCholeskyParameterisation, Parameterisation
from bayesid.inference.posterior import Posterior

__all__ = ["Evidence", "WeightedDraws", "choose_parameterisation", "importance_sample", "weighted_draws"]


TRUSTED = 0.7
"""Pareto k-hat above which importance sampling may not be trusted."""

TRIAL = 512
"""Number of draws by which the coordinates are chosen."""

GOOD = 0.85
"""Share of effective draws above which no other coordinates are tried; a Gaussian posterior gives 0.93."""

ENOUGH = 1000.0
"""Effective draws by which the evidence is estimated, to 0.03 nats or better."""

MOST = 4000
"""Most draws."""

INSIDE = 0.3
"""Smallest share of the draws that are physical bodies, since an ensemble starts from such draws."""


@dataclass(frozen=True)
class Evidence:
    """Log evidence with its Monte Carlo error, and weighted moments of the coordinates.

    Attributes
    ----------
    value, error : float
        Log evidence and its standard error.
    pareto_k : float
        Pareto k-hat of the weights.
    effective_samples : float
        Effective sample size by Kish's formula.
    evaluations : int
        Number of evaluations of the posterior density.
    mean, sd : (n,) arrays
        Posterior mean and standard deviation of the coordinates.
    """

    value: float
    error: float
    pareto_k: float
    effective_samples: float
    evaluations: int
    mean: Floats
    sd: Floats

    @property
    def trusted(self) -> bool:
        """Whether Pareto k-hat is small enough for the estimate to be used."""
        return bool(self.pareto_k < TRUSTED)


def importance_sample(
    parameterisation: Parameterisation, optimum: Optimum, rng: np.random.Generator, draws: int | None = None
) -> Evidence:
    """Estimate the evidence by importance sampling.

    Parameters
    ----------
    parameterisation : Parameterisation
        Posterior, in the coordinates of the proposal.
    optimum : Optimum
        Mode of the posterior and its Laplace approximation.
    rng : numpy.random.Generator
        Source of the draws.
    draws : int, optional
        Number of draws, which is that of the evaluations of the posterior density. By default as many as make 1,000
        effective ones, judged by the first 512, and at most 4,000.
    """
    drawn = _enough(parameterisation, optimum, rng) if draws is None else _drawn(parameterisation, optimum, rng, draws)
    weighted, draws = _weighted(parameterisation, *drawn), len(drawn[0])
    if not np.isfinite(weighted.top):
        return Evidence(-np.inf, np.inf, np.inf, 0.0, draws, optimum.z, np.zeros_like(optimum.z))
    mean = weighted.weights @ weighted.z
    return Evidence(
        value=float(weighted.top + np.log(weighted.raw.mean())),
        error=float(weighted.raw.std() / weighted.raw.mean() / np.sqrt(draws)),
        pareto_k=weighted.pareto_k,
        effective_samples=weighted.effective_samples,
        evaluations=draws,
        mean=mean,
        sd=np.sqrt(weighted.weights @ (weighted.z - mean) ** 2),
    )


class WeightedDraws(NamedTuple):
    """Draws of a Student-t about the mode, weighted by the posterior.

    Attributes
    ----------
    z : (n, size) array
        Draws in the posterior's coordinates.
    weights : (n,) array
        Pareto-smoothed weights, which sum to one.
    pareto_k : float
        Pareto k-hat of the weights.
    raw : (n,) array
        Weights before smoothing, relative to the largest.
    top : float
        Logarithm of the largest weight before smoothing.
    inside : float
        Share of the draws with a finite log density.
    """

    z: Floats
    weights: Floats
    pareto_k: float
    raw: Floats
    top: float
    inside: float

    @property
    def effective_samples(self) -> float:
        """Effective sample size by Kish's formula; 0 where no draw has a finite log density."""
        return float(1.0 / (self.weights**2).sum()) if self.inside > 0.0 else 0.0

    @property
    def trusted(self) -> bool:
        """Whether Pareto k-hat is small enough for the weights to be used."""
        return bool(self.pareto_k < TRUSTED)


def weighted_draws(
    parameterisation: Parameterisation, optimum: Optimum, rng: np.random.Generator, draws: int = 4000
) -> WeightedDraws:
    """Draw from the Student-t about the mode and weight the draws by the posterior.

    Parameters
    ----------
    parameterisation : Parameterisation
    optimum : Optimum
    rng : numpy.random.Generator
    draws : int
        Number of draws.
    """
    return _weighted(parameterisation, *_drawn(parameterisation, optimum, rng, draws))


def _drawn(
    parameterisation: Parameterisation, optimum: Optimum, rng: np.random.Generator, draws: int
) -> tuple[Floats, Floats]:
    """Return draws of the Student-t, (n, size), with the logarithms of their weights."""
    proposal = parameterisation.proposal(optimum)
    y = proposal.draw(draws, rng)
    return y, parameterisation.log_density(y) - proposal.log_density(y)


def _enough(parameterisation: Parameterisation, optimum: Optimum, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Return as many draws as are expected to make enough effective ones, with the logarithms of their weights."""
    first = _drawn(parameterisation, optimum, rng, TRIAL)
    share = max(_weighted(parameterisation, *first).effective_samples / TRIAL, ENOUGH / MOST)
    rest = _drawn(parameterisation, optimum, rng, int(np.ceil(ENOUGH / share)) - TRIAL)
    y, log_weights = (np.concatenate(both) for both in zip(first, rest, strict=True))
    return y, log_weights


def _weighted(parameterisation: Parameterisation, y: Floats, log_weights: Floats) -> WeightedDraws:
    """Return draws with Pareto-smoothed weights."""
    from arviz_stats.base import array_stats  # here, as it takes a second that commands without samples save

    z, draws = np.nan_to_num(parameterisation.to_z(y)), len(y)
    top = float(log_weights.max())
    if not np.isfinite(top):
        return WeightedDraws(z, np.full(draws, 1.0 / draws), np.inf, np.zeros(draws), top, 0.0)
    inside = float(np.isfinite(log_weights).mean())
    log_weights = np.maximum(log_weights, top - 700.0)
    weights, pareto_k = np.exp(log_weights - top), np.inf
    if _has_tail(weights) and np.count_nonzero(log_weights > top - 700.0) > _tail_length(draws):
        smoothed, fitted = array_stats.psislw(-log_weights)  # which takes log likelihoods and inverts them
        if np.isfinite(fitted) and np.isfinite(smoothed).all():
            weights, pareto_k = np.exp(smoothed), fitted
    return WeightedDraws(z, weights / weights.sum(), float(pareto_k), np.exp(log_weights - top), top, inside)


def _tail_length(draws: int) -> int:
    """Return the number of the largest weights to which a generalised Pareto distribution is fitted."""
    return int(min(draws / 5.0, 3.0 * np.sqrt(draws)))


def _has_tail(weights: Floats) -> bool:
    """Whether the largest weights determine such a fit: six or more, whose first quartile is above the smallest.

    ArviZ raises or divides by zero otherwise, as its version has it.
    """
    count = _tail_length(len(weights))
    quartile = int(count / 4.0 + 0.5) - 1
    if quartile < 1:
        return False
    tail = np.sort(weights)[-count:]
    return bool(tail[quartile] > tail[0])


def choose_parameterisation(posterior: Posterior, optimum: Optimum, rng: np.random.Generator) -> Parameterisation:
    """Return the parameterisation in which the Student-t about the mode is the better proposal.

    The linear one is not tried where log-Cholesky coordinates are as good as the proposal can be.

    Parameters
    ----------
    posterior : Posterior
    optimum : Optimum
    rng : numpy.random.Generator
    """

    def merit(parameterisation: Parameterisation) -> tuple[bool, float]:
        drawn = weighted_draws(parameterisation, optimum, rng, TRIAL)
        return drawn.inside > INSIDE, drawn.effective_samples

    first, second = LogCholeskyParameterisation(posterior), LinearParameterisation(posterior)
    reached = merit(first)
    return first if reached >= (True, GOOD * TRIAL) or reached >= merit(second) else second
