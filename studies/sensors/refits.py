"""Whole nonlinear fits of some draws, beside what the linear estimators made of the same noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bayesid import Manoeuvre, Posterior
from bayesid.inference import maximise
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.robot.joint_state import JointState
from studies.base_body import paper
from studies.base_body.physical import physical_sd, physical_slope
from studies.sensors.draws import Draws
from studies.sensors.linear import STEP, Estimator, Linear, recording_of
from studies.sensors.montecarlo import OURS, PAPER, PIECES, Spread
from studies.sensors.setting import INTERVAL, Noise, model_of
from studies.sensors.treatments import LowPass, Wiener
from studies.sensors.weights import integrated

__all__ = ["Refits", "SampledMotion", "refit"]

Floats = NDArray[np.floating]

BODY = 13
"""Unknowns of the base and the initial rate; the three of the accelerometer's bias come after them."""


@dataclass(frozen=True)
class SampledMotion:
    """Joints known at the samples alone: position, velocity and acceleration, each (T, joints)."""

    states: Floats

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,), which must be samples."""
        rows = np.rint(np.asarray(time) / INTERVAL).astype(int)
        if not np.allclose(rows * INTERVAL, time, atol=1e-9):
            raise ValueError(
                f"times from {np.min(time):g} to {np.max(time):g} s are not all samples {INTERVAL:g} s apart"
            )
        return JointState(*self.states[:, rows])


@dataclass(frozen=True)
class Refits:
    """Nonlinear fits of N draws and the linear errors of the same draws."""

    nonlinear: Spread
    linear: Spread

    @property
    def apart(self) -> Floats:
        """Median absolute difference over the standard deviation, shape (10,)."""
        gap = self.nonlinear.errors - self.linear.errors
        return np.asarray(np.median(np.abs(gap), axis=0)) / self.linear.sd

    @property
    def runaway(self) -> Floats:
        """Which fits ended at a body that is wrong by more than its own size in mass or a moment, shape (N,)."""
        return np.asarray((np.abs(self.nonlinear.errors[:, [0, 4, 5, 6]]) > 1.0).any(axis=1))


def refit(raw: Posterior, linear: Linear, draws: Draws, noise: Noise, ours: int, theirs: int) -> dict[str, Refits]:
    """Fit the first draws as the package does, and as the paper does.

    Fits start from the truth: what is asked is where the optimum lies, not whether it is found.

    Parameters
    ----------
    raw : Posterior
        Of `studies.sensors.linear.raw_posterior`.
    ours, theirs : int
        How many draws.
    """
    found = {OURS: _ours(draws, noise, ours), PAPER: _paper(raw, draws, noise, theirs)}
    measured = draws.measured_motion(noise)
    moved, fitted = draws.joints(Wiener(), noise)[:ours], draws.joints(PIECES, noise)[:theirs]
    rate, accel = (draws.raw(family, noise)[:ours] for family in ("rate", "accel"))
    turned, pulled = (draws.treated(LowPass(), family, noise)[:theirs, 0] for family in ("rate", "accel"))
    alike = Estimator(linear, integrated(linear.time, None), declared=False)
    whole = Estimator(linear, linear.whitening(noise, measured))
    first_order = {
        OURS: Spread.of(whole.solve(linear.residual(rate, accel, moved))),
        PAPER: Spread.of(alike.solve(linear.residual(turned, pulled, fitted))),
    }
    return {name: Refits(found[name], first_order[name]) for name in found}


def _ours(draws: Draws, noise: Noise, count: int) -> Spread:
    model, first, errors, stated, chi2 = model_of(noise, biased=False), None, [], [], []
    for index in range(count):
        manoeuvre = Manoeuvre(draws.recording(noise, index), draws.measured_motion(noise, index))
        posterior = Posterior.of(model, [manoeuvre], step=STEP, flat_prior=True)
        first = first or posterior
        refined, optimum = maximise(posterior, np.random.default_rng(index), np.zeros(posterior.size))
        errors.append(_quantities(refined, optimum.z) - paper.TRUTH)
        stated.append(physical_sd(physical_slope(refined, optimum.z), optimum.covariance))
        chi2.append(optimum.chi2 / (refined.samples - refined.size))
    return Spread.of((np.array(errors), np.array(stated), np.array(chi2)))


def _paper(raw: Posterior, draws: Draws, noise: Noise, count: int) -> Spread:
    time, errors, stated, chi2 = draws.flight.time, [], [], []
    weight = integrated(time, None)
    flown = np.stack(raw.manoeuvres[0].motion.evaluate(time))
    for index in range(count):
        rate, accel = (
            getattr(draws.flight, family) + draws.treated(LowPass(), family, noise)[index, 0]
            for family in ("rate", "accel")
        )
        joints = SampledMotion(flown + draws.joints(PIECES, noise)[index])
        posterior = with_manoeuvres(raw, [Manoeuvre(recording_of(time, rate, accel), joints)])
        residual, jacobian = _weighted(posterior, weight)
        solution = least_squares(residual, np.zeros(BODY), jacobian, method="lm", x_scale="jac")
        slopes = jacobian(solution.x)
        covariance = np.linalg.inv(slopes.T @ slopes)
        variance = 2.0 * solution.cost / (len(weight) - BODY)
        z = np.concatenate([solution.x, np.zeros(3)])
        errors.append(_quantities(posterior, z) - paper.TRUTH)
        stated.append(np.sqrt(variance) * physical_sd(physical_slope(posterior, z)[:, :BODY], covariance))
        chi2.append(variance)
    return Spread.of((np.array(errors), np.array(stated), np.array(chi2)))


def _weighted(posterior: Posterior, weight: Floats) -> tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]:
    """Return the weighted residual and its Jacobian in all unknowns but the accelerometer's bias."""

    def residual(x: Floats) -> Floats:
        values: Floats = weight @ posterior.residuals(np.concatenate([x, np.zeros(3)])).ravel()[: weight.shape[1]]
        return values

    def jacobian(x: Floats) -> Floats:
        slopes: Floats = weight @ posterior.jacobian(np.concatenate([x, np.zeros(3)]))[: weight.shape[1], :BODY]
        return slopes

    return residual, jacobian


def _quantities(posterior: Posterior, z: Floats) -> Floats:
    return np.asarray(mass_com_inertia(np.asarray(posterior.unknowns.values_at(z).inertial)))
