"""Probability that the right one of two rival effects is expected to have after a manoeuvre."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq
from scipy.special import expit

__all__ = ["expected_probability", "noncentrality_for"]

NODES = 61
"""Nodes of the Gauss-Hermite rule, good to 1e-6."""


def expected_probability(noncentrality: float) -> float:
    """Return the mean posterior probability of the true one of two rivals that were equally probable before.

    The log Bayes factor of two rivals of known size is normal with mean ``lambda / 2`` and variance ``lambda``, where
    ``lambda`` is the noncentrality that the true one keeps after the other has taken its share.

    Parameters
    ----------
    noncentrality : float
        ``lambda``, not negative.
    """
    points, weights = np.polynomial.hermite_e.hermegauss(NODES)
    factors = 0.5 * noncentrality + np.sqrt(noncentrality) * points
    return float(weights @ expit(factors) / weights.sum())


def noncentrality_for(probability: float) -> float:
    """Return the noncentrality at which the true one is expected to have a probability between 0.5 and 1."""
    return float(brentq(lambda value: expected_probability(value) - probability, 0.0, 200.0))
