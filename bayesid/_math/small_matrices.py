"""Vectors, small matrices and rotations that JAX can trace, quaternions as x, y, z, w.

The algebra is written out because thousands of small calls to LAPACK are slow; for other forms of rotations use the
`Rotation` of JAX or SciPy.
"""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jax.scipy.spatial.transform import Rotation

__all__ = [
    "cross",
    "inertia_of",
    "inverse",
    "inverse_small",
    "quaternion_rate",
    "rotation",
    "rotation_between",
    "solve_small",
    "symmetric",
    "tilted",
    "turned",
]


def rotation(quaternion: Array) -> Array:
    """Return the rotation matrix of a quaternion of any norm, shape (3, 3)."""
    return Rotation.from_quat(quaternion).as_matrix()


def _quaternion_product(a: Array, b: Array) -> Array:
    """Return the product of two quaternions of any norm, which rotates by b and then by a."""
    vector = a[3] * b[:3] + b[3] * a[:3] + cross(a[:3], b[:3])
    return jnp.concatenate([vector, (a[3] * b[3] - a[:3] @ b[:3])[None]])


def quaternion_rate(quaternion: Array, rate: Array) -> Array:
    """Return the time derivative of an attitude, shape (4,) [1/s].

    Parameters
    ----------
    quaternion : (4,) array
        Attitude x, y, z, w.
    rate : (3,) array
        Angular velocity in the moving axes [rad/s].
    """
    return 0.5 * _quaternion_product(quaternion, jnp.concatenate([rate, jnp.zeros(1)]))


def tilted(quaternion: Array, tilt: Array) -> Array:
    """Return an attitude rotated by a small vector.

    Parameters
    ----------
    quaternion : (4,) array
        Attitude x, y, z, w.
    tilt : (3,) array
        Small rotation vector in the moving axes [rad].
    """
    small = jnp.concatenate([0.5 * tilt, jnp.ones(1)])
    return _quaternion_product(quaternion, small / jnp.linalg.norm(small))


def turned(quaternion: Array, vector: Array) -> Array:
    """Return an attitude rotated by a rotation vector, by a series smooth at zero.

    Parameters
    ----------
    quaternion : (4,) array
        Attitude x, y, z, w.
    vector : (3,) array
        Rotation vector in the moving axes [rad].
    """
    square = vector @ vector
    # `tilted` turns by twice the arctangent of half of what it is given
    return tilted(quaternion, vector * (1.0 + square / 12.0 + square**2 / 120.0))


def rotation_between(first: Array, second: Array) -> Array:
    """Return the small rotation vector (3,) from the first attitude to the second, in the axes of the first [rad].

    Parameters
    ----------
    first, second : (4,) array
        Unit quaternions x, y, z, w.
    """
    difference = _quaternion_product(first * jnp.array([-1.0, -1.0, -1.0, 1.0]), second)
    return 2.0 * difference[:3] * jnp.sign(difference[3])


def solve_small(matrix: Array, right: Array) -> Array:
    """Solve a small positive-definite system by elimination without pivoting.

    Parameters
    ----------
    matrix : (n, n) array
        Symmetric positive-definite matrix.
    right : (n,) array
        Right-hand side.
    """
    size = len(right)
    rows = [jnp.concatenate([matrix[i], right[i : i + 1]]) for i in range(size)]
    for i in range(size):
        rows[i] = rows[i] / rows[i][i]
        rows = [row if j == i else row - row[i] * rows[i] for j, row in enumerate(rows)]
    return jnp.stack([row[-1] for row in rows])


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of two vectors, shape (3,).

    Parameters
    ----------
    a, b : (3,) array
    """
    return jnp.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def symmetric(six: Array) -> Array:
    """Return the symmetric matrix, shape (3, 3), with the entries xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = six
    return jnp.stack([jnp.stack([xx, xy, xz]), jnp.stack([xy, yy, yz]), jnp.stack([xz, yz, zz])])


def inertia_of(second: Array) -> Array:
    """Return the inertia trace(M) 1 - M of a second moment of mass M, shape (3, 3)."""
    return jnp.trace(second) * jnp.eye(3) - second


def inverse(m: Array) -> Array:
    """Return the inverse of a symmetric matrix, shape (3, 3)."""
    a, b, c = cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])
    return jnp.stack([a, b, c], axis=1) / (m[0] @ a)


def inverse_small(matrix: Array) -> Array:
    """Return the inverse of a small positive-definite matrix of any size, column by column."""
    return jnp.stack([solve_small(matrix, unit) for unit in jnp.eye(len(matrix))], axis=1)
