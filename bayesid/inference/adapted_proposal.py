"""Proposal that is fitted to the posterior round by round, where neither mode nor linearised likelihood gives one.

Recordings that hardly excite the base only exclude bodies, for example light ones: the posterior is the prior with a
part cut off, far from normal. Draws of a Student-t are weighted by the posterior, tempered so that enough of them
count, and the Student-t takes their mean and covariance, until the weights hardly need tempering (O. Cappé, R. Douc,
A. Guillin, J.-M. Marin and C. P. Robert, Adaptive importance sampling in general mixture classes, Statistics and
Computing 18, 2008).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import logsumexp

from bayesid._math.arrays import Floats
from bayesid.inference.ensemble import Proposal
from bayesid.inference.mode import Optimum
from bayesid.inference.parameterisation import Parameterisation, StudentT

__all__ = ["adapted_proposal", "effective_share"]

DRAWS, ROUNDS = 1500, 16
"""Draws in one round, and most rounds."""

PER_UNKNOWN = 20.0
"""Effective draws for each unknown from which mean and covariance are taken."""

ENOUGH, LEAST = 0.1, 0.02
"""Share of effective draws at which the proposal is good enough, and below which it is none."""


def effective_share(
    parameterisation: Parameterisation, proposal: Proposal, rng: np.random.Generator, draws: int = 256
) -> float:
    """Return the share of effective draws of a proposal, by Kish's formula, 0 where none has a finite density.

    Parameters
    ----------
    parameterisation : Parameterisation
        Posterior, in the coordinates of the proposal.
    proposal : Proposal
    rng : numpy.random.Generator
    draws : int
        Number of draws, which is that of the evaluations of the posterior density.
    """
    y = proposal.draw(draws, rng)
    return _effective(_finite(parameterisation.log_density(y) - proposal.log_density(y))) / draws


def adapted_proposal(parameterisation: Parameterisation, optimum: Optimum, rng: np.random.Generator) -> StudentT | None:
    """Return a Student-t that is fitted to the posterior, the best of all rounds, or None where none is of use.

    Parameters
    ----------
    parameterisation : Parameterisation
    optimum : Optimum
        Mode of the posterior and its Laplace approximation, where the first round draws.
    rng : numpy.random.Generator
    """
    proposal = best = parameterisation.proposal(optimum)
    most = 0.0
    goal = min(PER_UNKNOWN * len(optimum.z), 0.3 * DRAWS)
    for _ in range(ROUNDS):
        y = proposal.draw(DRAWS, rng)
        log_weights = _finite(parameterisation.log_density(y) - proposal.log_density(y))
        effective = _effective(log_weights)
        if effective > most:
            best, most = proposal, effective
        if most >= ENOUGH * DRAWS:
            break
        tempered = log_weights if effective >= goal else _tempered(log_weights, goal)
        weights = np.exp(tempered - logsumexp(tempered))
        mean = weights @ y
        spread = (y - mean) * np.sqrt(weights)[:, None]
        upper = np.asarray(np.linalg.qr(spread, mode="r"))
        proposal = replace(proposal, mean=mean, factor=upper.T * np.sign(np.diag(upper)))
    return best if most >= LEAST * DRAWS else None


def _finite(log_weights: Floats) -> Floats:
    """Return the logarithms of weights, minus infinity where they are not a number."""
    return np.where(np.isfinite(log_weights), log_weights, -np.inf)


def _effective(log_weights: Floats) -> float:
    """Return Kish's effective number of draws."""
    if not np.isfinite(log_weights).any():
        return 0.0
    return float(np.exp(2.0 * logsumexp(log_weights) - logsumexp(2.0 * log_weights)))


def _tempered(log_weights: Floats, goal: float) -> Floats:
    """Return the logarithms of weights to the power at which they make a number of effective draws."""
    inside = np.where(np.isfinite(log_weights), log_weights, -1e12)
    if _effective(1e-9 * inside) <= goal:  # too few draws lie inside
        return 1e-9 * inside
    return np.asarray(inside * brentq(lambda power: _effective(power * inside) - goal, 1e-9, 1.0))
