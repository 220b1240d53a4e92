"""Array types for signatures (docstrings give the shapes), code for both NumPy and JAX, and sums of logarithms."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Bools", "Floats", "Integers", "Traceable", "log_sum", "log_sums", "namespace"]

Floats: TypeAlias = NDArray[np.floating[Any]]
"""NumPy array of floating-point numbers."""

Bools: TypeAlias = NDArray[np.bool_]
"""NumPy array of truth values."""

Integers: TypeAlias = NDArray[np.integer[Any]]
"""NumPy array of integers."""

Traceable: TypeAlias = Any
"""NumPy array or JAX array, traced or not, as an argument of compiled code."""


def namespace(*arrays: Any) -> Any:
    """Return the module whose functions act on the arrays: ``jax.numpy`` if any is a JAX array, otherwise ``numpy``."""
    modules = [array.__array_namespace__() for array in arrays]
    return next((module for module in modules if module is not np), np)


def log_sum(values: ArrayLike) -> float:
    """Return the logarithm of the sum of the exponentials of all elements, none of which is NaN or plus infinity."""
    logarithms = np.asarray(values, dtype=float)
    largest = float(logarithms.max())
    return largest + float(np.log(np.exp(logarithms - largest).sum())) if np.isfinite(largest) else largest


def log_sums(values: Floats) -> Floats:
    """Return the same of each row of an array, (n, k) with k at least 1, as an array of shape (n,)."""
    largest = values.max(axis=1, keepdims=True)
    largest[np.isneginf(largest)] = 0.0
    terms = values - largest
    np.exp(terms, out=terms)
    with np.errstate(divide="ignore"):
        sums: Floats = np.log(terms.sum(axis=1)) + largest[:, 0]
    return sums
