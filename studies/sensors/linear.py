"""The identification to first order about the truth: residuals, their response to errors, and linear estimators.

Let J be the exact Jacobian of the sensors' readings with respect to the unknowns, and G that with respect to the
joints' motion. The residual of a recording at the truth is r = (errors of the sensors) - G (errors of the joints), and
an estimator with weights W has the error (W J)^+ W r. Residuals are (T, 6): rates, then accelerations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import jax
import numpy as np
from numpy.typing import NDArray

from bayesid import Manoeuvre, MeasuredMotion, Posterior, Recording, SensorKind
from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import linearise
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.inference.whitening import NoiseChannel, NoiseModel, build
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.sensors import Filter
from studies.sensors.setting import Noise, fly, model_of, motion
from studies.truth.recordings import by_axis

__all__ = ["STEP", "Estimator", "Linear", "Solved", "linearised", "raw_posterior", "recording_of"]

Solved = tuple[Floats, Floats, Floats]
"""Errors (N, 10), stated standard deviations (N, 10) and chi-square per degree of freedom (N,) of N estimates."""

STEP = 1.0
"""Integration step [s], whose nodes and midpoints are the samples."""

LAGS = 32
"""Largest number of samples over which the joints' errors are correlated, as in `bayesid.inference.whitening`."""


def recording_of(time: Floats, rate: Floats, accel: Floats, position: Floats | None = None) -> Recording:
    """Return a recording of the base's sensors, and of the joints where given."""
    channels = by_axis("rate", "xyz", rate) | by_axis("accel", "xyz", accel)
    if position is not None:
        channels |= by_axis("position", [f"joint{k + 1}" for k in range(position.shape[1])], position)
    return Recording("manoeuvre", None, time, channels)


def raw_posterior(recording: Recording, moved: Motion, *, biased: bool) -> Posterior:
    """Return a posterior without prior whose residuals are in SI units, since all sensors have a sigma of one."""
    model = model_of(Noise(1.0, 1.0, 0.0), biased=biased)
    return Posterior.of(model, [Manoeuvre(recording, moved)], step=STEP, flat_prior=True)


@dataclass(frozen=True)
class Linear:
    """Derivatives at the truth.

    Attributes
    ----------
    time : (T,) array
        Sample times [s].
    readings : (6 T, n) array
        Derivatives of the readings with respect to the n unknowns: ten of the base, initial rate, accelerometer bias.
    joints : (joints, 3, T, 6) array
        Derivatives of the readings with respect to joint position, velocity and acceleration at the same time.
    slope : (10, n) array
        Derivatives of the reported quantities with respect to the unknowns.
    names : tuple of str
        Names of the unknowns.
    """

    time: Floats
    readings: Floats
    joints: Floats
    slope: Floats
    names: tuple[str, ...]

    def residual(self, rate: Floats, accel: Floats, joints: Floats) -> Floats:
        """Return residuals (N, 6 T) of N sets of errors: rate and accel (N, T, 3), joints (N, 3, T, joints)."""
        moved = np.einsum("nktj,jktc->ntc", joints, self.joints, optimize=True)
        return (np.concatenate([rate, accel], axis=-1) - moved).reshape(len(moved), -1)

    def whitening(self, noise: Noise, measured: MeasuredMotion, left_out: NDArray[np.bool_] | None = None) -> Floats:
        """Return the package's whitening as a matrix on residuals, some samples left out, shape (m, 6 T)."""
        count = len(self.time)
        rows = np.arange(count) if left_out is None else np.flatnonzero(~left_out)
        samples = np.arange(len(rows))
        channels = [NoiseChannel(sigma, samples, Filter()) for sigma in (noise.rate, noise.accel) for _ in range(3)]
        covariance = measured.lag_covariance(self.time[rows], LAGS)
        banded = build(NoiseModel(self.time[rows], channels, self.joints[:, :, rows], covariance))
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
    flight, planned = fly(), motion()
    posterior = raw_posterior(recording_of(flight.time, flight.rate, flight.accel), planned, biased=True)
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
    """Weighted least squares.

    Parameters
    ----------
    linear : Linear
        Derivatives at the truth.
    weight : (m, 6 T) array
        Matrix that weights the residual.
    biased : bool
        Whether the accelerometer's constant error is among the unknowns.
    declared : bool
        Whether the weighted residual has a declared standard deviation of one; otherwise the misfit gives it.
    nuisance : (m, k) array, optional
        Derivatives of the weighted residual by further unknowns, such as a constant of integration.
    """

    linear: Linear
    weight: Floats
    biased: bool = False
    declared: bool = True
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
