"""The whitened residual by recording, sensor and axis: one view of the flat vector of all samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesid._math.arrays import Floats
from bayesid.inference.posterior import Posterior
from bayesid.simulation.sensors import SensorKind

__all__ = ["ResidualSpectrum", "ResidualView", "by_recording", "rows_of"]

FEWEST = 8
"""Samples of one channel below which a recording has no part in the spectrum."""

BINS = 40
"""Largest number of bins of a spectrum."""

PER_BIN = 5
"""Number of periodogram ordinates that a bin holds on average, unless the number of bins is at its limit."""


class ResidualSpectrum(NamedTuple):
    """Mean power of one channel by frequency; independent residuals of unit variance have power one.

    Attributes
    ----------
    frequency : (n,) array
        Centres of the bins that hold ordinates [Hz].
    power : (n,) array
        Mean of the ordinates in each bin.
    ordinates : (n,) array
        Number of ordinates in each bin. Times the mean power it follows a gamma distribution of that shape if the
        residuals are independent and of unit variance.
    """

    frequency: Floats
    power: Floats
    ordinates: Floats


def rows_of(posterior: Posterior, recording: int) -> slice:
    """Return the rows of one recording in the flat residual of a posterior.

    Parameters
    ----------
    posterior : Posterior
    recording : int
        Number of the recording.
    """
    _, outputs, channels = posterior.residual_shape
    return slice(recording * outputs * channels, (recording + 1) * outputs * channels)


def by_recording(posterior: Posterior, values: Floats) -> Floats:
    """Return what has a row for each element of the flat residual, (N, ...), by recording, (R, N / R, ...).

    Parameters
    ----------
    posterior : Posterior
    values : (N, ...) array
    """
    return values.reshape(posterior.residual_shape[0], -1, *values.shape[1:])


@dataclass(frozen=True)
class ResidualView:
    """Whitened residual, or another number for each of its samples, by recording, output and channel.

    The samples of a residual are independent and of unit variance if the model is right.

    Attributes
    ----------
    posterior : Posterior
        Posterior whose noise whitened the residual.
    values : (R, O, C) array
        Values of R recordings, O outputs and C channels.
    """

    posterior: Posterior
    values: Floats

    @classmethod
    def of(cls, posterior: Posterior, flat: Floats) -> ResidualView:
        """Return the view of a flat vector (N,).

        Parameters
        ----------
        posterior : Posterior
        flat : (N,) array
        """
        return cls(posterior, flat.reshape(posterior.residual_shape))

    @classmethod
    def at(cls, posterior: Posterior, z: Floats) -> ResidualView:
        """Return the residual of a posterior at the coordinates ``z`` (n,), such as the mode.

        Parameters
        ----------
        posterior : Posterior
        z : (size,) array
            Coordinates.
        """
        return cls.of(posterior, posterior.residuals(z))

    @property
    def kinds(self) -> tuple[SensorKind, ...]:
        """Kinds of the sensors, in the order of the channels."""
        return self.posterior.model.channels.kinds

    @property
    def recordings(self) -> int:
        """Number of recordings."""
        return self.posterior.residual_shape[0]

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """Whether there is a sample, shape (R, O, C)."""
        there = np.zeros(self.values.shape, dtype=bool)
        for recording, whitening in enumerate(self.posterior.whitenings):
            there[recording, : len(whitening.outputs)] = whitening.outputs
        return there

    def columns(self, kind: SensorKind) -> range:
        """Return the channels of one sensor."""
        channels = self.posterior.model.channels.of(kind)
        return range(channels.start, channels.stop)

    def samples(self, recording: int, channel: int) -> Floats:
        """Return the values of one channel in one recording where it has samples, shape (n,).

        Parameters
        ----------
        recording : int
            Number of the recording.
        channel : int
            Number of the channel.
        """
        return self.values[recording, self.mask[recording, :, channel], channel]

    def each(self, kind: SensorKind) -> list[Floats]:
        """Return the samples of every recording and axis of one sensor, one after the other."""
        return [self.samples(r, channel) for r in range(self.recordings) for channel in self.columns(kind)]

    def complete(self, kind: SensorKind, recording: int) -> tuple[Floats, Floats]:
        """Return times (n,) [s] and values (n, axes) of one sensor in one recording where all its axes have samples.

        Parameters
        ----------
        kind : SensorKind
        recording : int
            Number of the recording.
        """
        channels, whitening = self.posterior.model.channels.of(kind), self.posterior.whitenings[recording]
        rows = np.flatnonzero(self.mask[recording, :, channels].all(axis=1))
        return self.posterior.data.times(recording)[whitening.rows[rows]], self.values[recording, rows, channels]

    def series(self, recording: int, kind: SensorKind, axis: int) -> tuple[Floats, Floats]:
        """Return the times [s] and residuals of one sensor axis in one recording, where it has samples.

        Parameters
        ----------
        recording : int
            Number of the recording.
        kind : SensorKind
        axis : int
            Number of the axis.
        """
        whitening, channel = self.posterior.whitenings[recording], self.columns(kind)[axis]
        time = self.posterior.data.times(recording)[whitening.rows[whitening.outputs[:, channel]]]
        return time, self.samples(recording, channel)

    def pooled(self, kind: SensorKind) -> Floats:
        """Return the residuals of all axes of one sensor in all recordings, shape (n,)."""
        return np.concatenate(self.each(kind))

    def spectrum(self, kind: SensorKind, axis: int) -> ResidualSpectrum:
        """Return the spectrum of one sensor axis, all recordings pooled, in bins of equal width.

        Parameters
        ----------
        kind : SensorKind
        axis : int
            Number of the axis.
        """
        parts = [_periodogram(*self.series(recording, kind, axis)) for recording in range(self.recordings)]
        frequency, power = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        if len(frequency) == 0:
            return ResidualSpectrum(frequency, power, np.zeros(0))
        bins = max(4, min(BINS, len(frequency) // PER_BIN))
        edges = np.linspace(0.0, frequency.max() * (1.0 + 1e-9), bins + 1)
        number = np.histogram(frequency, edges)[0]
        total = np.histogram(frequency, edges, weights=power)[0]
        full = number > 0
        centre = 0.5 * (edges[1:] + edges[:-1])
        return ResidualSpectrum(centre[full], total[full] / number[full], number[full].astype(float))


def _periodogram(time: Floats, value: Floats) -> tuple[Floats, Floats]:
    """Return the frequencies between zero and Nyquist [Hz] and the power there, one on average for unit white noise."""
    count = len(value)
    if count < FEWEST:
        return np.zeros(0), np.zeros(0)
    power = np.abs(np.fft.rfft(value)) ** 2 / count
    frequency = np.fft.rfftfreq(count, float(np.median(np.diff(time))))
    inside = slice(1, (count + 1) // 2)
    return np.asarray(frequency[inside], dtype=float), np.asarray(power[inside], dtype=float)
