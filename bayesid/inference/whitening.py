"""Whitening of the residual as one banded operator, for sensor noise, encoder noise through the dynamics, and filters.

The error of a sample is the noise of its sensor plus the effect of the errors of the smoothed joint motion, which is
correlated over a few samples. Each block of scalars is whitened given a window of blocks before it (Vecchia 1988); the
result tends to the exact Gaussian as the window grows and is positive definite for any window.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
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

__all__ = ["MotionErrors", "NoiseChannel", "SampleNoise", "Whitening", "Window", "apply", "build"]


WINDOWS = (0, 2, 4, 8, 16, 32)
"""Numbers of earlier blocks to condition on, of which the first that is accurate to `TOLERANCE` is taken."""

TOLERANCE = 2e-4
"""Change of log standard deviation per scalar below which a longer window does not justify its cost."""

SLOW = 0.01
"""Relative change of the information on a constant of any channel below which the same holds.

What is learnt of bodies changes slowly, and sees the noise's density at low frequency, to which many lags add.
"""

NO_COLOUR = (0.0, 1.0)
"""Standard deviation and correlation time of coloured noise where there is none."""

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
    coloured: tuple[float, float] = NO_COLOUR
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


class Window(NamedTuple):
    """Numbers of earlier blocks on which each block is conditioned.

    Attributes
    ----------
    every : int
        Those of which every channel counts.
    coloured : int
        Those of which the channels with coloured noise count; their memory is longer than that of the joint motion.
    """

    every: int
    coloured: int = 0

    @property
    def longest(self) -> int:
        """The larger of the two."""
        return max(self)


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
    window : Window
        Earlier blocks on which each block is conditioned.
    """

    weights: Floats
    start: Integers
    log_sigmas: Floats
    samples: int
    outputs: NDArray[np.bool_]
    rows: Integers
    window: Window

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


def build(noise: SampleNoise, window: Window | None = None) -> Whitening:
    """Return the whitening of one recording, by default with the shortest window that is accurate.

    Parameters
    ----------
    noise : SampleNoise
    window : Window, optional
        Earlier blocks on which each block is conditioned.
    """
    outputs = _outputs(noise)
    with threadpool_limits(limits=1):  # threads only slow down thousands of small factorisations
        return _shortest(noise, outputs) if window is None else _whiten(noise, outputs, window)


def _shortest(noise: SampleNoise, outputs: list[tuple[int, list[_Output]]]) -> Whitening:
    white = replace(noise, channels=[channel._replace(coloured=NO_COLOUR) for channel in noise.channels])
    windows = [Window(every) for every in WINDOWS if every <= noise.lags]
    best = _first_accurate(white, outputs, windows)
    if not any(_is_coloured(channel) for channel in noise.channels):
        return best
    every = best.window.every
    return _first_accurate(noise, outputs, [Window(every, coloured) for coloured in WINDOWS if coloured >= every])


def _first_accurate(
    noise: SampleNoise, outputs: list[tuple[int, list[_Output]]], windows: Sequence[Window]
) -> Whitening:
    """Return the whitening with the first of some windows that the next one hardly improves."""
    best = _whiten(noise, outputs, windows[0])
    for window in windows[1:]:
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


