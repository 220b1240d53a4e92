"""The paper's manoeuvre flown by an independent simulator, its sensors' noise, and treatments of noisy signals.

A treatment is called with the times (T,), the samples (T, n) and the standard deviation of their noise, and returns the
values and two derivatives (3, T, n). Only `Wiener` uses the noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Protocol

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy import signal
from scipy.interpolate import make_smoothing_spline

from bayesid import MeasuredMotion, Model, Recording, SensorKind
from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Excitation
from bayesid.recording.jumps import smooth_joints
from bayesid.recording.smoothing import JointSamples
from bayesid.simulation.sensors import StarTracker
from studies.base_body import paper
from studies.common import flight
from studies.common.ets7 import BIAS, INTERVAL, ets7, excitation
from studies.common.models import base_model
from studies.truth.recordings import by_axis

# distance from a junction of (27) within which samples of the base's sensors may be left out [s]. The third derivative
# of the joints' positions jumps at a junction.
NEAR = 2.0

FINE = 0.1  # step of the independent simulator, and of the differences that give the change of the rate [s]


@dataclass(frozen=True)
class Noise:
    """Standard deviations of white noise per sample."""

    rate: float  # noise of the base's rates [rad/s]
    accel: float  # noise of the accelerometer [m/s2]
    position: float  # noise of the joints' encoders [rad]


@dataclass(frozen=True)
class Flight:
    """True motion at the samples."""

    time: Floats  # (T,): sample times [s]
    position: Floats  # (T, 6): joint positions [rad]
    # (T, 3): rate of the base [rad/s] and acceleration at the accelerometer [m/s2], in base axes
    rate: Floats
    accel: Floats
    rate_change: Floats  # (T, 3): derivative of the rate [rad/s2]


def motion() -> Excitation:
    """Return the paper's manoeuvre, with the frequency assumed in `studies.base_body`."""
    return excitation(paper.EXCITATION)


@cache
def fly(*, gradient: bool = True) -> Flight:
    """Fly the manoeuvre from rest, in orbit or far from any mass."""
    planned = motion()
    fine = FINE * np.arange(round(planned.duration / FINE) + 1)
    run = flight.fly(ets7(), planned, fine, step=FINE, orbit=flight.ORBIT if gradient else None)
    every = round(INTERVAL / FINE)
    change = np.gradient(run.rate, FINE, axis=0, edge_order=2)
    columns = (fine, run.position, run.rate, run.accel, change)
    return Flight(*(np.array(column[::every]) for column in columns))


def model_of(noise: Noise, *, biased: bool) -> Model:
    """Return the model: base and initial rate unknown, and where ``biased`` the accelerometer's constant error."""
    return base_model({SensorKind.RATE: noise.rate, SensorKind.ACCEL: noise.accel}, bias=BIAS if biased else 0.0)


def levels(flown: Flight) -> dict[str, Noise]:
    """Return the levels of noise by name.

    The paper's sigmas are read as `studies.base_body.paper.SIGMAS` says; beside it, the first as a share of the peak.
    """
    rate, accel = (float(np.abs(values).max()) for values in (flown.rate, flown.accel))
    noises = {}
    for sigma in paper.SIGMAS:
        degrees = float(np.radians(sigma))
        noises[f"{sigma:g} deg/s"] = Noise(degrees, degrees * accel / rate, degrees)
    noises["4 % of peak"] = Noise(0.04 * rate, 0.04 * accel, 1e-5)
    star = float(StarTracker(2.0).sigma(INTERVAL)[0])
    for grade, encoder in ((1e-5, 1e-4), (1e-5, 1e-5), (1e-5, 1e-6), (1e-7, 1e-6), (1e-9, 1e-6)):
        noises[f"2″, {grade:.0e}, {encoder:.0e}".replace("e-0", "e-")] = Noise(star, grade, encoder)
    return noises


def junctions() -> tuple[float, float]:
    """Return the times at which the oscillation of (27) meets its connecting splines [s]."""
    planned = motion()
    return planned.ramp, planned.duration - planned.ramp


