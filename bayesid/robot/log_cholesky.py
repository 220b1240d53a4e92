"""Coordinates of one body relative to the centre of its prior: log-Cholesky, and linear in the parameters.

With ``U0`` the factor of the centre's pseudo-inertia, a body has ``J = U0 U(theta) U(theta)' U0'``; ``theta`` (10,) are
its log-Cholesky coordinates, of which every value is a physical body; the ten entries of ``U U' - 1`` (upper triangle)
are linear in its parameters. The coordinates are those of Rucker and Wensing (RA-L 2022) in Pinocchio's order:
``alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3``.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid._math.double_precision import in_double_precision
from bayesid._math.on_device import on_device
from bayesid.robot.inertial_parameters import InertialParameters, parameters_from_pseudo_inertia

__all__ = [
    "LOG_CHOLESKY",
    "SLOPE",
    "absolute",
    "central",
    "from_central",
    "log_cholesky_coordinates",
    "log_cholesky_factor",
    "log_cholesky_vector",
    "log_volume",
    "log_volume_of_central",
    "relative",
    "relative_coordinates",
    "upper_cholesky",
    "vector_from_factor",
]

LOG_CHOLESKY = ("alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")
"""Names of the log-Cholesky coordinates (Rucker & Wensing 2022)."""

_ROW, _COLUMN = np.triu_indices(4)


def log_cholesky_factor(coordinates: Array) -> Array:
    """Upper-triangular factor U(theta) of ``J = U U'``; theta = 0 gives the identity.

    Parameters
    ----------
    coordinates : (10,) array
        ``alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3``.

    Returns
    -------
    (4, 4) array
    """
    alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3 = coordinates
    zero, one = jnp.zeros_like(alpha), jnp.ones_like(alpha)
    rows = [
        [jnp.exp(d1), s12, s13, t1],
        [zero, jnp.exp(d2), s23, t2],
        [zero, zero, jnp.exp(d3), t3],
        [zero, zero, zero, one],
    ]
    return jnp.exp(alpha) * jnp.stack([jnp.stack(row) for row in rows])


@in_double_precision
def log_cholesky_vector(centre: InertialParameters, coordinates: Array) -> Array:
    """Ten linear parameters of the body with given log-Cholesky coordinates relative to a centre, shape (10,).

    Parameters
    ----------
    centre : InertialParameters
    coordinates : (10,) array
        Log-Cholesky coordinates, without unit.
    """
    return vector_from_factor(on_device(upper_cholesky(centre.pseudo_inertia)), coordinates)


@in_double_precision
@jax.jit  # traced once for all bodies
def vector_from_factor(centre: Array, coordinates: Array) -> Array:
    """Return `log_cholesky_vector` for a centre given by the factor (4, 4) of its pseudo-inertia (`upper_cholesky`).

    Parameters
    ----------
    centre : (4, 4) array
        Upper factor of the centre's pseudo-inertia.
    coordinates : (10,) array
        Log-Cholesky coordinates, without unit.
    """
    factor = centre @ log_cholesky_factor(coordinates)
    return parameters_from_pseudo_inertia(factor @ factor.T)


def upper_cholesky(pseudo_inertia: Floats) -> Floats:
    """Upper-triangular U with ``U U' = pseudo_inertia``, shape (4, 4)."""
    flipped = np.linalg.cholesky(pseudo_inertia[::-1, ::-1])
    return flipped[::-1, ::-1]


def relative(theta: Array) -> Array:
    """Return the entries of the relative pseudo-inertia less the identity, shape (10,)."""
    factor = log_cholesky_factor(theta)
    return ((factor @ factor.T) - jnp.eye(4))[_ROW, _COLUMN]


def absolute(entries: Array) -> Array:
    """Return the log-Cholesky coordinates of entries (10,), not a number where no physical body has them."""
    upper = jnp.zeros((4, 4)).at[_ROW, _COLUMN].set(entries)
    matrix = jnp.eye(4) + upper + upper.T - jnp.diag(jnp.diag(upper))
    u = _upper_factor(matrix)
    unit = u / u[3, 3]
    d = jnp.log(jnp.diag(unit)[:3])
    rest = jnp.stack([unit[0, 1], unit[1, 2], unit[0, 2], unit[0, 3], unit[1, 3], unit[2, 3]])
    return jnp.concatenate([jnp.log(u[3, 3])[None], d, rest])


