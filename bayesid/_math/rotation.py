"""Rotations as quaternions x, y, z, w that JAX can trace; for other forms use the `Rotation` of JAX or SciPy."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jax.scipy.spatial.transform import Rotation

from bayesid._math.small_matrices import cross

__all__ = ["quaternion_product", "quaternion_rate", "rotation", "rotation_between", "tilted", "turned"]


def rotation(quaternion: Array) -> Array:
    """Return the rotation matrix of a quaternion of any norm, shape (3, 3)."""
    return Rotation.from_quat(quaternion).as_matrix()


def quaternion_product(a: Array, b: Array) -> Array:
    """Return the product of two quaternions of any norm, which rotates by b and then by a."""
    vector = a[3] * b[:3] + b[3] * a[:3] + cross(a[:3], b[:3])
    return jnp.concatenate([vector, (a[3] * b[3] - a[:3] @ b[:3])[None]])


def quaternion_rate(quaternion: Array, rate: Array) -> Array:
    """Return the time derivative of an attitude, given its angular velocity in the moving axes [rad/s]."""
    return 0.5 * quaternion_product(quaternion, jnp.concatenate([rate, jnp.zeros(1)]))


def tilted(quaternion: Array, tilt: Array) -> Array:
    """Return an attitude rotated by a small rotation vector (3,) in its moving axes [rad]."""
    small = jnp.concatenate([0.5 * tilt, jnp.ones(1)])
    return quaternion_product(quaternion, small / jnp.linalg.norm(small))


def turned(quaternion: Array, vector: Array) -> Array:
    """Return an attitude rotated by a rotation vector (3,) in its moving axes [rad], by a series smooth at zero."""
    square = vector @ vector
    # `tilted` turns by twice the arctangent of half of what it is given
    return tilted(quaternion, vector * (1.0 + square / 12.0 + square**2 / 120.0))


def rotation_between(first: Array, second: Array) -> Array:
    """Return the small rotation vector (3,) from the first attitude to the second, in the axes of the first [rad]."""
    difference = quaternion_product(first * jnp.array([-1.0, -1.0, -1.0, 1.0]), second)
    return 2.0 * difference[:3] * jnp.sign(difference[3])
