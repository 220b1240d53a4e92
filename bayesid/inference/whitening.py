"""Whitening of the residual as one banded operator, for sensor noise, encoder noise through the dynamics, and filters.

The error of a sample is the noise of its sensor plus the effect of the errors of the smoothed joint motion, which is
correlated over a few samples. Each block of scalars is whitened given a window of blocks before it (Vecchia 1988); the
result tends to the exact Gaussian as the window grows and is positive definite for any window.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import scipy.linalg as sla
from jax import Array
from numpy.typing import NDArray
from scipy import sparse
from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.simulation.sensors import Filter

__all__ = ["NoiseChannel", "NoiseModel", "Whitening", "apply", "build"]


WINDOWS = (0, 2, 4, 8, 16, 32)
"""Numbers of earlier blocks to condition on, of which the first that is accurate to `TOLERANCE` is taken."""

TOLERANCE = 2e-4
"""Change of log standard deviation per scalar below which a longer window does not justify its cost."""


class NoiseChannel(NamedTuple):
    """Noise and sampling of one sensor axis.

    Attributes
    ----------
    sigma : float
        Standard deviation of the white noise.
    rows : (n,) integer array
        Rows of the sample grid at which the axis was sampled.
    filter : Filter
        Filter of the samples.
    coloured : pair of float
        Standard deviation and correlation time [s] of additional, exponentially correlated noise.
    """

    sigma: float
    rows: Integers
    filter: Filter
    coloured: tuple[float, float] = (0.0, 1.0)


@dataclass(frozen=True)
class NoiseModel:
    """Second moments of one recording's errors.

    Parameters
    ----------
    time : (T,) array
        Sample grid of all times at which any channel has a sample [s].
    channels : sequence of NoiseChannel
        Noise and sampling of the C channels.
    sensitivity : (joints, 3, T, C) array
        Change of each channel per unit error of joint position, velocity and acceleration at that time.
    joint_covariance : (joints, lags + 1, T, 3, 3) array
        Covariances of these errors with those at up to ``lags`` earlier samples.
    """

    time: Floats
    channels: Sequence[NoiseChannel]
    sensitivity: Floats
    joint_covariance: Floats


class Whitening(NamedTuple):
    """Banded operator that makes O blocks of C whitened scalars of the residual.

    Attributes
    ----------
    weights : (O, C, width, C) array
        Weights of the residual's rows in each block.
    start : (O,) integer array
        First row of the residual that enters each block.
    log_sigma : float
        Sum of the log standard deviations of all scalars before whitening.
    samples : int
        Number of scalars.
    outputs : (O, C) array of bool
        Mask of the scalars that exist.
    rows : (O,) integer array
        Row of the sample grid to which each block belongs.
    window : int
        Number of earlier blocks on which each block is conditioned.
    """

    weights: Floats
    start: Integers
    log_sigma: float
    samples: int
    outputs: NDArray[np.bool_]
    rows: Integers
    window: int

    def without(self, left_out: NDArray[np.bool_]) -> Whitening:
        """Return the whitening without the scalars of a mask (O, C), whose samples lose their weight in the others too.

        ``log_sigma`` keeps their share, since evidences are compared between fits that leave out the same samples.
        """
        weights = self.weights.copy()
        gone = {(int(self.rows[o]), int(c)) for o, c in zip(*np.nonzero(left_out), strict=True)}
        for block, first in enumerate(self.start):
            for offset in range(weights.shape[2]):
                for channel in range(weights.shape[3]):
                    if (int(first) + offset, channel) in gone:
                        weights[block, :, offset, channel] = 0.0
        weights[left_out] = 0.0
        outputs = self.outputs & ~left_out
        return self._replace(weights=weights, outputs=outputs, samples=int(outputs.sum()))


def apply(weights: Array, start: Array, residual: Array) -> Array:
    """Return the whitened residual (O, C) of a residual (T, C) that is padded with zeros for at least one window."""
    width = weights.shape[2]
    if width == 1:
        return jnp.einsum("oij,oj->oi", weights[:, :, 0], residual[start])
    windows = jax.vmap(lambda row: jax.lax.dynamic_slice_in_dim(residual, row, width, 0))(start)
    return jnp.einsum("oiwj,owj->oi", weights, windows)


def build(noise: NoiseModel, window: int | None = None) -> Whitening:
    """Return the whitening of one recording, by default with the shortest window that is accurate."""
    outputs = _outputs(noise)
    with threadpool_limits(limits=1):  # threads only slow down thousands of small factorisations
        return _shortest(noise, outputs) if window is None else _whiten(noise, outputs, window)


def _shortest(noise: NoiseModel, outputs: list[tuple[int, list[_Output]]]) -> Whitening:
    available = max(WINDOWS) if _is_coloured(noise) else noise.joint_covariance.shape[1] - 1
    best = _whiten(noise, outputs, 0)
    for window in WINDOWS[1:]:
        if window > available:
            break
        longer = _whiten(noise, outputs, window)
        if abs(best.log_sigma - longer.log_sigma) < TOLERANCE * max(longer.samples, 1):
            break
        best = longer
    return best


class _Output(NamedTuple):
    """One filtered scalar of a channel: the residual rows that enter it, and their weights."""

    channel: int
    rows: Integers
    taps: Floats


def _outputs(noise: NoiseModel) -> list[tuple[int, list[_Output]]]:
    """Return the filtered scalars of all channels, grouped by their row of the sample grid."""
    blocks: dict[int, list[_Output]] = {}
    for index, channel in enumerate(noise.channels):
        for output in _filtered(noise.time, channel, index):
            blocks.setdefault(int(output.rows[len(output.rows) // 2]), []).append(output)
    return sorted(blocks.items())


def _filtered(time: Floats, channel: NoiseChannel, index: int) -> list[_Output]:
    sampled = time[channel.rows]
    if channel.filter == Filter():
        return [_Output(index, channel.rows[i : i + 1], np.ones(1)) for i in range(len(sampled))]
    interval = float(np.median(np.diff(sampled)))
    taps = channel.filter.taps(interval)
    half = len(taps) // 2
    centres = range(half, len(sampled) - half, channel.filter.decimate)
    even = np.abs(np.diff(sampled) - interval) < 0.02 * interval  # a filter does not reach across a gap
    result = [
        _Output(index, channel.rows[i - half : i + half + 1], taps) for i in centres if even[i - half : i + half].all()
    ]
    if not result:
        raise InputError(
            f"the low-pass filter needs {len(taps)} evenly spaced samples and none fit",
            remedy="Raise low_pass or leave it out",
        )
    return result


def _whiten(noise: NoiseModel, blocks: list[tuple[int, list[_Output]]], window: int) -> Whitening:
    channels = len(noise.channels)
    sigma = np.array([channel.sigma for channel in noise.channels])
    spans = [(min(o.rows[0] for o in group), max(o.rows[-1] for o in group)) for _, group in blocks]
    first = np.minimum.accumulate(np.array([span[0] for span in spans])[::-1])[::-1]
    starts = [int(first[max(0, number - window)]) for number in range(len(blocks))]
    width = max(spans[number][1] - starts[number] + 1 for number in range(len(blocks)))
    weights = np.zeros((len(blocks), channels, width, channels))
    present = np.zeros((len(blocks), channels), dtype=bool)
    covariance, coloured = _Band(noise), _is_coloured(noise)
    log_sigma = 0.0
    for number, (_, group) in enumerate(blocks):
        start, stop = starts[number], max(spans[k][1] for k in range(max(0, number - window), number + 1)) + 1
        local = [output for k in range(max(0, number - window), number + 1) for output in blocks[k][1]]
        raw = covariance.between(start, stop) + np.diag(np.tile(sigma**2, stop - start))
        if coloured:
            raw = raw + _correlated(noise, start, stop)
        combine = _combination(local, start, stop, channels)
        factor = np.linalg.cholesky(combine @ raw @ combine.T)
        unit = np.eye(len(local))[:, -len(group) :]
        # the last rows of the inverse factor whiten this block given those before it
        last = sla.solve_triangular(factor, unit, lower=True, trans="T", check_finite=False).T
        rows = (combine.T @ last.T).T.reshape(len(group), stop - start, channels)
        slots = [output.channel for output in group]
        weights[number, slots, : stop - start] = rows
        present[number, slots] = True
        log_sigma += float(np.log(np.diag(factor)[-len(group) :]).sum())
    return Whitening(
        weights,
        np.array(starts, dtype=np.int32),
        log_sigma,
        int(present.sum()),
        present,
        np.array([row for row, _ in blocks]),
        window,
    )


def _is_coloured(noise: NoiseModel) -> bool:
    return any(channel.coloured[0] > 0.0 for channel in noise.channels)


def _correlated(noise: NoiseModel, start: int, stop: int) -> Floats:
    """Return the covariance of the channels' exponentially correlated noise, rows start to stop."""
    time = noise.time[start:stop]
    apart = np.abs(time[:, None] - time[None, :])
    count = len(noise.channels)
    result = np.zeros((len(time), count, len(time), count))
    for index, channel in enumerate(noise.channels):
        level, memory = channel.coloured
        result[:, index, :, index] = level**2 * np.exp(-apart / memory)
    return result.reshape(len(time) * count, -1)


