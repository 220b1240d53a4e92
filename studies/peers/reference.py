"""The reference of a density: long chains, and the log evidence by bridge sampling between them and a Student-t.

Bridge sampling (Meng and Wong 1996, with the optimal bridge) needs no proposal that covers the posterior, unlike
importance sampling, and is therefore independent evidence of it. The Student-t is fitted to one half of the ensembles
and bridged to the other half, and the other way round.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.special import logsumexp

from bayesid._math.arrays import Floats
from bayesid.inference import importance_sample, sample
from bayesid.inference.proposal import StudentT
from studies.peers.density import Target
from studies.peers.samplers import Budget, Reached, effective_samples

__all__ = ["bridge", "reference"]

ITERATIONS = 100
"""Number of iterations of the bridge, many more than it needs."""


def reference(target: Target, budget: Budget, rng: np.random.Generator) -> Reached:
    """Return the reference, with as many effective samples as the budget wants; its time is no part of a comparison."""
    began = time.process_time()
    trusted = importance_sample(target.parameterisation, target.optimum, rng).trusted
    chains = sample(
        target.parameterisation,
        target.optimum,
        int(rng.integers(2**31)),
        effective_samples=budget.effective_samples,
        trusted=trusted,
    )
    y = chains.y.reshape(len(chains.y), -1, chains.walkers, target.size)
    halves = np.array_split(np.arange(len(y)), 2)
    values, evaluations = [], chains.evaluations
    for fitted, bridged in (halves, halves[::-1]):
        known = y[fitted].reshape(-1, target.size)
        proposal = StudentT.about(known.mean(axis=0), np.cov(known.T))
        draws = proposal.draw(int(budget.effective_samples), rng)
        evaluations += len(draws)
        proposed = target.parameterisation.log_density(draws) - proposal.log_density(draws)
        own = y[bridged].reshape(-1, target.size)
        sampled = chains.log_density[bridged].ravel() - proposal.log_density(own)
        values.append(bridge(sampled, proposed, effective_samples(np.concatenate(y[bridged], axis=1))))
    (first, error), (second, other) = values
    x = target.whitened(y.reshape(-1, target.size))
    return Reached(
        seconds=time.process_time() - began,
        evaluations=evaluations,
        gradients=0,
        effective_samples=effective_samples(np.concatenate(y, axis=1)),
        finished=chains.converged,
        log_evidence=0.5 * (first + second),
        log_evidence_error=float(max(0.5 * np.hypot(error, other), 0.5 * abs(first - second))),
        mean=x.mean(axis=0).tolist(),
    )


def bridge(sampled: Floats, proposed: Floats, effective: float) -> tuple[float, float]:
    """Return the log evidence by bridge sampling, and its standard error.

    Parameters
    ----------
    sampled : (n,) array
        Log density over that of the proposal at draws of the posterior.
    proposed : (m,) array
        The same at draws of the proposal.
    effective : float
        Number of effective samples among the draws of the posterior.
    """
    shift = float(np.median(sampled))
    sampled, proposed = sampled - shift, proposed - shift
    n, m, value = effective, len(proposed), 0.0
    for _ in range(ITERATIONS):
        above = proposed - np.logaddexp(np.log(n) + proposed, np.log(m) + value)
        below = -np.logaddexp(np.log(n) + sampled, np.log(m) + value)
        value = float(logsumexp(above) - np.log(m) - logsumexp(below) + np.log(len(sampled)))
    spread = [np.exp(part - logsumexp(part) + np.log(len(part))).var() for part in (above, below)]
    return value + shift, float(np.sqrt(spread[0] / m + spread[1] / n))
