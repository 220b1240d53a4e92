"""The identification to first order about the truth: residuals, their weights, linear estimators, repeated noise.

Let J be the exact Jacobian of the sensors' readings with respect to the unknowns, and G that with respect to the
joints' motion. The residual of a recording at the truth is r = (errors of the sensors) - G (errors of the joints), and
an estimator with weights W has the error (W J)^+ W r. Residuals are (T, 6): rates, then accelerations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import jax
import numpy as np
from numpy.typing import NDArray

from bayesid import Manoeuvre, MeasuredMotion, Posterior, Recording, SensorKind
from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import linearise
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.inference.whitening import MotionErrors, NoiseChannel, SampleNoise, build
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.sensors import Filter
from studies.base_body import paper
from studies.common.quantities import MOMENTS
from studies.sensors import signals

# errors (N, 10), stated standard deviations (N, 10) and chi-square per degree of freedom (N,) of N estimates
Solved = tuple[Floats, Floats, Floats]

STEP = 1.0  # integration step [s], whose nodes and midpoints are the samples
LAGS = 32  # largest number of samples over which the joints' errors are correlated, as in `bayesid.inference.whitening`


def raw_posterior(recording: Recording, moved: Motion, *, biased: bool) -> Posterior:
    """Return a posterior without prior whose residuals are in SI units, since all sensors have a sigma of one."""
    model = signals.model_of(signals.Noise(1.0, 1.0, 0.0), biased=biased)
    return Posterior.of(model, [Manoeuvre(recording, moved)], step=STEP, flat_prior=True)


@dataclass(frozen=True)
class Linear:
    """Derivatives at the truth."""

    time: Floats  # (T,): sample times [s]
    # (6 T, n): derivatives of the readings with respect to the n unknowns: ten of the base, initial rate, accelerometer
    # bias
    readings: Floats
    # (joints, 3, T, 6): derivatives of the readings with respect to joint position, velocity and acceleration at the
    # same time
    joints: Floats
    slope: Floats  # (10, n): derivatives of the reported quantities with respect to the unknowns
    names: tuple[str, ...]  # names of the unknowns

    def residual(self, rate: Floats, accel: Floats, joints: Floats) -> Floats:
        """Return residuals (N, 6 T) of N sets of errors: rate and accel (N, T, 3), joints (N, 3, T, joints)."""
        moved = np.einsum("nktj,jktc->ntc", joints, self.joints, optimize=True)
        return (np.concatenate([rate, accel], axis=-1) - moved).reshape(len(moved), -1)

    def whitening(
        self, noise: signals.Noise, measured: MeasuredMotion, left_out: NDArray[np.bool_] | None = None
    ) -> Floats:
        """Return the package's whitening as a matrix on residuals, some samples left out, shape (m, 6 T)."""
        count = len(self.time)
        rows = np.arange(count) if left_out is None else np.flatnonzero(~left_out)
        samples = np.arange(len(rows))
        channels = [NoiseChannel(sigma, samples, Filter()) for sigma in (noise.rate, noise.accel) for _ in range(3)]
        errors = MotionErrors(self.joints[:, :, rows], measured.lag_covariance(self.time[rows], LAGS))
        banded = build(SampleNoise(self.time[rows], channels, [errors]))
        dense = np.zeros((len(banded.start), 6, len(rows), 6))
        for block, start in enumerate(banded.start):
            reach = min(banded.weights.shape[2], len(rows) - start)
            dense[block, :, start : start + reach] = banded.weights[block, :, :reach]
        full = np.zeros((len(banded.start), 6, count, 6))
        full[:, :, rows] = dense
        return full.reshape(-1, 6 * count)


@cache
def linearised() -> Linear:
    """Return the derivatives along the manoeuvre as it is flown."""
    flight, planned = signals.fly(), signals.motion()
    posterior = raw_posterior(signals.recording_of(flight.time, flight.rate, flight.accel), planned, biased=True)
    z, count = np.zeros(posterior.size), len(flight.time)
    environment = jax.tree.map(lambda x: np.asarray(x)[0, :count], posterior.data.arrays.grid.sample.environment)
    attitude = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))  # there is no star sensor to which it matters
    sampled = SampledMotion(attitude, flight.rate, environment)
    return Linear(
        time=flight.time,
        readings=-posterior.jacobian(z)[: 6 * count],  # the other rows are padding
        joints=joint_sensitivity(
            posterior.model.robot, planned.evaluate(flight.time), sampled, posterior.model.sensors
        ),
        slope=linearise(posterior, z).slope,
        names=posterior.unknowns.names,
    )


