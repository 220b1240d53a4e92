"""Prior of one body's inertial parameters in log-Cholesky coordinates about its centre, and draws from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.log_cholesky import log_cholesky_vector, relative_coordinates

__all__ = ["BodyPrior", "Mixing", "check_mixing", "coordinates_of", "draw_inertial"]


Mixing = tuple[tuple[float, ...], ...]
"""Rows of a lower-triangular factor of the joint prior covariance, as tuples so that models compare and hash."""


@dataclass(frozen=True)
class BodyPrior:
    """Prior of one body's inertial parameters.

    Parameters
    ----------
    name : str
        Name of the link or load.
    centre : InertialParameters
        Body at which all coordinates are zero.
    spread : float
        Standard deviation of each log-Cholesky coordinate relative to the centre's pseudo-inertia. The mass is then
        log-normal with twice that relative width. Where a model has a joint prior (`Model.mixing`), the joint prior
        applies, and the spread is its root mean square.
    nuisance : bool
        Whether the body is marginalised and not reported, because it is only known approximately.
    """

    name: str
    centre: InertialParameters
    spread: float
    nuisance: bool = False

    def __post_init__(self) -> None:
        if not self.spread > 0.0:
            raise InputError(
                f"spread {self.spread:g} of {self.name} is not positive", remedy="Give the prior's relative width"
            )
        if not self.centre.is_extended:
            raise InputError(
                f"the prior of {self.name} is centred on a body without extent (mass {self.centre.mass:g} kg)",
                place=f"link {self.name}",
                remedy="Give mass and inertia of a body with volume, or remove it from the unknowns",
            )


def check_mixing(mixing: Mixing, bodies: int) -> None:
    """Reject a factor that is not lower-triangular of full rank or does not fit the number of bodies.

    Parameters
    ----------
    mixing : Mixing
    bodies : int
        Number of bodies of the prior.
    """
    count = 10 * bodies
    square = len(mixing) == count and all(len(row) == count for row in mixing)
    factor = np.array(mixing) if square else np.zeros((0, 0))
    if not square or not np.isfinite(factor).all() or np.triu(factor, 1).any() or not (np.diag(factor) > 0.0).all():
        raise InputError(
            f"the joint prior of {bodies} bodies is not a lower-triangular factor with {count} rows",
            remedy="Give the Cholesky factor of the covariance of all their log-Cholesky coordinates",
        )


def coordinates_of(body: BodyPrior, inertial: InertialParameters) -> Floats:
    """Return the coordinates of a body that are standard-normal under its prior, shape (10,).

    Parameters
    ----------
    body : BodyPrior
    inertial : InertialParameters
    """
    return relative_coordinates(body.centre, inertial) / body.spread


def draw_inertial(centre: InertialParameters, spread: float, rng: np.random.Generator) -> InertialParameters:
    """Draw a body from the log-Cholesky prior about a centre.

    Parameters
    ----------
    centre : InertialParameters
    spread : float
        Standard deviation of the log-Cholesky coordinates.
    rng : numpy.random.Generator
    """
    vector = log_cholesky_vector(centre, on_device(spread * rng.normal(size=10)))
    return InertialParameters.from_vector(np.asarray(vector))
