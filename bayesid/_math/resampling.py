"""Values of sampled curves at other times."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from bayesid._math.arrays import Floats, Traceable

__all__ = ["hermite", "hermite_weights", "resampled"]


def resampled(at: Array, time: Array, values: Array) -> Array:
    """Return sampled curves at other times, shape (N, C), by cubic Hermite interpolation with parabolic slopes.

    The curve goes through its samples, and its error between them falls with the third power of their distance. Beyond
    the first and the last sample it goes on along its slope there.

    Parameters
    ----------
    at : (N,) array
        Times of the result.
    time : (T,) array
        Increasing times of the samples, the last of which may be repeated as padding.
    values : (T, C) array
        Samples.
    """
    step = jnp.diff(time)[:, None]
    slope = jnp.where(step > 0.0, jnp.diff(values, axis=0) / jnp.where(step > 0.0, step, 1.0), 0.0)
    slopes = _parabolic_slopes(step, slope) if len(time) > 2 else jnp.concatenate([slope, slope])
    last = jnp.searchsorted(time, time[-1], side="left")
    inside = jnp.clip(at, time[0], time[-1])
    index = jnp.clip(jnp.searchsorted(time, inside, side="right") - 1, 0, jnp.maximum(last - 1, 0))
    h = time[index + 1] - time[index]
    s = ((inside - time[index]) / h)[:, None]
    left, right = slopes[index], slopes[index + 1]
    curve = hermite(values[index], values[index + 1], left * h[:, None], right * h[:, None], s)
    end = jnp.where(at[:, None] <= time[0], slopes[0], slopes[last])
    return curve + (at - inside)[:, None] * end


def _parabolic_slopes(step: Array, slope: Array) -> Array:
    """Return the slopes at T samples of the parabolas through three neighbours, from those of the intervals (T - 1, C).

    The first and the last sample, after which only padding follows, have the parabola of their nearest three.
    """
    left, right = step[:-1], step[1:]
    span = jnp.where(left + right > 0.0, left + right, 1.0)
    middle = (right * slope[:-1] + left * slope[1:]) / span
    first = slope[:1] + (slope[:1] - slope[1:2]) * left[:1] / span[:1]
    after = slope[1:] + (slope[1:] - slope[:-1]) * right / span  # of each parabola at its last sample
    follows = jnp.concatenate([step[1:] > 0.0, jnp.zeros((1, 1), bool)])
    inner = jnp.concatenate([middle, after[-1:]])
    ending = jnp.concatenate([slope[:1], after])
    return jnp.concatenate([first, jnp.where(follows, inner, ending)])


def hermite(
    left: Traceable, right: Traceable, left_slope: Traceable, right_slope: Traceable, s: Traceable
) -> Traceable:
    """Return the cubic at the fraction ``s`` of an interval, given values and slopes at both ends.

    Parameters
    ----------
    left, right : array
        Values at the ends of the interval.
    left_slope, right_slope : array
        Derivatives there, multiplied by the length of the interval.
    s : array
        Fraction of the interval, from 0 to 1.
    """
    jump = right - left
    return left + s * (
        left_slope + s * (3.0 * jump - 2.0 * left_slope - right_slope + s * (left_slope + right_slope - 2.0 * jump))
    )


def hermite_weights(s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the weights of both values and of both slopes in `hermite` at fractions of an interval.

    Parameters
    ----------
    s : array
        Fraction of the interval, from 0 to 1.
    """
    rest = 1.0 - s
    return rest**2 * (1.0 + 2.0 * s), s**2 * (1.0 + 2.0 * rest), s * rest**2, -(s**2) * rest
