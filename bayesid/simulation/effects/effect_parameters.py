"""Parameters of an effect, with units and priors on a physical scale, and the largest plausible size of amplitudes.

A diagnosis gives all amplitudes of an effect that share a unit one scale, log-uniform between that bound and what the
data can resolve. The bound limits the scale, not each amplitude. Where it is generous by a factor of two, the evidence
loses less than a tenth of a nat over four decades; where it is too narrow, a cause is missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from jax.scipy.special import erf
from scipy import special

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Traceable, namespace

__all__ = ["Parameter", "PhysicalBound", "Prior", "Quantity", "bounds_of_priors", "coordinates_of", "three_digits"]

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
        """Return the physical values of coordinates with a standard-normal prior, arrays of NumPy or JAX.

        Parameters
        ----------
        mean, sigma : array
            Parameters of the prior, in the unit of the value.
        z : array
            Coordinates with a standard-normal prior.
        """
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
    """Return the coordinates of physical values, of which those outside a bounded range are moved into it.

    Parameters
    ----------
    parameters : sequence of Parameter
        Parameters with their priors.
    values : sequence of float
        Value of each, in its unit.
    """
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


SPREADS = 3.0
"""Prior standard deviations at which the largest size lies where no physical bound is known."""


@dataclass(frozen=True)
class PhysicalBound:
    """Largest plausible size of the amplitudes of one unit.

    Parameters
    ----------
    unit : str
        Unit of the amplitudes.
    largest : float
        Largest plausible magnitude, in that unit.
    reason : str
        One sentence on why larger sizes are implausible.

    Raises
    ------
    InputError
        If the size is not a positive number or the reason is empty.
    """

    unit: str
    largest: float
    reason: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "largest", float(self.largest))
        if not 0.0 < self.largest < np.inf:
            raise InputError(
                f"the largest size {self.largest:g} {self.unit} is not a positive number",
                remedy="Give the largest plausible magnitude",
            )
        if not self.reason:
            raise InputError(
                f"the largest size {self.largest:g} {self.unit} has no reason",
                remedy="State in one sentence why larger sizes are implausible",
            )


def three_digits(value: float) -> str:
    """Return a number with three digits for a reason, such as ``2790``."""
    return f"{float(f'{value:.3g}'):g}"


def bounds_of_priors(parameters: Sequence[Parameter]) -> tuple[PhysicalBound, ...]:
    """Return the sizes of amplitudes at three standard deviations of their priors, one bound for each unit."""
    bounds = []
    for unit in dict.fromkeys(parameter.unit for parameter in parameters):
        group = [parameter for parameter in parameters if parameter.unit == unit]
        ends = [float(abs(parameter.value(np.array([-SPREADS, SPREADS]))).max()) for parameter in group]
        reason = f"No physical bound is stated; this size is {SPREADS:g} standard deviations of the prior."
        bounds.append(PhysicalBound(unit, max(ends), reason))
    return tuple(bounds)
