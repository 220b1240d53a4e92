"""Monte Carlo of the treatments: bias and standard deviation of linear estimators over repeated noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from studies.base_body import paper
from studies.common.quantities import MOMENTS
from studies.sensors.draws import Draws
from studies.sensors.linear import Estimator, Linear, Solved
from studies.sensors.setting import Noise, junctions, near_junctions
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

__all__ = ["EXACT", "LIKELIHOOD", "PAPER", "PIECES", "TREATMENTS", "WITHOUT_JUNCTIONS", "Spread", "accelerometers"]
__all__ += ["EQUAL", "VELOCITY", "WEIGHTED", "WHOLE", "joints", "rates", "velocity_estimators"]

PIECES = Polynomial(junctions())
"""Polynomials over the pieces of (27) between its junctions."""

TREATMENTS: tuple[Treatment, ...] = (
    Differences(),
    LowPass(),
    SavitzkyGolay(),
    Polynomial(),
    PIECES,
    SmoothingSpline(),
    Wiener(),
)
"""Treatments of joints, and but for the first of rates."""

EXACT = "exact"
"""Joints that are known exactly."""

LIKELIHOOD = "likelihood"
"""The package's likelihood, which holds the uncertainty of the smoothed joints."""

WITHOUT_JUNCTIONS = "likelihood without junctions"
"""The same without the base's samples near the junctions of (27)."""

PAPER = "the paper's procedure"
"""Base signals filtered, joints fitted by polynomials, accelerations integrated, (21) in SI units."""

WEIGHTED, EQUAL, VELOCITY = "acceleration, weighted", "velocity, equal weights (21)", "velocity, weighted"
WHOLE = "velocity, full covariance"
"""Uses of the accelerometer that the report compares."""


@dataclass(frozen=True)
class Spread:
    """Estimates from N sets of noise; all relative to the true quantities.

    Attributes
    ----------
    errors : (N, 10) array
        Errors of mass, centre of mass and inertia, in the order of `paper.TRUTH`.
    stated : (N, 10) array
        Standard deviations that the estimator itself states.
    chi2 : (N,) array
        Chi-square per degree of freedom.
    """

    errors: Floats
    stated: Floats
    chi2: Floats

    @classmethod
    def of(cls, solved: Solved) -> Spread:
        """Return the spread of estimates in their units."""
        errors, stated, chi2 = solved
        return cls(errors / np.abs(paper.TRUTH), stated / np.abs(paper.TRUTH), chi2)

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

    def worst(self, chosen: Sequence[int] = tuple(MOMENTS)) -> int:
        """Return which of some quantities has the largest root mean square error, by default of the moments."""
        return max(chosen, key=lambda index: float(self.rms[index]))


def joints(linear: Linear, draws: Draws, noise: Noise) -> dict[str, Spread]:
    """Treat the joints in every way; rates and accelerations as read and weighted by their sensors' noise."""
    plain = Estimator(linear, as_read(linear.time, noise))
    rate, accel = draws.raw("rate", noise), draws.raw("accel", noise)
    spreads = {EXACT: Spread.of(plain.solve(linear.residual(rate, accel, draws.exact_joints())))}
    for treatment in TREATMENTS:
        residual = linear.residual(rate, accel, draws.joints(treatment, noise))
        spreads[treatment.title] = Spread.of(plain.solve(residual))
    # the last residual is that of the package's smoother
    measured = draws.measured_motion(noise)
    for name, left_out in ((LIKELIHOOD, None), (WITHOUT_JUNCTIONS, near_junctions(linear.time))):
        whitened = Estimator(linear, linear.whitening(noise, measured, left_out))
        spreads[name] = Spread.of(whitened.solve(residual))
    return spreads


def rates(linear: Linear, draws: Draws, noise: Noise) -> dict[str, Spread]:
    """Treat the rates in every way; joints smoothed by the package, accelerations as read."""
    plain = Estimator(linear, as_read(linear.time, noise))
    moved, accel = draws.joints(Wiener(), noise), draws.raw("accel", noise)
    errors = {"none": draws.raw("rate", noise)}
    errors |= {treatment.title: draws.treated(treatment, "rate", noise)[:, 0] for treatment in TREATMENTS[1:]}
    return {name: Spread.of(plain.solve(linear.residual(rate, accel, moved))) for name, rate in errors.items()}


def velocity_estimators(linear: Linear, noise: Noise) -> dict[str, Estimator]:
    """Return the uses of the accelerometer, as it reads and integrated."""
    time = linear.time
    read, weighted = as_read(time, noise), integrated(time, noise)
    return {
        "acceleration, equal weights": Estimator(linear, as_read(time, None), declared=False),
        WEIGHTED: Estimator(linear, read),
        "acceleration, weighted, bias unknown": Estimator(linear, read, biased=True),
        EQUAL: Estimator(linear, integrated(time, None), declared=False),
        VELOCITY: Estimator(linear, weighted),
        "velocity, weighted, constant unknown": Estimator(linear, weighted, nuisance=constant(weighted, time)),
        "velocity, weighted, bias unknown": Estimator(linear, weighted, biased=True),
        WHOLE: Estimator(linear, integrated_whole(time, noise)),
    }


def accelerometers(linear: Linear, draws: Draws, noise: Noise) -> dict[str, Spread]:
    """Use the accelerometer in every way with exact joints; and the paper's procedure with everything measured."""
    residual = linear.residual(draws.raw("rate", noise), draws.raw("accel", noise), draws.exact_joints())
    uses = velocity_estimators(linear, noise)
    spreads = {name: Spread.of(estimator.solve(residual)) for name, estimator in uses.items()}
    rate, accel = (draws.treated(LowPass(), family, noise)[:, 0] for family in ("rate", "accel"))
    residual = linear.residual(rate, accel, draws.joints(PIECES, noise))
    return spreads | {PAPER: Spread.of(uses[EQUAL].solve(residual))}
