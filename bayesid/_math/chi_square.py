"""Tail of the chi-square distribution, far beyond where its probability underflows."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammaln
from scipy.stats import chi2

from bayesid._math.arrays import Floats

__all__ = ["log_tail"]


def log_tail(statistic: ArrayLike, degrees: ArrayLike) -> Floats:
    """Return the logarithm of the probability that a chi-square is larger; far out by a continued fraction.

    Parameters
    ----------
    statistic, degrees : array_like
        Of shapes that are broadcast together.

    Returns
    -------
    array
    """
    x, a = np.broadcast_arrays(0.5 * np.asarray(statistic, dtype=float), 0.5 * np.asarray(degrees, dtype=float))
    value = chi2.logsf(2.0 * x, 2.0 * a)
    far = np.isneginf(value) & (x > a)
    a, x = np.where(far, a, 1.0), np.where(far, x, 1.0)  # of the continued fraction the first term
    return np.asarray(np.where(far, a * np.log(x) - x - np.log(x - a + 1.0) - gammaln(a), value))
