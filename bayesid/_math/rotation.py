"""Rotations as quaternions x, y, z, w, traced by JAX; matrices and everything else are JAX's or SciPy's `Rotation`."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array
from jax.scipy.spatial.transform import Rotation

from bayesid._math.small_matrices import cross

__all__ = ["quaternion_product", "quaternion_rate", "rotation", "rotation_between", "tilted"]


def rotation(quaternion: Array) -> Array:
    """Return the rotation matrix of a quaternion of any norm, shape (3, 3)."""
    return Rotation.from_quat(quaternion).as_matrix()


def quaternion_product(a: Array, b: Array) -> Array:
    """Return the product of two quaternions of any norm: the rotation b, then a."""
    vector = a[3] * b[:3] + b[3] * a[:3] + cross(a[:3], b[:3])
    return jnp.concatenate([vector, (a[3] * b[3] - a[:3] @ b[:3])[None]])


def quaternion_rate(quaternion: Array, rate: Array) -> Array:
    """Return the derivative of a quaternion that turns with an angular velocity in its moving axes [rad/s]."""
    return 0.5 * quaternion_product(quaternion, jnp.concatenate([rate, jnp.zeros(1)]))


def tilted(quaternion: Array, tilt: Array) -> Array:
    """Return an attitude turned by a small rotation (3,) in its moving axes [rad]."""
    small = jnp.concatenate([0.5 * tilt, jnp.ones(1)])
    return quaternion_product(quaternion, small / jnp.linalg.norm(small))


def rotation_between(first: Array, second: Array) -> Array:
    """Return the small rotation, in the axes of the first attitude, that leads to the second [rad], shape (3,)."""
    difference = quaternion_product(first * jnp.array([-1.0, -1.0, -1.0, 1.0]), second)
    return 2.0 * difference[:3] * jnp.sign(difference[3])
