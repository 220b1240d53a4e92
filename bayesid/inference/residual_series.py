"""Whitened residuals by recording and sensor axis: over time, and by frequency."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.posterior import Posterior
from bayesid.simulation.sensors import SensorKind

__all__ = ["ResidualSpectrum", "Residuals"]

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


@dataclass(frozen=True)
class Residuals:
    """Whitened residuals, which are independent and of unit variance if the model is right.

    Attributes
    ----------
    posterior : Posterior
        Posterior whose noise whitened the residuals.
    values : (R, O, C) array
        Residuals of R recordings, O outputs and C channels.
    """

    posterior: Posterior
    values: Floats

    @classmethod
    def at(cls, posterior: Posterior, z: Floats) -> Residuals:
        """Return the residuals of a posterior at the coordinates ``z`` (n,), such as the mode."""
        return cls(posterior, posterior.residuals(z).reshape(posterior.residual_shape))

    @property
    def kinds(self) -> tuple[SensorKind, ...]:
        """Kinds of the sensors, in the order of the channels."""
        return self.posterior.model.channels.kinds

    @property
    def recordings(self) -> int:
        """Number of recordings."""
        return len(self.posterior.manoeuvres)

    def series(self, recording: int, kind: SensorKind, axis: int) -> tuple[Floats, Floats]:
        """Return the times [s] and residuals of one sensor axis in one recording, where it has samples."""
        item, channel = self.posterior.whitenings[recording], self.posterior.model.channels.of(kind).start + axis
        present = np.flatnonzero(item.outputs[:, channel])
        time = self.posterior.data.times(recording)[item.rows[present]]
        return time, self.values[recording, present, channel]

    def pooled(self, kind: SensorKind) -> Floats:
        """Return the residuals of all axes of one sensor in all recordings, shape (n,)."""
        return np.concatenate(
            [self.series(recording, kind, axis)[1] for recording in range(self.recordings) for axis in range(kind.size)]
        )

    def spectrum(self, kind: SensorKind, axis: int) -> ResidualSpectrum:
        """Return the spectrum of one sensor axis, all recordings pooled, in bins of equal width."""
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