def near_junctions(time: Floats) -> NDArray[np.bool_]:
    """Return which samples lie near a junction of (27), shape (T,)."""
    near: NDArray[np.bool_] = (np.abs(time[:, None] - np.array(junctions())) <= NEAR).any(axis=1)
    return near


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
    """Butterworth filter run forth and back, then differences."""

    cut: float = 0.2  # cut-off frequency of one pass [Hz]
    order: int = 4  # order of one pass
    title: str = "low-pass"

    def __call__(self, time: Floats, values: Floats, sigma: float) -> Floats:
        """Return values and two derivatives, shape (3, T, n)."""
        sections = signal.butter(self.order, self.cut, fs=1.0 / (time[1] - time[0]), output="sos")
        return Differences()(time, signal.sosfiltfilt(sections, values, axis=0), sigma)


@dataclass(frozen=True)
class SavitzkyGolay:
    """Polynomials fitted in a moving window."""

    window: int = 21  # number of samples in the window, which is odd
    degree: int = 5  # degree of the polynomials
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

    Notes
    -----
    Degrees go up to twice the square root of the number of a piece's samples; higher ones oscillate at the ends.
    """

    breaks: tuple[float, ...] = ()  # times at which pieces meet [s]; nothing is made continuous there

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


FAMILIES = ("rate", "accel", "position")
# noisy signals, which `Flight` and `Noise` name alike


def recording_of(time: Floats, rate: Floats, accel: Floats, position: Floats | None = None) -> Recording:
    """Return a recording of the base's sensors, and of the joints where given."""
    channels = by_axis("rate", "xyz", rate) | by_axis("accel", "xyz", accel)
    if position is not None:
        channels |= by_axis("position", [f"joint{k + 1}" for k in range(position.shape[1])], position)
    return Recording("manoeuvre", None, time, channels)


@dataclass(frozen=True)
class Draws:
    """N sets of noise about one flight."""

    flight: Flight  # true motion
    # noise of unit standard deviation by family of signals. All levels of noise share it, so that they differ by the
    # level alone.
    unit: Mapping[str, Floats]
    # signals that have been treated, by treatment, family and noise
    kept: dict[tuple[str, str, float], Floats] = field(default_factory=dict)

    @classmethod
    def of(cls, flight: Flight, count: int, rng: np.random.Generator) -> Draws:
        """Draw ``count`` sets of noise."""
        unit = {
            family: child.standard_normal((count, *getattr(flight, family).shape))
            for family, child in zip(FAMILIES, rng.spawn(len(FAMILIES)), strict=True)
        }
        return cls(flight, unit)

    def over(self, flight: Flight) -> Draws:
        """Return the same noise about another flight with the same joint motion."""
        return replace(
            self, flight=flight, kept={key: value for key, value in self.kept.items() if key[1] == "position"}
        )

    def raw(self, family: str, noise: Noise) -> Floats:
        """Return the errors of one family of signals, shape (N, T, n)."""
        errors: Floats = getattr(noise, family) * self.unit[family]
        return errors

    def treated(self, treatment: Treatment, family: str, noise: Noise) -> Floats:
        """Return the errors of treated values, and their two derivatives as treated, shape (N, 3, T, n)."""
        sigma: float = getattr(noise, family)
        key = treatment.title, family, sigma
        if key not in self.kept:
            truth = getattr(self.flight, family)
            samples = truth + self.raw(family, noise)
            treated = np.stack([treatment(self.flight.time, values, sigma) for values in samples])
            treated[:, 0] -= truth
            self.kept[key] = treated
        return self.kept[key]

    def joints(self, treatment: Treatment, noise: Noise) -> Floats:
        """Return the errors of joint positions, velocities and accelerations after a treatment, (N, 3, T, joints)."""
        errors = self.treated(treatment, "position", noise).copy()
        _, velocity, acceleration = motion().evaluate(self.flight.time)
        errors[:, 1] -= velocity
        errors[:, 2] -= acceleration
        return errors

    def exact_joints(self) -> Floats:
        """Return the errors of joints that are known exactly, (N, 3, T, joints)."""
        count, *shape = self.unit["position"].shape
        return np.zeros((count, 3, *shape))

    def recording(self, noise: Noise) -> Recording:
        """Return the first set of noise as a recording."""
        samples = (getattr(self.flight, family) + self.raw(family, noise)[0] for family in FAMILIES)
        return recording_of(self.flight.time, *samples)

    def measured_motion(self, noise: Noise) -> MeasuredMotion:
        """Return the joints of the first set of noise as the package smooths them."""
        return MeasuredMotion.from_recording(self.recording(noise), ets7(), sigma={0: noise.position})
