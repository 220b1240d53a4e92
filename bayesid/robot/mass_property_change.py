"""A stated change of a body between two studies: fuel burnt, a part released or taken on board."""

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
        The link or load that changes.
    mass : float
        [kg], negative if removed; not zero.
    com : (3,) array_like
        Where the centre of mass of what is added or removed is, in the axes of the body [m].
    inertia : (3, 3) array_like, optional
        Its inertia about its own centre of mass [kg m2]; a point mass where left out.
    mass_sigma : float
        Standard deviation of the mass [kg]; the inertia varies in proportion.
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
        """Ten linear parameters of what is added, negative if removed, shape (10,)."""
        inertia = np.zeros((3, 3)) if self.inertia is None else np.asarray(self.inertia, dtype=float)
        return np.sign(self.mass) * InertialParameters(abs(self.mass), self.com, inertia).vector
