"""Algebra of vectors and small matrices, written out because thousands of small calls to LAPACK are slow."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

__all__ = ["cross", "inverse", "inverse_small", "solve_small", "symmetric", "trace_less"]


def solve_small(matrix: Array, right: Array) -> Array:
    """Solve a small positive-definite system, shapes (n, n) and (n,), by elimination without pivoting."""
    size = len(right)
    rows = [jnp.concatenate([matrix[i], right[i : i + 1]]) for i in range(size)]
    for i in range(size):
        rows[i] = rows[i] / rows[i][i]
        rows = [row if j == i else row - row[i] * rows[i] for j, row in enumerate(rows)]
    return jnp.stack([row[-1] for row in rows])


def cross(a: Array, b: Array) -> Array:
    """Return the cross product of two vectors, shape (3,)."""
    return jnp.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def symmetric(six: Array) -> Array:
    """Return the symmetric matrix, shape (3, 3), with the entries xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = six
    return jnp.stack([jnp.stack([xx, xy, xz]), jnp.stack([xy, yy, yz]), jnp.stack([xz, yz, zz])])


def trace_less(second: Array) -> Array:
    """Return the inertia trace(M) 1 - M of a second moment of mass M, shape (3, 3)."""
    return jnp.trace(second) * jnp.eye(3) - second


def inverse(m: Array) -> Array:
    """Return the inverse of a symmetric matrix, shape (3, 3)."""
    a, b, c = cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])
    return jnp.stack([a, b, c], axis=1) / (m[0] @ a)


def inverse_small(matrix: Array) -> Array:
    """Return the inverse of a small positive-definite matrix of any size, column by column."""
    return jnp.stack([solve_small(matrix, unit) for unit in jnp.eye(len(matrix))], axis=1)
