"""Array types of signatures, shapes stand in the docstrings; and code that serves both NumPy and JAX."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Floats", "Integers", "namespace"]

Floats: TypeAlias = NDArray[np.floating[Any]]
Integers: TypeAlias = NDArray[np.integer[Any]]


def namespace(array: Any) -> Any:
    """Return the module whose functions act on an array: NumPy's or, where it is traced, JAX's."""
    return array.__array_namespace__()
