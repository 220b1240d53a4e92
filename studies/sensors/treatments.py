"""Treatments of a noisy signal whose two derivatives are needed: joint positions, or rates.

A treatment is called with the times (T,), the samples (T, n) and the standard deviation of their noise, and returns the
values and two derivatives (3, T, n). Only `Wiener` uses the noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.polynomial import chebyshev
from scipy import signal
from scipy.interpolate import make_smoothing_spline

from bayesid._math.arrays import Floats
from bayesid.recording.jumps import smooth_joints
from bayesid.recording.smoothing import JointSamples

__all__ = ["Differences", "LowPass", "Polynomial", "SavitzkyGolay", "SmoothingSpline", "Treatment", "Wiener"]


class Treatment(Protocol):
    """Interface of all treatments."""

    @property
    def title(self) -> str:
        """Name of the treatment in the report."""
        ...

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        ...


@dataclass(frozen=True)
class Differences:
    """Central differences of the samples as they are, one-sided at the ends."""

    title: str = "differences"

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        step = time[1] - time[0]
        second = np.empty_like(values)
        second[1:-1] = (values[2:] - 2.0 * values[1:-1] + values[:-2]) / step**2
        second[0], second[-1] = second[1], second[-2]
        return np.stack([values, np.gradient(values, step, axis=0), second])


@dataclass(frozen=True)
class LowPass:
    """Butterworth filter run forth and back, then differences.

    Parameters
    ----------
    cut : float
        Cut-off frequency of one pass [Hz].
    order : int
        Order of one pass.
    """

    cut: float = 0.2
    order: int = 4
    title: str = "low-pass"

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        sections = signal.butter(self.order, self.cut, fs=1.0 / (time[1] - time[0]), output="sos")
        return Differences()(time, signal.sosfiltfilt(sections, values, axis=0), sigma)


@dataclass(frozen=True)
class SavitzkyGolay:
    """Polynomials fitted in a moving window.

    Parameters
    ----------
    window : int
        Number of samples in the window, which is odd.
    degree : int
        Degree of the polynomials.
    """

    window: int = 21
    degree: int = 5
    title: str = "Savitzky-Golay"

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        step = time[1] - time[0]
        return np.stack(
            [signal.savgol_filter(values, self.window, self.degree, deriv, step, axis=0) for deriv in range(3)]
        )


@dataclass(frozen=True)
class Polynomial:
    """One polynomial over each piece of the recording, of the degree with the least Bayesian information criterion.

    Parameters
    ----------
    breaks : tuple of float
        Times at which pieces meet [s]; nothing is made continuous there.

    Notes
    -----
    Degrees go up to twice the square root of the number of a piece's samples; higher ones oscillate at the ends.
    """

    breaks: tuple[float, ...] = ()

    @property
    def title(self) -> str:
        """Name of the treatment in the report."""
        return "piecewise polynomials" if self.breaks else "polynomial"

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        pieces = np.split(np.arange(len(time)), np.searchsorted(time, self.breaks))
        return np.concatenate([_polynomial(time[piece], values[piece]) for piece in pieces], axis=1)


def _polynomial(time: Floats, values: Floats) -> Floats:
    half, count = 0.5 * (time[-1] - time[0]), len(time)
    x, degrees = (time - time[0]) / half - 1.0, np.arange(int(2.0 * np.sqrt(count)) + 1)
    basis, factor = np.linalg.qr(chebyshev.chebvander(x, int(degrees[-1])))
    share = basis.T @ values
    left = (values**2).sum(axis=0) - np.cumsum(share**2, axis=0)
    floor = 1e-24 * (values**2).sum(axis=0) + 1e-300  # where a polynomial is exact, only rounding remains
    criterion = count * np.log(np.maximum(left, floor) / count) + (degrees + 1)[:, None] * np.log(count)
    share[degrees[:, None] > criterion.argmin(axis=0)] = 0.0
    series = np.linalg.solve(factor, share)
    return np.stack([chebyshev.chebval(x, chebyshev.chebder(series, order)).T / half**order for order in range(3)])


@dataclass(frozen=True)
class SmoothingSpline:
    """Cubic smoothing spline, its strength by generalised cross-validation (SciPy's ``make_smoothing_spline``)."""

    title: str = "smoothing spline (GCV)"

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        splines = [make_smoothing_spline(time, column) for column in values.T]
        return np.stack([np.stack([spline.derivative(k)(time) for spline in splines], axis=1) for k in range(3)])


@dataclass(frozen=True)
class Wiener:
    """Smoother of the package, an integrated Wiener process given the noise (`bayesid.recording.smoothing`)."""

    title: str = "Wiener process"

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        fits = smooth_joints([[JointSamples(0, time, column, sigma)] for column in values.T])
        return np.stack([fit.evaluate(time) for fit in fits], axis=-1)
