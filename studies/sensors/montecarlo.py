"""Monte Carlo of the treatments: repeated noise, one linear estimator after the other, bias and standard deviation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.base_body import paper
from studies.sensors.draws import Draws
from studies.sensors.linear import Estimator, Linear
from studies.sensors.setting import Noise, joints_meet, unread
from studies.sensors.treatments import (
    Differences,
    LowPass,
    Polynomial,
    SavitzkyGolay,
    SmoothingSpline,
    Treatment,
    Wiener,
)
from studies.sensors.weights import as_read, constant, integrated, integrated_whole

__all__ = ["EXACT", "OURS", "OURS_READ", "PAPER", "PIECES", "TREATMENTS", "Spread", "accelerometers", "joints", "rates"]
__all__ += ["ALIKE", "VELOCITY", "WEIGHTED", "WHOLE", "velocity_estimators"]

Floats = NDArray[np.floating]

PIECES = Polynomial(joints_meet())
"""Polynomials that know where (27) meets its splines."""

TREATMENTS: tuple[Treatment, ...] = (
    Differences(),
    LowPass(),
    SavitzkyGolay(),
    Polynomial(),
    PIECES,
    SmoothingSpline(),
    Wiener(),
)

EXACT, OURS, OURS_READ, PAPER = "exact", "ours, carried", "ours, jolts unread", "filtered, fitted, (21)"
"""Cases that are not a treatment alone: exact joints; the package's likelihood, which carries the joints' noise, and
the same without the samples near the jolts of (27); the paper's procedure: base signals filtered, joints fitted by
polynomials, accelerations integrated, (21) in SI units."""


WEIGHTED, ALIKE, VELOCITY = "acceleration, weighted", "velocity, SI alike: (21)", "velocity, weighted"
WHOLE = "velocity, whole covariance"
"""Uses of the accelerometer that the report compares."""


@dataclass(frozen=True)
class Spread:
    """What an estimator made of N sets of noise; all relative to the true quantities.

    Attributes
    ----------
    errors : (N, 10) array
        Of mass, centre of mass and inertia, in the order of `paper.TRUTH`.
    stated : (N, 10) array
        The standard deviations that the estimator itself gives.
    chi2 : (N,) array
        Per degree of freedom.
    """

    errors: Floats
    stated: Floats
    chi2: Floats

    @classmethod
    def of(cls, solved: tuple[Floats, Floats, Floats]) -> Spread:
        """Take what `Estimator.solve` returns."""
        truth = np.abs(paper.TRUTH)
        return cls(solved[0] / truth, solved[1] / truth, solved[2])

    @property
    def bias(self) -> Floats:
        """Mean error, shape (10,)."""
        return self.errors.mean(axis=0)

    @property
    def sd(self) -> Floats:
        """Standard deviation of the estimates, shape (10,)."""
        return self.errors.std(axis=0, ddof=1)

    @property
    def bias_error(self) -> Floats:
        """Monte-Carlo error of the bias, shape (10,)."""
        return self.sd / np.sqrt(len(self.errors))

    @property
    def sd_error(self) -> Floats:
        """Monte-Carlo error of the standard deviation of normal estimates, shape (10,)."""
        return self.sd / np.sqrt(2.0 * (len(self.errors) - 1))

    @property
    def rms(self) -> Floats:
        """Root mean square error, shape (10,)."""
        return np.sqrt((self.errors**2).mean(axis=0))

    @property
    def rms_error(self) -> Floats:
        """Monte-Carlo error of the root mean square error, shape (10,)."""
        squares = self.errors**2
        return squares.std(axis=0, ddof=1) / np.sqrt(len(squares)) / (2.0 * self.rms)

    @property
    def honesty(self) -> Floats:
        """Root mean square error over the root mean square of what was stated; one if honest, shape (10,)."""
        return self.rms / np.sqrt((self.stated**2).mean(axis=0))


def joints(linear: Linear, draws: Draws, noise: Noise) -> dict[str, Spread]:
    """Treat the joints in every way; rates and accelerations as read and weighted by their sensors' noise."""
    time = linear.time
    plain, rate, accel = Estimator(linear, as_read(time, noise)), draws.raw("rate", noise), draws.raw("accel", noise)
    found = {EXACT: Spread.of(plain.solve(linear.residual(rate, accel, draws.exact_joints())))}
    for treatment in TREATMENTS:
        residual = linear.residual(rate, accel, draws.joints(treatment, noise))
        found[treatment.title] = Spread.of(plain.solve(residual))
    measured = draws.measured_motion(noise)
    for name, left_out in ((OURS, None), (OURS_READ, unread(time))):
        found[name] = Spread.of(Estimator(linear, linear.whitening(noise, measured, left_out)).solve(residual))
    return found


def rates(linear: Linear, draws: Draws, noise: Noise) -> dict[str, Spread]:
    """Treat the rates in every way; joints smoothed by the package, accelerations as read."""
    plain = Estimator(linear, as_read(linear.time, noise))
    moved, accel = draws.joints(Wiener(), noise), draws.raw("accel", noise)
    found = {"none": Spread.of(plain.solve(linear.residual(draws.raw("rate", noise), accel, moved)))}
    for treatment in TREATMENTS[1:]:
        residual = linear.residual(draws.treated(treatment, "rate", noise)[:, 0], accel, moved)
        found[treatment.title] = Spread.of(plain.solve(residual))
    return found


def velocity_estimators(linear: Linear, noise: Noise) -> dict[str, Estimator]:
    """Return the uses of the accelerometer, as it reads and integrated."""
    time = linear.time
    read, weighted = as_read(time, noise), integrated(time, noise)
    return {
        "acceleration, SI alike": Estimator(linear, as_read(time, None), declared=False),
        WEIGHTED: Estimator(linear, read),
        "acceleration, weighted, bias unknown": Estimator(linear, read, biased=True),
        ALIKE: Estimator(linear, integrated(time, None), declared=False),
        VELOCITY: Estimator(linear, weighted),
        "velocity, weighted, constant unknown": Estimator(linear, weighted, nuisance=constant(weighted, time)),
        "velocity, weighted, bias unknown": Estimator(linear, weighted, biased=True),
        WHOLE: Estimator(linear, integrated_whole(time, noise)),
    }


def accelerometers(linear: Linear, draws: Draws, noise: Noise) -> dict[str, Spread]:
    """Use the accelerometer in every way, joints exact; and the paper's procedure with everything measured."""
    residual = linear.residual(draws.raw("rate", noise), draws.raw("accel", noise), draws.exact_joints())
    uses = velocity_estimators(linear, noise)
    found = {name: Spread.of(estimator.solve(residual)) for name, estimator in uses.items()}
    rate, accel = (draws.treated(LowPass(), family, noise)[:, 0] for family in ("rate", "accel"))
    residual = linear.residual(rate, accel, draws.joints(PIECES, noise))
    found[PAPER] = Spread.of(uses[ALIKE].solve(residual))
    return found
