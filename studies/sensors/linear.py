"""The identification to first order about the truth: residuals, how they answer to errors, and linear estimators.

With J the exact Jacobian of what the sensors read in the unknowns and G that in the joints' motion, the residual of a
recording at the truth is r = (errors of the sensors) - G (errors of the joints), and an estimator with weights W errs
by (W J)^+ W r. Residuals are (T, 6): rates, then accelerations.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from numpy.typing import NDArray

from bayesid import Kind, Manoeuvre, MeasuredMotion, Posterior, Recording
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.inference.whitening import NoiseChannel, NoiseModel, build
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.sensors import Filter
from studies.base_body.physical import physical_slope
from studies.sensors.setting import Flight, Noise, model_of, motion

__all__ = ["STEP", "Estimator", "Linear", "raw_posterior", "recording_of"]

Floats = NDArray[np.floating]

STEP = 1.0
"""Integration step [s]: its nodes and midpoints are the samples."""

LAGS = 32
"""Samples over which the joints' errors are correlated at most, those of `bayesid.inference.whitening`."""


def recording_of(time: Floats, rate: Floats, accel: Floats, position: Floats | None = None) -> Recording:
    """Return a recording of the base's sensors, and of the joints where given."""
    families = {"rate": rate, "accel": accel}
    channels = {f"{name}.{axis}": values[:, k] for name, values in families.items() for k, axis in enumerate("xyz")}
    if position is not None:
        channels |= {f"position.joint{k + 1}": column for k, column in enumerate(position.T)}
    return Recording("manoeuvre", None, time, channels)


def raw_posterior(flight: Flight, moved: Motion, *, gradient: bool = True) -> Posterior:
    """Return a posterior without prior whose residuals are in SI units, by giving all sensors a sigma of one."""
    recording = recording_of(flight.time, flight.rate, flight.accel)
    model = model_of(Noise(1.0, 1.0, 0.0), gradient=gradient)
    return Posterior.of(model, [Manoeuvre(recording, moved)], step=STEP, flat_prior=True)


@dataclass(frozen=True)
class Linear:
    """Derivatives at the truth.

    Attributes
    ----------
    time : (T,) array
    readings : (6 T, n) array
        Derivatives of what the sensors read in the n unknowns: ten of the base, initial rate, accelerometer bias.
    joints : (joints, 3, T, 6) array
        In joint position, velocity and acceleration at that time.
    slope : (10, n) array
        Of the reported quantities.
    names : tuple of str
        Of the unknowns.
    """

    time: Floats
    readings: Floats
    joints: Floats
    slope: Floats
    names: tuple[str, ...]

    @classmethod
    def of(cls, flight: Flight, posterior: Posterior) -> Linear:
        """Compute them from `raw_posterior`."""
        z, count = np.zeros(posterior.size), len(flight.time)
        environment = jax.tree.map(lambda x: np.asarray(x)[0, :count], posterior.data.arrays.grid.sample.environment)
        seen = SampledMotion(np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)), flight.rate, environment)  # no star sensor
        response = joint_sensitivity(
            posterior.model.robot, motion().evaluate(flight.time), seen, posterior.model.sensors
        )
        return cls(
            flight.time,
            -posterior.jacobian(z)[: 6 * count],  # what is left is padding
            response,
            physical_slope(posterior, z),
            posterior.unknowns.names,
        )

    def residual(self, rate: Floats, accel: Floats, joints: Floats) -> Floats:
        """Return residuals (N, 6 T) of N sets of errors: rate and accel (N, T, 3), joints (N, 3, T, joints)."""
        moved = np.einsum("nktj,jktc->ntc", joints, self.joints, optimize=True)
        return (np.concatenate([rate, accel], axis=-1) - moved).reshape(len(moved), -1)

    def whitening(self, noise: Noise, measured: MeasuredMotion, left_out: NDArray[np.bool_] | None = None) -> Floats:
        """Return the package's whitening as a matrix on residuals, some samples left out, shape (m, 6 T)."""
        count = len(self.time)
        rows = np.arange(count) if left_out is None else np.flatnonzero(~left_out)
        own = np.arange(len(rows))
        channels = [NoiseChannel(sigma, own, Filter()) for sigma in (noise.rate, noise.accel) for _ in range(3)]
        covariance = measured.lag_covariance(self.time[rows], LAGS)
        found = build(NoiseModel(self.time[rows], channels, self.joints[:, :, rows], covariance))
        dense = np.zeros((len(found.start), 6, len(rows), 6))
        for block, start in enumerate(found.start):
            reach = min(found.weights.shape[2], len(rows) - start)
            dense[block, :, start : start + reach] = found.weights[block, :, :reach]
        full = np.zeros((len(found.start), 6, count, 6))
        full[:, :, rows] = dense
        return full.reshape(-1, 6 * count)


@dataclass(frozen=True)
class Estimator:
    """Weighted least squares.

    Parameters
    ----------
    linear : Linear
    weight : (m, 6 T) array
        Applied to the residual.
    biased : bool
        Whether the accelerometer's constant error is among the unknowns.
    declared : bool
        Whether the weighted residual has a declared standard deviation of one; else it is estimated from what is left.
    nuisance : (m, k) array, optional
        Further unknowns of the weighted residual, such as a constant of integration.
    """

    linear: Linear
    weight: Floats
    biased: bool = False
    declared: bool = True
    nuisance: Floats | None = None

    def solve(self, residual: Floats) -> tuple[Floats, Floats, Floats]:
        """Return for residuals (N, 6 T): errors (N, 10), the standard deviations it states (N, 10), chi2 per d.o.f."""
        keep = [self.biased or not name.startswith(Kind.ACCEL.value) for name in self.linear.names]
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