@dataclass(frozen=True)
class Estimator:
    """Weighted least squares."""

    linear: Linear  # derivatives at the truth
    weight: Floats  # (m, 6 T): matrix that weights the residual
    biased: bool = False  # whether the accelerometer's constant error is among the unknowns
    # whether the weighted residual has a declared standard deviation of one; otherwise the misfit gives it
    declared: bool = True
    # (m, k): derivatives of the weighted residual by further unknowns, such as a constant of integration
    nuisance: Floats | None = None

    def solve(self, residual: Floats) -> Solved:
        """Estimate from each of N residuals (N, 6 T)."""
        keep = [self.biased or not name.startswith(SensorKind.ACCEL.value) for name in self.linear.names]
        slope, design = self.linear.slope[:, keep], self.weight @ self.linear.readings[:, keep]
        if self.nuisance is not None:
            design = np.concatenate([design, self.nuisance], axis=1)
            slope = np.concatenate([slope, np.zeros((10, self.nuisance.shape[1]))], axis=1)
        scale = np.linalg.norm(design, axis=0)
        basis, factor = np.linalg.qr(design / scale)
        to_quantities = slope / scale @ np.linalg.inv(factor)
        weighted = residual @ self.weight.T
        share = weighted @ basis
        scalars = int(self.weight.any(axis=1).sum())
        chi2 = ((weighted**2).sum(axis=1) - (share**2).sum(axis=1)) / (scalars - design.shape[1])
        stated = np.linalg.norm(to_quantities, axis=1)[None, :] * (1.0 if self.declared else np.sqrt(chi2)[:, None])
        return share @ to_quantities.T, np.broadcast_to(stated, (len(residual), 10)), chi2


def integral(time: Floats) -> Floats:
    """Return the trapezoidal rule from the start as a matrix, shape (T - 1, T)."""
    step, samples = np.diff(time), np.eye(len(time))
    return np.cumsum(0.5 * step[:, None] * (samples[1:] + samples[:-1]), axis=0)


def as_read(time: Floats, noise: signals.Noise | None) -> Floats:
    """Return weights of rates and accelerations by their noise, or equal ones in SI units without a noise."""
    rate, accel = (1.0, 1.0) if noise is None else (1.0 / noise.rate, 1.0 / noise.accel)
    return _both(rate * np.eye(len(time)), accel * np.eye(len(time)))


def integrated(time: Floats, noise: signals.Noise | None) -> Floats:
    """Return weights of rates and velocities by their noise as if it were white, or equal ones as in (21) without one.

    The noise of the velocity is the root mean square of the accelerometer's integrated noise.
    """
    rule = integral(time)
    if noise is None:
        return _both(np.eye(len(time)), rule)
    spread = noise.accel * np.sqrt((rule**2).sum(axis=1).mean())
    return _both(np.eye(len(time)) / noise.rate, rule / spread)


def integrated_whole(time: Floats, noise: signals.Noise) -> Floats:
    """Return weights of rates by their noise and of velocities by their full covariance."""
    rule = integral(time)
    factor = np.linalg.cholesky(rule @ rule.T)
    return _both(np.eye(len(time)) / noise.rate, np.linalg.solve(factor, rule) / noise.accel)


def constant(weight: Floats, time: Floats) -> Floats:
    """Return derivatives of a weighted residual of `integrated` by the velocity at the start, shape (m, 3)."""
    velocities = len(time) - 1
    size = weight[-1].max() / integral(time)[-1].max()  # weight of a velocity
    column = np.zeros((len(weight), 3))
    column[3 * len(time) :] = size * np.tile(np.eye(3), (velocities, 1))
    return column


