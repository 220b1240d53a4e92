"""Weights of the two sensors in the sum of squares: the accelerometer as it reads, or integrated to a velocity."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from studies.sensors.setting import Noise

__all__ = ["as_read", "constant", "integral", "integrated", "integrated_whole"]


def integral(time: Floats) -> Floats:
    """Return the trapezoidal rule from the start as a matrix, shape (T - 1, T)."""
    step, samples = np.diff(time), np.eye(len(time))
    return np.cumsum(0.5 * step[:, None] * (samples[1:] + samples[:-1]), axis=0)


def as_read(time: Floats, noise: Noise | None) -> Floats:
    """Return weights of rates and accelerations by their noise, or equal ones in SI units without a noise."""
    rate, accel = (1.0, 1.0) if noise is None else (1.0 / noise.rate, 1.0 / noise.accel)
    return _both(rate * np.eye(len(time)), accel * np.eye(len(time)))


def integrated(time: Floats, noise: Noise | None) -> Floats:
    """Return weights of rates and velocities by their noise as if it were white, or equal ones as in (21) without one.

    The noise of the velocity is the root mean square of the accelerometer's integrated noise.
    """
    rule = integral(time)
    if noise is None:
        return _both(np.eye(len(time)), rule)
    spread = noise.accel * np.sqrt((rule**2).sum(axis=1).mean())
    return _both(np.eye(len(time)) / noise.rate, rule / spread)


def integrated_whole(time: Floats, noise: Noise) -> Floats:
    """Return weights of rates by their noise and of velocities by their full covariance."""
    rule = integral(time)
    factor = np.linalg.cholesky(rule @ rule.T)
    return _both(np.eye(len(time)) / noise.rate, np.linalg.solve(factor, rule) / noise.accel)


def constant(weight: Floats, time: Floats) -> Floats:
    """Return derivatives of a weighted residual of `integrated` by the velocity at the start, shape (m, 3)."""
    velocities = len(time) - 1
    size = weight[-1].max() / integral(time)[-1].max()  # weight of a velocity
    column = np.zeros((len(weight), 3))
    column[3 * len(time) :] = size * np.tile(np.eye(3), (velocities, 1))
    return column


def _both(rate: Floats, accel: Floats) -> Floats:
    """Return one matrix on flat residuals (T, 6) from a matrix on each rate axis and one on each acceleration axis."""
    return np.concatenate([np.kron(rate, np.eye(3, 6)), np.kron(accel, np.eye(3, 6, 3))])
