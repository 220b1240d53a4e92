"""Logarithm of a sum of exponentials, for the many short arrays for which SciPy's checks cost more than the sum."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["log_sum"]


def log_sum(values: ArrayLike) -> float:
    """Return the logarithm of the sum of the exponentials of all elements, none of which is NaN or plus infinity."""
    found = np.asarray(values, dtype=float)
    largest = float(found.max())
    return largest + float(np.log(np.exp(found - largest).sum())) if np.isfinite(largest) else largest
