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
from jax import Array
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.simulation.sensors import Filter

__all__ = ["MotionErrors", "NoiseChannel", "SampleNoise", "Whitening", "apply", "build"]


WINDOWS = (0, 2, 4, 8, 16, 32)
"""Numbers of earlier blocks to condition on, of which the first that is accurate to `TOLERANCE` is taken."""

TOLERANCE = 2e-4
"""Change of log standard deviation per scalar below which a longer window does not justify its cost."""

SLOW = 0.01
"""Relative change of the information on a constant of any channel below which the same holds.

What is learnt of bodies changes slowly, and sees the noise's density at low frequency, to which many lags add.
"""

LARGEST = 4_000_000
"""Number of entries of the covariances that are factorised together."""


class NoiseChannel(NamedTuple):
    """Noise and sampling of one sensor axis.

    Attributes
    ----------
    sigma : float or (n,) array
        Standard deviation of the white noise.
    rows : (n,) integer array
        Rows of the sample grid at which the axis was sampled.
    filter : Filter
        Filter of the samples.
    coloured : pair of float
        Standard deviation and correlation time [s] of additional, exponentially correlated noise.
    averaged : (n,) integer array, optional
        Number of samples of which each is the mean, by default one.
    interval : float
        Time between these samples [s].
    """

    sigma: float | Floats
    rows: Integers
    filter: Filter
    coloured: tuple[float, float] = (0.0, 1.0)
    averaged: Integers | None = None
    interval: float = 0.0

    def gridded(self, values: float | Floats, length: int, rest: float = 0.0) -> Floats:
        """Return values at the rows of the channel as an array over the whole grid, ``rest`` at the other rows.

        Parameters
        ----------
        values : float or (n,) array
        length : int
            Number of rows of the grid.
        rest : float
        """
        whole = np.full(length, rest)
        whole[self.rows] = values
        return whole

    def coloured_moments(self, length: int) -> tuple[Floats, Floats]:
        """Return the moments of the coloured noise in means over blocks, relative to those in single samples.

        Returns
        -------
        log_gain : (T,) array
            Sum of the logarithms of two rows' gains belongs to their covariance.
        variance : (T,) array
        """
        if self.averaged is None:
            return np.zeros(length), np.ones(length)
        step, count = self.interval / self.coloured[1], self.averaged
        log_gain = _log_sinh(0.5 * step * count) - np.log(count) - _log_sinh(np.full(len(count), 0.5 * step))
        kept, lost = np.exp(-step), -np.expm1(-step)
        pairs = kept / lost + kept * np.expm1(-step * count) / (count * lost**2)
        variance = np.where(count > 1, (1.0 + 2.0 * pairs) / count, 1.0)
        return self.gridded(log_gain, length), self.gridded(variance, length, 1.0)


def _log_sinh(x: Floats) -> Floats:
    """Return the logarithm of twice the hyperbolic sine, which does not overflow."""
    return np.asarray(x + np.log(-np.expm1(-2.0 * x)))


class MotionErrors(NamedTuple):
    """Errors of the motion of S joints or wheels, which are independent of one another, in K quantities each.

    Attributes
    ----------
    sensitivity : (S, K, T, C) array
        Change of each channel per unit error of each quantity at that time.
    covariance : (S, lags + 1, T, K, K) array
        Covariances of these errors with those at up to ``lags`` earlier samples.
    """

    sensitivity: Floats
    covariance: Floats


@dataclass(frozen=True)
class SampleNoise:
    """Second moments of one recording's errors.

    Parameters
    ----------
    time : (T,) array
        Sample grid of all times at which any channel has a sample [s].
    channels : sequence of NoiseChannel
        Noise and sampling of the C channels.
    errors : sequence of MotionErrors
        Errors of the motion of joints and wheels.
    """

    time: Floats
    channels: Sequence[NoiseChannel]
    errors: Sequence[MotionErrors] = ()

    @property
    def lags(self) -> int:
        """Largest number of earlier samples with which the errors of the motion are correlated."""
        return max((errors.covariance.shape[1] - 1 for errors in self.errors), default=0)


