"""Rotations as quaternions x, y, z, w, traced by JAX."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from bayesid._math.small_matrices import cross

__all__ = ["quaternion_product", "quaternion_rate", "rotation"]


def rotation(quaternion: Array) -> Array:
    """Rotation matrix of a quaternion x, y, z, w of any norm."""
    x, y, z, w = quaternion / jnp.linalg.norm(quaternion)
    return jnp.stack(
        [
            jnp.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)]),
            jnp.stack([2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)]),
            jnp.stack([2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)]),
        ]
    )


def quaternion_product(a: Array, b: Array) -> Array:
    """Product of quaternions x, y, z, w: the rotation b, then a."""
    vector = a[3] * b[:3] + b[3] * a[:3] + cross(a[:3], b[:3])
    return jnp.concatenate([vector, (a[3] * b[3] - a[:3] @ b[:3])[None]])


def quaternion_rate(quaternion: Array, rate: Array) -> Array:
    return 0.5 * quaternion_product(quaternion, jnp.concatenate([rate, jnp.zeros(1)]))
