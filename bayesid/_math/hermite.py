"""Cubic Hermite interpolation."""

from __future__ import annotations

from bayesid._math.arrays import Traceable

__all__ = ["hermite"]


def hermite(
    left: Traceable, right: Traceable, left_slope: Traceable, right_slope: Traceable, s: Traceable
) -> Traceable:
    """Return the cubic at the fraction ``s`` of an interval, given values and slopes at both ends.

    Slopes are derivatives multiplied by the length of the interval.
    """
    jump = right - left
    return left + s * (
        left_slope + s * (3.0 * jump - 2.0 * left_slope - right_slope + s * (left_slope + right_slope - 2.0 * jump))
    )