def _both(rate: Floats, accel: Floats) -> Floats:
    """Return one matrix on flat residuals (T, 6) from a matrix on each rate axis and one on each acceleration axis."""
    return np.concatenate([np.kron(rate, np.eye(3, 6)), np.kron(accel, np.eye(3, 6, 3))])


PIECES = signals.Polynomial(signals.junctions())  # polynomials over the pieces of (27) between its junctions

# treatments of joints, and but for the first of rates
TREATMENTS: tuple[signals.Treatment, ...] = (
    signals.Differences(),
    signals.LowPass(),
    signals.SavitzkyGolay(),
    signals.Polynomial(),
    PIECES,
    signals.SmoothingSpline(),
    signals.Wiener(),
)

EXACT = "exact"  # joints that are known exactly
LIKELIHOOD = "likelihood"  # the package's likelihood, which holds the uncertainty of the smoothed joints
WITHOUT_JUNCTIONS = "likelihood without junctions"  # the same without the base's samples near the junctions of (27)

# base signals filtered, joints fitted by polynomials, accelerations integrated, (21) in SI units
PAPER = "the paper's procedure"

WEIGHTED, EQUAL, VELOCITY = "acceleration, weighted", "velocity, equal weights (21)", "velocity, weighted"
WHOLE = "velocity, full covariance"  # uses of the accelerometer that the report compares


@dataclass(frozen=True)
class Spread:
    """Estimates from N sets of noise; all relative to the true quantities."""

    errors: Floats  # (N, 10): errors of mass, centre of mass and inertia, in the order of `paper.TRUTH`
    stated: Floats  # (N, 10): standard deviations that the estimator itself states
    chi2: Floats  # (N,): chi-square per degree of freedom

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


def joints(linear: Linear, draws: signals.Draws, noise: signals.Noise) -> dict[str, Spread]:
    """Treat the joints in every way; rates and accelerations as read and weighted by their sensors' noise."""
    plain = Estimator(linear, as_read(linear.time, noise))
    rate, accel = draws.raw("rate", noise), draws.raw("accel", noise)
    spreads = {EXACT: Spread.of(plain.solve(linear.residual(rate, accel, draws.exact_joints())))}
    for treatment in TREATMENTS:
        residual = linear.residual(rate, accel, draws.joints(treatment, noise))
        spreads[treatment.title] = Spread.of(plain.solve(residual))
    # the last residual is that of the package's smoother
    measured = draws.measured_motion(noise)
    for name, left_out in ((LIKELIHOOD, None), (WITHOUT_JUNCTIONS, signals.near_junctions(linear.time))):
        whitened = Estimator(linear, linear.whitening(noise, measured, left_out))
        spreads[name] = Spread.of(whitened.solve(residual))
    return spreads


def rates(linear: Linear, draws: signals.Draws, noise: signals.Noise) -> dict[str, Spread]:
    """Treat the rates in every way; joints smoothed by the package, accelerations as read."""
    plain = Estimator(linear, as_read(linear.time, noise))
    moved, accel = draws.joints(signals.Wiener(), noise), draws.raw("accel", noise)
    errors = {"none": draws.raw("rate", noise)}
    errors |= {treatment.title: draws.treated(treatment, "rate", noise)[:, 0] for treatment in TREATMENTS[1:]}
    return {name: Spread.of(plain.solve(linear.residual(rate, accel, moved))) for name, rate in errors.items()}


def velocity_estimators(linear: Linear, noise: signals.Noise) -> dict[str, Estimator]:
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


def accelerometers(linear: Linear, draws: signals.Draws, noise: signals.Noise) -> dict[str, Spread]:
    """Use the accelerometer in every way with exact joints; and the paper's procedure with everything measured."""
    residual = linear.residual(draws.raw("rate", noise), draws.raw("accel", noise), draws.exact_joints())
    uses = velocity_estimators(linear, noise)
    spreads = {name: Spread.of(estimator.solve(residual)) for name, estimator in uses.items()}
    rate, accel = (draws.treated(signals.LowPass(), family, noise)[:, 0] for family in ("rate", "accel"))
    residual = linear.residual(rate, accel, draws.joints(PIECES, noise))
    return spreads | {PAPER: Spread.of(uses[EQUAL].solve(residual))}
