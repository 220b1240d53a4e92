"""Cubic Hermite interpolation."""

from __future__ import annotations

from jax import Array

__all__ = ["hermite"]


def hermite(left: Array, right: Array, left_slope: Array, right_slope: Array, s: Array) -> Array:
    """Return the cubic at the fraction ``s`` of an interval, from values and slopes (times its length) at both ends."""
    jump = right - left
    return left + s * (
        left_slope + s * (3.0 * jump - 2.0 * left_slope - right_slope + s * (left_slope + right_slope - 2.0 * jump))
    )