def _combination(outputs: list[_Output], start: int, stop: int, channels: int) -> sparse.csr_array:
    """Return the matrix from the flattened residual rows start to stop to the filtered scalars."""
    columns = np.concatenate([(output.rows - start) * channels + output.channel for output in outputs])
    row = np.repeat(np.arange(len(outputs)), [len(output.rows) for output in outputs])
    taps = np.concatenate([output.taps for output in outputs])
    return sparse.csr_array((taps, (row, columns)), shape=(len(outputs), (stop - start) * channels))


class _Band:
    """Covariance of the residual due to errors of the joint motion, between rows of the sample grid."""

    def __init__(self, noise: NoiseModel) -> None:
        self.lags = noise.joint_covariance.shape[1] - 1
        count, channels = noise.sensitivity.shape[2:]
        self.channels = channels
        self.blocks = np.zeros((self.lags + 1, count, channels, channels))
        g = noise.sensitivity
        for lag in range(min(self.lags, count - 1) + 1):
            self.blocks[lag, lag:] = np.einsum(
                "jatc,jtab,jbtd->tcd",
                g[:, :, lag:],
                noise.joint_covariance[:, lag, lag:],
                g[:, :, : count - lag],
                optimize=True,
            )

    def between(self, start: int, stop: int) -> Floats:
        """Return the dense covariance of the rows start to stop."""
        row = np.arange(start, stop)
        later = np.maximum(row[:, None], row[None, :])
        lag = np.abs(row[:, None] - row[None, :])
        block = self.blocks[np.minimum(lag, self.lags), later]
        block[lag > self.lags] = 0.0
        upper = row[:, None] < row[None, :]
        block[upper] = np.swapaxes(block[upper], -1, -2)
        size = len(row) * self.channels
        return np.swapaxes(block, 1, 2).reshape(size, size)
