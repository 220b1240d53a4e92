"""Arrays for JAX that are not compiled."""

from __future__ import annotations

import jax
import numpy as np
from jax import Array

from bayesid._math.arrays import Traceable
from bayesid._math.double_precision import in_double_precision

__all__ = ["on_device"]


@in_double_precision
def on_device(values: Traceable) -> Array:
    """Return a copy of an array for JAX in its own precision, and an array of JAX as it is.

    ``jax.numpy.asarray`` compiles a copy for every shape that a process has not met, which takes some 10 ms.
    """
    return values if isinstance(values, Array) else jax.device_put(np.array(values))
