"""Array types for signatures (docstrings give the shapes), and support of code for both NumPy and JAX."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Floats", "Integers", "Traceable", "namespace"]

Floats: TypeAlias = NDArray[np.floating[Any]]
"""NumPy array of floating-point numbers."""

Integers: TypeAlias = NDArray[np.integer[Any]]
"""NumPy array of integers."""

Traceable: TypeAlias = Any
"""NumPy array or JAX array, traced or not, as an argument of compiled code."""


def namespace(*arrays: Any) -> Any:
    """Return the module whose functions act on the arrays: ``jax.numpy`` if any is a JAX array, otherwise ``numpy``."""
    modules = [array.__array_namespace__() for array in arrays]
    return next((module for module in modules if module is not np), np)
