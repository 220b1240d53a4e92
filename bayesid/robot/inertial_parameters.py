"""Inertial parameters of one rigid body.

A body is physical when its 4x4 pseudo-inertia ``[[Sigma, h], [h', m]]`` is positive definite, with ``Sigma`` the second
moment of mass about the link's origin (Wensing, Kim and Slotine, RA-L 2018). Coordinates in which every value is a
physical body are in `bayesid.robot.log_cholesky`. Study files are checked with this module, which imports no JAX.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, namespace

if TYPE_CHECKING:
    from jax import Array

__all__ = [
    "BASIS",
    "PARAMETERS",
    "BodyChange",
    "InertialParameters",
    "mass_com_inertia",
    "nearest_physical",
    "parameters_from_pseudo_inertia",
]

A = TypeVar("A", Floats, "Array")

PARAMETERS = 10
"""Number of inertial parameters of a rigid body."""


POINT = 1e-12  # square of the radius of gyration below which the mass of a body is in a point [m2]


def _basis() -> Floats:
    """Return the ten 4x4 matrices E_p with pseudo-inertia = sum_p parameter_p E_p, in Pinocchio's order."""
    basis = np.zeros((PARAMETERS, 4, 4))
    basis[0, 3, 3] = 1.0
    for axis in range(3):
        basis[1 + axis, axis, 3] = basis[1 + axis, 3, axis] = 1.0
    # Sigma = tr(I) / 2 - I
    for index, axis in ((4, 0), (6, 1), (9, 2)):
        basis[index, :3, :3] = 0.5 * np.eye(3)
        basis[index, axis, axis] -= 1.0
    for index, (row, column) in ((5, (0, 1)), (7, (0, 2)), (8, (1, 2))):
        basis[index, row, column] = basis[index, column, row] = -1.0
    return basis


BASIS = _basis()
"""Matrices, shape (10, 4, 4), whose combination with the ten parameters is the pseudo-inertia."""
BASIS.setflags(write=False)


@dataclass(frozen=True)
class InertialParameters:
    """Mass, centre of mass and inertia of one link, in the link's axes.

    Parameters
    ----------
    mass : float
        Mass [kg].
    com : (3,) array_like
        Centre of mass [m].
    inertia : (3, 3) array_like
        Inertia about the centre of mass [kg m2].

    Raises
    ------
    InputError
        If no rigid body has these parameters; the message states the inequality that fails.
    """

    mass: float
    com: Floats
    inertia: Floats

    def __init__(self, mass: float, com: ArrayLike, inertia: ArrayLike) -> None:
        centre, tensor = np.array(com, dtype=float), np.array(inertia, dtype=float)
        for array in (centre, tensor):
            array.setflags(write=False)
        object.__setattr__(self, "mass", float(mass))
        object.__setattr__(self, "com", centre)
        object.__setattr__(self, "inertia", tensor)
        self._validate()

    def _validate(self) -> None:
        if self.com.shape != (3,) or self.inertia.shape != (3, 3):
            problem = f"centre of mass and inertia have shapes {self.com.shape} and {self.inertia.shape}"
            raise InputError(problem, remedy="Give three coordinates and a 3x3 tensor")
        if not (np.isfinite(self.mass) and np.isfinite(self.com).all() and np.isfinite(self.inertia).all()):
            raise InputError("an inertial parameter is not finite", remedy="Give finite numbers")
        remedy = "No rigid body has these values; correct them"
        if self.mass < 0.0:
            raise InputError(f"mass >= 0 fails: mass = {self.mass:g} kg", remedy=remedy)
        if not np.allclose(self.inertia, self.inertia.T, rtol=1e-9, atol=1e-12 * max(1.0, np.abs(self.inertia).max())):
            raise InputError("the inertia tensor is not symmetric", remedy=remedy)
        low, middle, high = np.linalg.eigvalsh(self.inertia)
        slack = max(1e-9 * high, POINT * self.mass)
        if low < -slack:
            raise InputError(f"principal moments >= 0 fails: the smallest is {low:g} kg m2", remedy=remedy)
        if low + middle < high - slack:
            raise InputError(
                f"the triangle inequality I1 + I2 >= I3 of the principal moments fails: "
                f"{low:g} + {middle:g} < {high:g} kg m2",
                remedy=remedy,
            )
        if self.mass == 0.0 and high > 0.0:
            raise InputError(f"mass > 0 fails for a body with inertia {high:g} kg m2", remedy=remedy)

    @classmethod
    def from_vector(cls, parameters: ArrayLike) -> InertialParameters:
        """Return the body of ten parameters ``m, mc (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz`` about the link's origin."""
        vector = np.asarray(parameters, dtype=float)
        mass = vector[0]
        com = vector[1:4] / mass if mass else np.zeros(3)
        xx, xy, yy, xz, yz, zz = vector[4:]
        about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return cls(mass, com, about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com)))

    @property
    def vector(self) -> Floats:
        """Ten parameters in which the dynamics is linear, in Pinocchio's order (`from_vector`)."""
        c = self.com
        tensor = self.inertia + self.mass * (c @ c * np.eye(3) - np.outer(c, c))
        return np.array([self.mass, *(self.mass * c), *tensor[np.tril_indices(3)]])

    @property
    def pseudo_inertia(self) -> Floats:
        """Pseudo-inertia, shape (4, 4) [kg m2, kg m, kg]."""
        return np.einsum("p,pij->ij", self.vector, BASIS)

    @property
    def is_extended(self) -> bool:
        """Whether the mass fills a volume, as log-Cholesky coordinates require; that of a rod or point does not."""
        return self.mass > 0.0 and bool(np.linalg.eigvalsh(self.pseudo_inertia / self.mass)[0] > 1e-12)