def _whiten(noise: SampleNoise, blocks: list[tuple[int, list[_Output]]], window: Window) -> Whitening:
    channels = len(noise.channels)
    spans = [(min(o.rows[0] for o in group), max(o.rows[-1] for o in group)) for _, group in blocks]
    first = np.minimum.accumulate(np.array([span[0] for span in spans])[::-1])[::-1]
    starts = [int(first[max(0, number - window.longest)]) for number in range(len(blocks))]
    width = max(spans[number][1] - starts[number] + 1 for number in range(len(blocks)))
    weights = np.zeros((len(blocks), channels, width, channels))
    present = np.zeros((len(blocks), channels), dtype=bool)
    covariance = _Covariance(noise, width - 1)
    log_sigmas = np.zeros(present.shape)
    for local, numbers in _alike(noise, blocks, starts, window):
        slots = [output.channel for output in blocks[numbers[0]][1]]
        combine, columns = local.combination
        rows, channel = np.divmod(columns, channels)
        count = max(1, LARGEST // len(columns) ** 2)
        for part in (numbers[k : k + count] for k in range(0, len(numbers), count)):
            raw = covariance.among(np.array([starts[number] for number in part]), rows, channel)
            whitened, logs = _given_earlier(raw, combine, len(slots))
            weights[np.array(part)[:, None, None], np.array(slots)[:, None], rows, channel] = whitened
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
    def combination(self) -> tuple[Floats, Integers]:
        """Return the weights (n, m) by which the scalars combine m columns, and these columns."""
        columns, place = np.unique(self.columns, return_inverse=True)
        combine = np.zeros((int(self.scalar[-1]) + 1, len(columns)))
        combine[self.scalar, place] = self.taps
        return combine, columns

    @property
    def key(self) -> bytes:
        """Content, to compare by."""
        return b"|".join(part.tobytes() for part in self)


def _alike(
    noise: SampleNoise, blocks: list[tuple[int, list[_Output]]], starts: Sequence[int], window: Window
) -> list[tuple[_Local, list[int]]]:
    """Return the windows that differ, each with the numbers of the blocks that have it."""
    channels = len(noise.channels)
    single = [_Local.of(group, channels) for _, group in blocks]
    far: list[_Local | None] = []
    if window.coloured > window.every:
        slow = [[o for o in group if _is_coloured(noise.channels[o.channel])] for _, group in blocks]
        far = [_Local.of(group, channels) if group else None for group in slow]
    windows: dict[tuple[bytes, int], tuple[_Local, list[int]]] = {}
    for number, start in enumerate(starts):
        near = max(0, number - window.every)
        before = [part for part in far[max(0, number - window.coloured) : near] if part is not None]
        local = _Local.joined([*before, *single[near : number + 1]], start * channels)
        key = (local.key, len(blocks[number][1]))
        windows.setdefault(key, (local, []))[1].append(number)
    return list(windows.values())


def _given_earlier(raw: Floats, combine: Floats, new: int) -> tuple[Floats, Floats]:
    """Return the weights (B, new, m) that whiten the last scalars of windows given the others, and their log sigmas.

    Parameters
    ----------
    raw : (B, m, m) array
        Covariance of what enters each window.
    combine : (n, m) array
        Weights by which it makes all scalars of a window.
    new : int
        Number of scalars of the last block.
    """
    among = raw if np.array_equal(combine, np.eye(len(combine))) else combine @ raw @ combine.T
    old = len(combine) - new
    gain = np.linalg.solve(among[:, :old, :old], among[:, :old, old:])
    left = among[:, old:, old:] - np.swapaxes(among[:, :old, old:], 1, 2) @ gain
    factor = np.linalg.cholesky(left)
    identity = np.broadcast_to(np.eye(new), left.shape)
    rows = np.linalg.solve(factor, np.concatenate([-np.swapaxes(gain, 1, 2), identity], axis=2))
    return rows @ combine, np.log(np.diagonal(factor, axis1=1, axis2=2))


def _is_coloured(channel: NoiseChannel) -> bool:
    return channel.coloured[0] > 0.0


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

    def among(self, starts: Integers, rows: Integers, channels: Integers) -> Floats:
        """Return the covariances (B, m, m) of m readings, whose rows count from each of the starts on."""
        earlier = rows[:, None] < rows[None, :]
        channel = np.meshgrid(channels, channels, indexing="ij")
        later, other = np.where(earlier, channel[::-1], channel)
        lag = np.abs(rows[:, None] - rows[None, :])
        last = starts[:, None, None] + np.maximum(rows[:, None], rows[None, :])
        covariance = self._blocks[np.minimum(lag, self._lags), last, later, other]
        covariance[:, lag > self._lags] = 0.0
        for index, channel_noise in enumerate(self._noise.channels):
            level, memory = channel_noise.coloured
            if level > 0.0:
                of_it = np.flatnonzero(channels == index)
                row = starts[:, None] + rows[of_it]
                time = self._noise.time[row]
                between = np.abs(time[:, :, None] - time[:, None, :])
                log_gain, variance = (moment[row] for moment in self._coloured[index])
                gain = log_gain[:, :, None] + log_gain[:, None, :]
                same = np.eye(len(of_it), dtype=bool)
                correlation = np.where(same, variance[:, :, None], np.exp(gain - between / memory))
                covariance[np.ix_(np.arange(len(starts)), of_it, of_it)] += level**2 * correlation
        return covariance
