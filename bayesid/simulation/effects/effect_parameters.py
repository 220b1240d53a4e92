"""Parameters of an effect, with units and priors on a physical scale."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

import numpy as np
from jax.scipy.special import erf
from scipy import special

from bayesid._math.arrays import Floats, Traceable, namespace

__all__ = ["Parameter", "Prior", "Quantity", "coordinates_of"]

SQRT2 = float(np.sqrt(2.0))


class Prior(Enum):
    """Shape of a parameter's prior, which decides the meaning of its mean and sigma.

    The mean of a log-normal prior is its median and sigma the standard deviation of the logarithm; a uniform prior
    extends by sigma to both sides of the mean.
    """

    NORMAL = "normal"
    LOG_NORMAL = "log-normal"
    UNIFORM = "uniform"

    def physical(self, mean: Traceable, sigma: Traceable, z: Traceable) -> Traceable:
        """Return the physical values of coordinates with a standard-normal prior, arrays of NumPy or JAX."""
        if self is Prior.LOG_NORMAL:
            return mean * namespace(z).exp(sigma * z)
        if self is Prior.UNIFORM:
            error_function = special.erf if namespace(z) is np else erf
            return mean + sigma * error_function(z / SQRT2)
        return mean + sigma * z


class Quantity(NamedTuple):
    """Name and unit of a reported quantity."""

    name: str
    unit: str


class Parameter(NamedTuple):
    """One parameter of an effect, with its prior.

    Attributes
    ----------
    name, unit : str
        Name and unit of the parameter.
    sigma, mean : float
        Standard deviation and mean of a normal prior; `Prior` defines them for other shapes.
    prior : Prior
        Shape of the prior.
    """

    name: str
    unit: str
    sigma: float
    mean: float = 0.0
    prior: Prior = Prior.NORMAL

    @property
    def is_amplitude(self) -> bool:
        """Whether the parameter is an amplitude, which is zero where the effect is absent."""
        return self.prior is Prior.NORMAL and self.mean == 0.0

    def value(self, z: Traceable) -> Traceable:
        """Return the physical value of a coordinate with a standard-normal prior."""
        return self.prior.physical(self.mean, self.sigma, z)


WELL_INSIDE = 0.8
"""Largest distance of a starting value from the middle of a bounded range, relative to half the range."""


def coordinates_of(parameters: Sequence[Parameter], values: Sequence[float]) -> Floats:
    """Return the coordinates of physical values, of which those outside a bounded range are moved into it."""
    coordinates = []
    for parameter, value in zip(parameters, values, strict=True):
        if parameter.prior is Prior.LOG_NORMAL:
            coordinates.append(np.log(value / parameter.mean) / parameter.sigma)
        elif parameter.prior is Prior.UNIFORM:
            inside = np.clip((value - parameter.mean) / parameter.sigma, -WELL_INSIDE, WELL_INSIDE)
            coordinates.append(float(np.sqrt(2.0) * special.erfinv(inside)))
        else:
            coordinates.append((value - parameter.mean) / parameter.sigma)
    return np.array(coordinates)