def nearest_physical(inertia: Floats, margin: float = 0.0) -> Floats:
    """Return the inertia of the physical body whose second moments of mass are nearest, in the Frobenius norm.

    Parameters
    ----------
    inertia : (3, 3) array
        Symmetric, about the centre of mass [kg m2].
    margin : float
        Smallest principal second moment of the result relative to the largest: 0 admits plates and rods, which have no
        log-Cholesky coordinates.

    Returns
    -------
    (3, 3) array
    """
    moments, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    second = (axes * np.maximum(moments, margin * max(moments[-1], 0.0))) @ axes.T
    return np.asarray(np.trace(second) * np.eye(3) - second)


def parameters_from_pseudo_inertia(pseudo_inertia: A) -> A:
    """Ten linear parameters (`InertialParameters.vector`) of a pseudo-inertia of NumPy or JAX, (4, 4) -> (10,)."""
    xp = namespace(pseudo_inertia)
    sigma = pseudo_inertia[:3, :3]
    tensor = xp.trace(sigma) * xp.eye(3) - sigma
    lower = xp.stack([tensor[0, 0], tensor[1, 0], tensor[1, 1], tensor[2, 0], tensor[2, 1], tensor[2, 2]])
    return cast("A", xp.concatenate([pseudo_inertia[3:, 3], pseudo_inertia[:3, 3], lower]))


def mass_com_inertia(vectors: A) -> A:
    """Return mass, centre of mass and inertia about it (xx, yy, zz, xy, xz, yz) of linear parameters.

    Parameters
    ----------
    vectors : (..., 10) array
        Linear parameters (`InertialParameters.vector`), of NumPy or of JAX.

    Returns
    -------
    (..., 10) array
    """
    xp = namespace(vectors)
    mass, first = vectors[..., :1], vectors[..., 1:4]
    com = first / mass
    xx, xy, yy, xz, yz, zz = xp.moveaxis(vectors[..., 4:], -1, 0)
    m, (x, y, z) = mass[..., 0], xp.moveaxis(com, -1, 0)
    tensor = [
        xx - m * (y * y + z * z),
        yy - m * (x * x + z * z),
        zz - m * (x * x + y * y),
        xy + m * x * y,
        xz + m * x * z,
        yz + m * y * z,
    ]
    return cast("A", xp.concatenate([mass, com, xp.stack(tensor, axis=-1)], axis=-1))


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
            raise InputError(
                "the mass is 0", place=self.body, remedy="Give the added mass, or the removed mass as a negative number"
            )
        _ = self.vector

    @property
    def vector(self) -> Floats:
        """Ten linear parameters of the part that is added, negative if it is removed, shape (10,)."""
        inertia = np.zeros((3, 3)) if self.inertia is None else np.asarray(self.inertia, dtype=float)
        return np.sign(self.mass) * InertialParameters(abs(self.mass), self.com, inertia).vector