class Whitening(NamedTuple):
    """Banded operator that makes O blocks of C whitened scalars of the residual.

    Attributes
    ----------
    weights : (O, C, width, C) array
        Weights of the residual's rows in each block.
    start : (O,) integer array
        First row of the residual that enters each block.
    log_sigmas : (O, C) array
        Logarithm of each scalar's standard deviation given those before it; zero where there is none.
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
    log_sigmas: Floats
    samples: int
    outputs: NDArray[np.bool_]
    rows: Integers
    window: int

    @property
    def log_sigma(self) -> float:
        """Sum of the log standard deviations of all scalars before whitening."""
        return float(self.log_sigmas.sum())

    def without(self, left_out: NDArray[np.bool_]) -> Whitening:
        """Return the whitening without the scalars of a mask (O, C), whose samples lose their weight in the others too.

        The others are not whitened anew: what a sample that is left out told of its neighbours is lost with it.
        """
        width = self.weights.shape[2]
        gone = np.zeros((int(max(self.rows.max(), self.start.max() + width - 1)) + 1, left_out.shape[1]), dtype=bool)
        gone[self.rows] = left_out
        windows = gone[self.start[:, None] + np.arange(width)]
        weights = np.where(windows[:, None] | left_out[:, :, None, None], 0.0, self.weights)
        outputs = self.outputs & ~left_out
        log_sigmas = np.where(left_out, 0.0, self.log_sigmas)
        return self._replace(weights=weights, log_sigmas=log_sigmas, outputs=outputs, samples=int(outputs.sum()))


def apply(weights: Array, start: Array, residual: Array) -> Array:
    """Return the whitened residual (O, C) of a residual (T, C) that is padded with zeros for at least one window.

    Parameters
    ----------
    weights : (O, C, W, C) array
        Of each output, window and channel.
    start : (O,) array of int
        First row of each output's window.
    residual : (T, C) array
        Deviations of the readings, in their units.
    """
    width = weights.shape[2]
    if width == 1:
        return jnp.einsum("oij,oj->oi", weights[:, :, 0], residual[start])
    windows = jax.vmap(lambda row: jax.lax.dynamic_slice_in_dim(residual, row, width, 0))(start)
    return jnp.einsum("oiwj,owj->oi", weights, windows)


def build(noise: SampleNoise, window: int | None = None) -> Whitening:
    """Return the whitening of one recording, by default with the shortest window that is accurate.

    Parameters
    ----------
    noise : SampleNoise
    window : int, optional
        Number of earlier blocks on which each sample is conditioned.
    """
    outputs = _outputs(noise)
    with threadpool_limits(limits=1):  # threads only slow down thousands of small factorisations
        return _shortest(noise, outputs) if window is None else _whiten(noise, outputs, window)


def _shortest(noise: SampleNoise, outputs: list[tuple[int, list[_Output]]]) -> Whitening:
    available = max(WINDOWS) if _is_coloured(noise) else noise.lags
    best = _whiten(noise, outputs, 0)
    for window in WINDOWS[1:]:
        if window > available:
            break
        longer = _whiten(noise, outputs, window)
        alike = abs(best.log_sigma - longer.log_sigma) < TOLERANCE * max(longer.samples, 1)
        before, after = _of_constants(best), _of_constants(longer)
        if alike and (np.abs(after - before) <= SLOW * before).all():
            break
        best = longer
    return best


def _of_constants(whitening: Whitening) -> Floats:
    """Return the information on a constant of each channel, (C,)."""
    return np.asarray((whitening.weights.sum(axis=2) ** 2).sum(axis=(0, 1)))


class _Output(NamedTuple):
    """One filtered scalar of a channel: the residual rows that enter it, and their weights."""

    channel: int
    rows: Integers
    taps: Floats


def _outputs(noise: SampleNoise) -> list[tuple[int, list[_Output]]]:
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
            f"the low-pass filter needs {len(taps)} evenly spaced samples, but no section of the recording has them",
            remedy="Raise low_pass or omit it",
        )
    return result


def _whiten(noise: SampleNoise, blocks: list[tuple[int, list[_Output]]], window: int) -> Whitening:
    channels = len(noise.channels)
    spans = [(min(o.rows[0] for o in group), max(o.rows[-1] for o in group)) for _, group in blocks]
    first = np.minimum.accumulate(np.array([span[0] for span in spans])[::-1])[::-1]
    starts = [int(first[max(0, number - window)]) for number in range(len(blocks))]
    width = max(spans[number][1] - starts[number] + 1 for number in range(len(blocks)))
    weights = np.zeros((len(blocks), channels, width, channels))
    present = np.zeros((len(blocks), channels), dtype=bool)
    covariance = _Covariance(noise, width - 1)
    log_sigmas = np.zeros(present.shape)
    for local, numbers in _alike(blocks, starts, window, channels):
        group = blocks[numbers[0]][1]
        rows = 1 + int(local.columns.max()) // channels
        slots = [output.channel for output in group]
        count = max(1, LARGEST // (rows * channels) ** 2)
        for part in (numbers[k : k + count] for k in range(0, len(numbers), count)):
            raw = covariance.between(np.array([starts[number] for number in part]), rows)
            whitened, logs = _given_earlier(raw, local, len(group))
            places = np.ix_(part, slots, range(rows))
            weights[places] = whitened.reshape(len(part), len(group), rows, channels)
            present[np.ix_(part, slots)] = True
            log_sigmas[np.ix_(part, slots)] = logs
    return Whitening(
        weights,
        np.array(starts, dtype=np.int32),
        log_sigmas,
        int(present.sum()),
        present,
        np.array([row for row, _ in blocks]),
        window,
    )


class _Local(NamedTuple):
    """Scalars of a window.

    Attributes
    ----------
    columns, taps : (n,) array
        Columns of the window's flattened residual that enter the scalars, one scalar after the other, and weights.
    scalar : (n,) integer array
        Scalar that each of them enters.
    """

    columns: Integers
    taps: Floats
    scalar: Integers

    @classmethod
    def of(cls, outputs: Sequence[_Output], channels: int) -> _Local:
        """Return scalars with the columns of the whole recording's residual."""
        columns = np.concatenate([output.rows * channels + output.channel for output in outputs])
        taps = np.concatenate([output.taps for output in outputs])
        return cls(columns, taps, np.repeat(np.arange(len(outputs)), [len(output.rows) for output in outputs]))

    @classmethod
    def joined(cls, parts: Sequence[_Local], before: int) -> _Local:
        """Return the scalars of successive blocks, ``before`` columns taken from their columns."""
        if len(parts) == 1:
            return parts[0]._replace(columns=parts[0].columns - before)
        counts = np.cumsum([0, *(part.scalar[-1] + 1 for part in parts[:-1])])
        scalar = np.concatenate([part.scalar + count for part, count in zip(parts, counts, strict=True)])
        columns = np.concatenate([part.columns for part in parts]) - before
        return cls(columns, np.concatenate([part.taps for part in parts]), scalar)

    @property
    def key(self) -> bytes:
        """Content, to compare by."""
        return b"|".join(part.tobytes() for part in self)


