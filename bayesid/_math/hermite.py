"""Cubic Hermite interpolation."""

from __future__ import annotations

from jax import Array

__all__ = ["hermite"]


def hermite(left: Array, right: Array, left_slope: Array, right_slope: Array, s: Array) -> Array:
    """Return the cubic at the fraction ``s`` of an interval, given values and slopes at both ends.

    Slopes are derivatives multiplied by the length of the interval.
    """
    jump = right - left
    return left + s * (
        left_slope + s * (3.0 * jump - 2.0 * left_slope - right_slope + s * (left_slope + right_slope - 2.0 * jump))
    )
