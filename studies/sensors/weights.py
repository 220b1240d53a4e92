"""Weights of the two sensors in the sum of squares: the accelerometer as it reads, or integrated to a velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studies.sensors.setting import Noise

__all__ = ["alternating", "as_read", "constant", "integral", "integrated", "integrated_whole"]

Floats = NDArray[np.floating]


def integral(time: Floats) -> Floats:
    """Return the trapezoidal rule from the start as a matrix, shape (T - 1, T)."""
    step, samples = np.diff(time), np.eye(len(time))
    return np.cumsum(0.5 * step[:, None] * (samples[1:] + samples[:-1]), axis=0)


def alternating(count: int) -> Floats:
    """Return the one unit signal that the trapezoidal rule does not see, shape (count,)."""
    return np.where(np.arange(count) % 2, -1.0, 1.0) / np.sqrt(count)


def as_read(time: Floats, noise: Noise | None) -> Floats:
    """Weigh rates and accelerations by their noise, or all SI units alike."""
    rate, accel = (1.0, 1.0) if noise is None else (1.0 / noise.rate, 1.0 / noise.accel)
    return _both(rate * np.eye(len(time)), accel * np.eye(len(time)))


def integrated(time: Floats, noise: Noise | None) -> Floats:
    """Weigh rates and velocities, each by one noise as if it were white, or all SI units alike, as (21) does.

    The velocity's one noise is the root mean square of what integration makes of the accelerometer's.
    """
    rule = integral(time)
    if noise is None:
        return _both(np.eye(len(time)), rule)
    spread = noise.accel * np.sqrt((rule**2).sum(axis=1).mean())
    return _both(np.eye(len(time)) / noise.rate, rule / spread)


def integrated_whole(time: Floats, noise: Noise) -> Floats:
    """Weigh the velocities with their whole covariance."""
    rule = integral(time)
    factor = np.linalg.cholesky(rule @ rule.T)
    return _both(np.eye(len(time)) / noise.rate, np.linalg.solve(factor, rule) / noise.accel)


def constant(weight: Floats, time: Floats) -> Floats:
    """Return what an unknown velocity at the start adds to a weighted residual of `integrated`, shape (m, 3)."""
    velocities = len(time) - 1
    size = weight[-1].max() / integral(time)[-1].max()  # of a velocity's weight
    column = np.zeros((len(weight), 3))
    column[3 * len(time) :] = size * np.tile(np.eye(3), (velocities, 1))
    return column


def _both(rate: Floats, accel: Floats) -> Floats:
    """Return the operator on flat residuals (T, 6) of one on every rate and one on every acceleration."""
    return np.concatenate([np.kron(rate, np.eye(3, 6)), np.kron(accel, np.eye(3, 6, 3))])
