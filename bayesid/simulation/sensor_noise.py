"""Noise of sensors: per sample, from data sheets, coloured, quantised; and filters.

Every class is a plain value; nothing here depends on what a sensor measures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats

__all__ = [
    "ARCSEC",
    "AngleRandomWalk",
    "Coloured",
    "Filter",
    "Noise",
    "NoiseDensity",
    "Quantised",
    "Scaled",
    "StarTracker",
    "White",
]


ARCSEC = np.pi / 180.0 / 3600.0
"""One second of arc [rad]."""


class Noise(Protocol):
    """White noise of a sensor."""

    def sigma(self, interval: float) -> Floats:
        """Return the standard deviation per axis, (3,), of samples taken every ``interval`` seconds."""
        ...


@dataclass(frozen=True)
class White:
    """Noise given per sample."""

    value: float | tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return the given value, whatever the interval."""
        return np.broadcast_to(np.asarray(self.value, dtype=float), (3,)).copy()


@dataclass(frozen=True)
class AngleRandomWalk:
    """Gyro noise from a data sheet [rad/sqrt(s)]: the angle's error grows as the square root of time."""

    value: float | tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return the rate's noise: walk / sqrt(interval)."""
        return White(self.value).sigma(interval) / np.sqrt(interval)


@dataclass(frozen=True)
class NoiseDensity:
    """One-sided white spectral density from a data sheet, in units per sqrt(Hz)."""

    value: float | tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return density * sqrt(Nyquist frequency)."""
        return White(self.value).sigma(interval) * np.sqrt(0.5 / interval)


@dataclass(frozen=True)
class StarTracker:
    """Rate from differencing a star sensor's attitude, whose samples have the given error in seconds of arc."""

    arcsec: float | tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return sqrt(2) * error / interval."""
        return np.sqrt(2.0) * White(self.arcsec).sigma(interval) * ARCSEC / interval


@dataclass(frozen=True)
class Scaled:
    """Another noise, times a factor per axis: an understated data sheet."""

    noise: Noise
    factor: tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return the scaled noise."""
        return self.noise.sigma(interval) * np.asarray(self.factor)


@dataclass(frozen=True)
class Quantised:
    """Another noise, rounded to multiples of a step per axis: rounding adds a twelfth of the step's square."""

    noise: Noise
    step: tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return the noise with that of rounding."""
        return np.hypot(self.noise.sigma(interval), np.asarray(self.step) / np.sqrt(12.0))


@dataclass(frozen=True)
class Coloured:
    """Exponentially correlated noise (Ornstein-Uhlenbeck) beside the white one.

    Parameters
    ----------
    sigma : (3,)
        Standard deviation per axis, in the sensor's unit.
    time : float
        Correlation time [s].
    """

    sigma: tuple[float, float, float]
    time: float


@dataclass(frozen=True)
class Filter:
    """Zero-phase low-pass and decimation, applied alike to measurement and prediction.

    Parameters
    ----------
    low_pass : float, optional
        Cut-off (half amplitude) [Hz].
    decimate : int
        Keep every n-th sample.
    """

    low_pass: float | None = None
    decimate: int = 1

    def taps(self, interval: float) -> Floats:
        """Return the symmetric kernel, of odd length, for samples every ``interval`` seconds."""
        if self.low_pass is None:
            return np.ones(1)
        cut = self.low_pass * interval
        if not 0.0 < cut < 0.5:
            raise InputError(
                f"low_pass {self.low_pass:g} Hz is not below half the sampling rate, {0.5 / interval:g} Hz",
                remedy="Choose a lower cut-off or leave it out",
            )
        half = int(np.ceil(1.65 / cut))  # a Hamming window's transition band is then as wide as the pass band
        n = np.arange(-half, half + 1)
        kernel = np.sinc(2.0 * cut * n) * np.hamming(2 * half + 1)
        return kernel / kernel.sum()
