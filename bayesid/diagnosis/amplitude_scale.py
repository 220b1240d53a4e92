"""Evidence under a prior whose scale is itself unknown.

The scale of an effect's amplitudes is known to a few orders of magnitude only. A Gaussian prior at the largest size
that could occur would charge an effect with many small amplitudes for every one of them; a mixture of Gaussians over
scales charges the common scale once.
"""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp

from bayesid._math.arrays import Floats
from bayesid.simulation.effects.effect import Effect

__all__ = ["SCALES", "effect_mixture", "log_mixture"]

SCALES = 10.0 ** np.linspace(0.0, -3.0, 7)
"""Equally probable scales of a group's amplitudes, relative to the parameters' priors."""


def log_mixture(mean: Floats, covariance: Floats) -> float:
    """Logarithm of the factor by which the mixture raises the evidence, for one group of amplitudes.

    The ratio of the priors is averaged over the Gaussian posterior under the unit prior.

    Parameters
    ----------
    mean : (d,) array
        Posterior mean, in prior standard deviations.
    covariance : (d, d) array
        Its covariance.
    """
    size = len(mean)
    ratios = []
    for scale in SCALES:
        excess = scale**-2 - 1.0
        matrix = np.eye(size) + excess * covariance
        exponent = 0.5 * excess * float(mean @ np.linalg.solve(matrix, mean))
        ratios.append(-size * np.log(scale) - 0.5 * float(np.linalg.slogdet(matrix)[1]) - exponent)
    return float(logsumexp(ratios) - np.log(len(SCALES)))


def effect_mixture(effect: Effect, coordinates: Floats, covariance: Floats) -> float:
    """`log_mixture` of an effect: parameters of one unit that are zero where nothing is there form a group."""
    units = np.resize([p.unit if p.is_amplitude else "" for p in effect.parameters], len(coordinates))
    groups = [np.flatnonzero(units == unit) for unit in sorted(set(units) - {""})]
    return sum(log_mixture(coordinates[group], covariance[np.ix_(group, group)]) for group in groups)
