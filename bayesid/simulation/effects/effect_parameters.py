"""Parameters of an effect: their units and the priors on a physical scale that they have."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import erf
from scipy.special import erfinv

from bayesid._math.arrays import Floats

__all__ = ["Parameter", "Prior", "Quantity", "coordinates_of"]


class Prior(Enum):
    """Shape of a parameter's prior, and what its mean and sigma then are."""

    NORMAL = "normal"
    LOG_NORMAL = "log-normal"  # mean is the median, sigma the standard deviation of the logarithm
    UNIFORM = "uniform"  # within sigma of the mean

    def physical(self, mean: Array | float, sigma: Array | float, z: Array) -> Array:
        """Return the physical value of a coordinate with a standard-normal prior."""
        if self is Prior.LOG_NORMAL:
            return mean * jnp.exp(sigma * z)
        if self is Prior.UNIFORM:
            return mean + sigma * erf(z / jnp.sqrt(2.0))
        return mean + sigma * z


class Quantity(NamedTuple):
    """A name and a unit."""

    name: str
    unit: str


class Parameter(NamedTuple):
    """One parameter of an effect, with its prior.

    ``sigma`` is the prior's standard deviation and ``mean`` its centre; see `Prior` for other shapes.
    """

    name: str
    unit: str
    sigma: float
    mean: float = 0.0
    prior: Prior = Prior.NORMAL

    @property
    def is_amplitude(self) -> bool:
        """Whether zero means that nothing is there."""
        return self.prior is Prior.NORMAL and self.mean == 0.0

    def value(self, z: Array) -> Array:
        """Physical value of a coordinate with a standard-normal prior."""
        return self.prior.physical(self.mean, self.sigma, z)


WELL_INSIDE = 0.8
"""Share of a bounded range that a starting value may lie from its middle."""


def coordinates_of(parameters: Sequence[Parameter], values: Sequence[float]) -> Floats:
    """Coordinates with a standard-normal prior of physical values; what lies outside a range is moved into it."""
    coordinates = []
    for parameter, value in zip(parameters, values, strict=True):
        if parameter.prior is Prior.LOG_NORMAL:
            coordinates.append(np.log(value / parameter.mean) / parameter.sigma)
        elif parameter.prior is Prior.UNIFORM:
            inside = np.clip((value - parameter.mean) / parameter.sigma, -WELL_INSIDE, WELL_INSIDE)
            coordinates.append(float(np.sqrt(2.0) * erfinv(inside)))
        else:
            coordinates.append((value - parameter.mean) / parameter.sigma)
    return np.array(coordinates)
