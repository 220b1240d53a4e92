"""Logarithms of sums of exponentials, where SciPy's checks and copies cost more than the sums."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayesid._math.arrays import Floats

__all__ = ["log_sum", "log_sums"]


def log_sum(values: ArrayLike) -> float:
    """Return the logarithm of the sum of the exponentials of all elements, none of which is NaN or plus infinity."""
    found = np.asarray(values, dtype=float)
    largest = float(found.max())
    return largest + float(np.log(np.exp(found - largest).sum())) if np.isfinite(largest) else largest


def log_sums(values: Floats) -> Floats:
    """Return the same of each row of an array, (n, k) with k at least 1, as an array of shape (n,)."""
    largest = values.max(axis=1, keepdims=True)
    largest[np.isneginf(largest)] = 0.0
    terms = values - largest
    np.exp(terms, out=terms)
    with np.errstate(divide="ignore"):
        found: Floats = np.log(terms.sum(axis=1)) + largest[:, 0]
    return found