def _alike(
    blocks: list[tuple[int, list[_Output]]], starts: Sequence[int], window: int, channels: int
) -> list[tuple[_Local, list[int]]]:
    """Return the windows that differ, each with the numbers of the blocks that have it."""
    single = [_Local.of(group, channels) for _, group in blocks]
    windows: dict[tuple[bytes, int], tuple[_Local, list[int]]] = {}
    for number, start in enumerate(starts):
        local = _Local.joined(single[max(0, number - window) : number + 1], start * channels)
        key = (local.key, len(blocks[number][1]))
        windows.setdefault(key, (local, []))[1].append(number)
    return list(windows.values())


def _given_earlier(raw: Floats, local: _Local, new: int) -> tuple[Floats, Floats]:
    """Return the weights (B, new, n) that whiten the last scalars of windows given the others, and their log sigmas.

    Parameters
    ----------
    raw : (B, n, n) array
        Covariance of each window's flattened residual.
    local : _Local
        All scalars of a window.
    new : int
        Number of scalars of the last block.
    """
    count = int(local.scalar[-1]) + 1
    combine = np.zeros((count, raw.shape[-1]))
    combine[local.scalar, local.columns] = local.taps
    if len(local.columns) == count and (local.taps == 1.0).all():
        among = raw[:, local.columns][:, :, local.columns]
    else:
        among = combine @ raw @ combine.T
    old = count - new
    gain = np.linalg.solve(among[:, :old, :old], among[:, :old, old:])
    left = among[:, old:, old:] - np.swapaxes(among[:, :old, old:], 1, 2) @ gain
    factor = np.linalg.cholesky(left)
    identity = np.broadcast_to(np.eye(new), left.shape)
    rows = np.linalg.solve(factor, np.concatenate([-np.swapaxes(gain, 1, 2), identity], axis=2))
    return rows @ combine, np.log(np.diagonal(factor, axis1=1, axis2=2))


