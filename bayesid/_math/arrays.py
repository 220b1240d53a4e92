"""Array types of signatures, shapes stand in the docstrings; and code that serves both NumPy and JAX."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Floats", "Integers", "Traceable", "namespace"]

Floats: TypeAlias = NDArray[np.floating[Any]]
Integers: TypeAlias = NDArray[np.integer[Any]]
Traceable: TypeAlias = Any
"""An array of NumPy, or one of JAX, which may be traced: a leaf of what compiled code takes."""


def namespace(*arrays: Any) -> Any:
    """Return the module whose functions act on arrays: NumPy's or, where any of them is JAX's or traced, JAX's."""
    modules = [array.__array_namespace__() for array in arrays]
    return next((module for module in modules if module is not np), np)
