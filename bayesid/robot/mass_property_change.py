"""A change of a body between two studies that the user states: fuel burnt, a part released or taken on board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.inertial_parameters import InertialParameters

__all__ = ["BodyChange"]


@dataclass(frozen=True)
class BodyChange:
    """A rigid body added to a body of the robot or, with a negative mass, taken from it.

    Parameters
    ----------
    body : str
        Name of the link or load that changes.
    mass : float
        Mass that is added, negative if it is removed, and not zero [kg].
    com : (3,) array_like
        Centre of mass of the part that is added or removed, in the axes of the body [m].
    inertia : (3, 3) array_like, optional
        Inertia of the part about its centre of mass, by default that of a point mass [kg m2].
    mass_sigma : float
        Standard deviation of the mass; the inertia varies in proportion [kg].

    Raises
    ------
    InputError
        If the mass is zero, or no rigid body has these parameters.
    """

    body: str
    mass: float
    com: Sequence[float]
    inertia: Sequence[Sequence[float]] | Floats | None = None
    mass_sigma: float = 0.0

    def __post_init__(self) -> None:
        if self.mass == 0.0:
            raise InputError("the mass is 0", place=self.body, remedy="Give what was added, or what was removed as < 0")
        _ = self.vector

    @property
    def vector(self) -> Floats:
        """Ten linear parameters of the part that is added, negative if it is removed, shape (10,)."""
        inertia = np.zeros((3, 3)) if self.inertia is None else np.asarray(self.inertia, dtype=float)
        return np.sign(self.mass) * InertialParameters(abs(self.mass), self.com, inertia).vector