def central(theta: Array) -> Array:
    """Return `relative` with log mass, centre of mass and second moments about it in place of the moments, shape (10,).

    Near the centre both are alike. The motion of a rigid body determines these nine and not its mass.
    """
    factor = log_cholesky_factor(theta)
    upper = factor[:3, :3]
    matrix = jnp.zeros((4, 4)).at[:3, :3].set(upper @ upper.T - jnp.eye(3)).at[:3, 3].set(theta[7:])
    return matrix.at[3, 3].set(2.0 * theta[0])[_ROW, _COLUMN]


def from_central(entries: Array) -> Array:
    """Return the log-Cholesky coordinates of `central` entries (10,), not a number where no body has them."""
    upper = jnp.zeros((4, 4)).at[_ROW, _COLUMN].set(entries)
    mass, com = jnp.exp(upper[3, 3]), upper[:3, 3]
    about_origin = upper[:3, :3] + jnp.triu(mass * jnp.outer(com, com))
    moments = upper.at[:3, :3].set(about_origin).at[:3, 3].set(mass * com).at[3, 3].set(mass - 1.0)
    return absolute(moments[_ROW, _COLUMN])


def log_volume_of_central(theta: Array) -> Array:
    """Return the logarithm of the determinant of d central / d theta."""
    return log_volume(theta) - 8.0 * theta[0]  # by log mass and centre of mass: 1 / mass^4, and mass = exp(2 alpha)


def _upper_factor(matrix: Array) -> Array:
    """Return the upper-triangular U with ``U U' = matrix`` (4, 4), not a number where there is none.

    The factorisation is written out, because thousands of this size in one call to LAPACK can block the threads.
    """
    u = [[jnp.zeros(()) for _ in range(4)] for _ in range(4)]
    for k in (3, 2, 1, 0):
        u[k][k] = jnp.sqrt(matrix[k, k] - sum(u[k][j] ** 2 for j in range(k + 1, 4)))
        for i in range(k):
            u[i][k] = (matrix[i, k] - sum(u[i][j] * u[k][j] for j in range(k + 1, 4))) / u[k][k]
    return jnp.stack([jnp.stack(row) for row in u])


def log_volume(theta: Array) -> Array:
    """Return the logarithm of the determinant of d relative / d theta."""
    # |d(U U')/dU| = 2^4 prod u_ii^i for upper-triangular U, times |dU/dtheta| = u_11 u_22 u_33 u_44 u_44^6
    alpha, d = theta[0], theta[1:4]
    logs = jnp.concatenate([alpha + d, alpha[None]])
    return 4.0 * jnp.log(2.0) + (jnp.arange(1.0, 5.0) @ logs) + logs.sum() + 6.0 * alpha


def _slope() -> Floats:
    """Return d relative / d theta at the centre, shape (10, 10)."""
    units = np.zeros((10, 4, 4))
    units[0] = np.eye(4)
    for index, place in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)], start=1):
        units[index][place] = 1.0
    return (units + units.transpose(0, 2, 1))[:, _ROW, _COLUMN].T


SLOPE = _slope()
"""Derivative of `relative` at the centre, shape (10, 10)."""
SLOPE.setflags(write=False)


def relative_coordinates(centre: InertialParameters, inertial: InertialParameters) -> Floats:
    """Return the log-Cholesky coordinates of a body relative to a centre, shape (10,).

    Parameters
    ----------
    centre : InertialParameters
    inertial : InertialParameters
    """
    return log_cholesky_coordinates(centre.pseudo_inertia, inertial.pseudo_inertia[None])[0]


def log_cholesky_coordinates(centre: Floats, bodies: Floats) -> Floats:
    """Return the log-Cholesky coordinates of pseudo-inertias (n, 4, 4) relative to one (4, 4), shape (n, 10).

    Parameters
    ----------
    centre : (4, 4) array
        Pseudo-inertia of the centre.
    bodies : (n, 4, 4) array
        Pseudo-inertias [kg m2, kg m, kg].
    """
    factors = np.linalg.cholesky(bodies[:, ::-1, ::-1])[:, ::-1, ::-1]
    shape = np.linalg.solve(upper_cholesky(centre), factors)
    alpha = np.log(shape[:, 3, 3])
    u = shape / shape[:, 3:, 3:]
    d = [np.log(u[:, k, k]) for k in range(3)]
    rest = [u[:, row, column] for row, column in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
    return np.stack([alpha, *d, *rest], axis=1)
