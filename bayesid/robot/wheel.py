"""Reaction wheels of a robot, whose speed relative to the base is recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats

__all__ = ["Wheel"]

NORM_TOLERANCE = 1e-3  # deviation of an axis's norm from one above which it is taken for an error


@dataclass(frozen=True, eq=False)
class Wheel:
    """Rotor that spins about an axis fixed in the base; at rest it is part of the base.

    Parameters
    ----------
    name : str
        Name after the dot of its column ``wheel_speed.<name>`` in recordings.
    axis : (3,) array_like
        Unit vector of the axis about which a positive speed turns, base axes.
    inertia : float
        Moment of inertia about the axis [kg m2].
    position : (3,) array_like
        Centre of the rotor in the base [m]; used only for an imbalance.

    Raises
    ------
    InputError
        If the axis is no unit vector or the inertia is not positive.
    """

    name: str
    axis: ArrayLike
    inertia: float
    position: ArrayLike = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        norm = float(np.linalg.norm(self.axis))
        if np.shape(self.axis) != (3,) or abs(norm - 1.0) > NORM_TOLERANCE:
            problem = f"the norm of the axis {np.asarray(self.axis).tolist()} is {norm:.6g}, not 1"
            raise InputError(problem, place=f"wheel {self.name!r}", remedy="Give a unit vector in base axes")
        if not 0.0 < self.inertia < np.inf:
            problem = f"the inertia is {self.inertia:g} kg m2"
            raise InputError(problem, place=f"wheel {self.name!r}", remedy="Give a positive number")
        if np.shape(self.position) != (3,):
            problem = f"the position has shape {np.shape(self.position)}"
            raise InputError(problem, place=f"wheel {self.name!r}", remedy="Give x, y and z in the base [m]")
        for key, value in (("axis", np.asarray(self.axis) / norm), ("position", self.position)):
            array = np.array(value, dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, key, array)

    @property
    def across(self) -> Floats:
        """Two unit vectors across the axis that form a right-handed frame with it, shape (2, 3), base axes."""
        axis = np.asarray(self.axis)
        first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        first /= np.linalg.norm(first)
        return np.stack([first, np.cross(axis, first)])