def _is_coloured(noise: SampleNoise) -> bool:
    return any(channel.coloured[0] > 0.0 for channel in noise.channels)


class _Covariance:
    """Covariance of the residual between rows of the sample grid: sensors' noise and errors of the joint motion."""

    def __init__(self, noise: SampleNoise, lags: int) -> None:
        self._noise = noise
        self._lags = min(noise.lags, lags)
        count, self._channels = len(noise.time), len(noise.channels)
        self._blocks = np.zeros((self._lags + 1, count, self._channels, self._channels))
        for g, covariance in noise.errors:
            for lag in range(min(self._lags, covariance.shape[1] - 1, count - 1) + 1):
                self._blocks[lag, lag:] += np.einsum(
                    "jatc,jtab,jbtd->tcd",
                    g[:, :, lag:],
                    covariance[:, lag, lag:],
                    g[:, :, : count - lag],
                    optimize=True,
                )
        self._blocks[0, :, range(self._channels), range(self._channels)] += np.array(
            [channel.gridded(channel.sigma, count) ** 2 for channel in noise.channels]
        )
        self._coloured = [channel.coloured_moments(count) for channel in noise.channels]

    def between(self, starts: Integers, rows: int) -> Floats:
        """Return the dense covariances (B, n, n) of some rows from each of the starts on, row by row of C channels."""
        row = starts[:, None] + np.arange(rows)
        apart = np.arange(rows)[:, None] - np.arange(rows)[None, :]
        lag = np.abs(apart)
        block = self._blocks[np.minimum(lag, self._lags), np.maximum(row[:, :, None], row[:, None, :])]
        block[:, lag > self._lags] = 0.0
        block[:, apart < 0] = np.swapaxes(block[:, apart < 0], -1, -2)
        time = self._noise.time[row]
        for index, channel in enumerate(self._noise.channels):
            level, memory = channel.coloured
            if level > 0.0:
                between = np.abs(time[:, :, None] - time[:, None, :])
                log_gain, variance = (moment[row] for moment in self._coloured[index])
                gain = log_gain[:, :, None] + log_gain[:, None, :]
                correlation = np.where(apart == 0, variance[:, :, None], np.exp(gain - between / memory))
                block[..., index, index] += level**2 * correlation
        size = rows * self._channels
        return np.swapaxes(block, 2, 3).reshape(len(starts), size, size)
