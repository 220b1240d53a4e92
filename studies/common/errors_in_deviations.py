"""Errors of estimates, measured in the standard deviations that were stated for them."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats

__all__ = ["squared_distances"]


def squared_distances(errors: Floats, covariance: Floats) -> Floats:
    """Return squared Mahalanobis distances, shape (...,), of errors, shape (..., n).

    Errors are divided by their standard deviations first, so that units of very different size cost no accuracy.
    """
    scale = np.sqrt(np.diag(covariance))
    scaled = errors / scale
    solved = np.linalg.solve(covariance / np.outer(scale, scale), scaled[..., None])[..., 0]
    return np.asarray((scaled * solved).sum(axis=-1))
