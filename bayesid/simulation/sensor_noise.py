"""Noise of sensors, given per sample or by data sheets, coloured or quantised, and filters of their samples.

Every class is a plain value that does not depend on the quantity that a sensor measures.
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
    """White noise of a sensor, as a function of its sample interval."""

    def sigma(self, interval: float) -> Floats:
        """Return the standard deviation per axis of samples that are ``interval`` seconds apart, shape (3,)."""
        ...


@dataclass(frozen=True)
class White:
    """Noise whose standard deviation is given per sample."""

    value: float | tuple[float, ...]

    def sigma(self, interval: float) -> Floats:
        """Return the given values, which do not depend on the interval; one number stands for three axes."""
        value = np.asarray(self.value, dtype=float)
        return value.copy() if value.ndim else np.full(3, value)


@dataclass(frozen=True)
class AngleRandomWalk:
    """Angle random walk of a gyro from a data sheet [rad/sqrt(s)], the angle's error per square root of time."""

    value: float | tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return the standard deviation of the rate, walk / sqrt(interval)."""
        return White(self.value).sigma(interval) / np.sqrt(interval)


@dataclass(frozen=True)
class NoiseDensity:
    """One-sided white spectral density from a data sheet, in units per sqrt(Hz)."""

    value: float | tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return the standard deviation, density * sqrt(Nyquist frequency)."""
        return White(self.value).sigma(interval) * np.sqrt(0.5 / interval)


@dataclass(frozen=True)
class StarTracker:
    """Noise of a rate differenced from the attitude of a star tracker with a given error per sample [arcsec]."""

    arcsec: float | tuple[float, float, float]

    def sigma(self, interval: float) -> Floats:
        """Return the standard deviation of the rate, sqrt(2) * error / interval."""
        return np.sqrt(2.0) * White(self.arcsec).sigma(interval) * ARCSEC / interval


@dataclass(frozen=True)
class Scaled:
    """A given noise model, scaled by a factor per axis, for a data sheet that understates the noise."""

    noise: Noise
    factor: tuple[float, ...]

    def sigma(self, interval: float) -> Floats:
        """Return the scaled standard deviation."""
        return self.noise.sigma(interval) * np.asarray(self.factor)


@dataclass(frozen=True)
class Quantised:
    """Another noise with rounding to a step per axis, which adds a twelfth of the squared step to the variance."""

    noise: Noise
    step: tuple[float, ...]

    def sigma(self, interval: float) -> Floats:
        """Return the standard deviation of noise and rounding."""
        return np.hypot(self.noise.sigma(interval), np.asarray(self.step) / np.sqrt(12.0))


@dataclass(frozen=True)
class Coloured:
    """Exponentially correlated noise (Ornstein-Uhlenbeck) in addition to the white noise.

    Parameters
    ----------
    sigma : (size,) tuple of float
        Standard deviation per axis, in the unit of the sensor.
    time : float
        Correlation time [s].
    """

    sigma: tuple[float, ...]
    time: float


@dataclass(frozen=True)
class Filter:
    """Zero-phase low-pass filter and decimation, which apply to measurement and prediction alike.

    Parameters
    ----------
    low_pass : float, optional
        Cut-off frequency, at half amplitude [Hz].
    decimate : int
        Decimation factor n: every n-th sample is used.
    """

    low_pass: float | None = None
    decimate: int = 1

    def taps(self, interval: float) -> Floats:
        """Return the symmetric kernel, of odd length, for samples that are ``interval`` seconds apart."""
        if self.low_pass is None:
            return np.ones(1)
        cut = self.low_pass * interval
        if not 0.0 < cut < 0.5:
            raise InputError(
                f"low_pass {self.low_pass:g} Hz is not below half the sampling rate, {0.5 / interval:g} Hz",
                remedy="Choose a lower cut-off or omit it",
            )
        half = int(np.ceil(1.65 / cut))  # the transition band of a Hamming window is then as wide as the pass band
        n = np.arange(-half, half + 1)
        kernel = np.sinc(2.0 * cut * n) * np.hamming(2 * half + 1)
        return kernel / kernel.sum()
