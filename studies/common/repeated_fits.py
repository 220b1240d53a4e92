"""Fits of many noisy recordings of one manoeuvre, each with an arm of its own: what a predicted posterior is worth.

Every recording is smoothed as a real one. What is shared is the whitening and the Jacobian of the planned manoeuvre:
the mode is found by Gauss-Newton steps with that Jacobian, which is much cheaper than a fit from nothing and, where the
recordings determine the base, ends within a small part of a standard deviation of it (`Fit.last_step`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from bayesid._math.arrays import Floats
from bayesid.design import planned_manoeuvre, planned_posterior
from bayesid.design.design_result import sample_times
from bayesid.design.predicted_posterior import describe
from bayesid.inference.data import Data, RecordedSamples, grids_of, stacked
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import Motion
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.model import Manoeuvre, Model
from studies.common import mission
from studies.common.ets7 import BASE, INTERVAL
from studies.common.models import ARM_SPREAD
from studies.common.monte_carlo import Workers, run_trials

STEPS = 4  # number of Gauss-Newton steps of every fit


@dataclass(frozen=True)
class Reference:
    """Planned manoeuvre about which recordings are linearised."""

    # posterior of the manoeuvre as it would be recorded without noise, with its noise linearised at ``z``
    posterior: Posterior
    z: Floats  # (n,): linearisation point

    @classmethod
    def of(cls, model: Model, motion: Motion, z: Floats | None = None) -> Reference:
        """Return the reference of a motion of the mission, by default at the prior's centre."""
        times = sample_times(mission.DURATION, INTERVAL)
        manoeuvre = planned_manoeuvre(model, motion, times, "plan", mission.ENCODERS)
        plan = planned_posterior(model, [manoeuvre], z=z)
        at = np.zeros(plan.size) if z is None else z
        return cls(relinearised(plan, at), at)

    @cached_property
    def jacobian(self) -> Floats:
        """Jacobian of the residuals, prior included, shape (m, n)."""
        return self.posterior.jacobian(self.z)

    @cached_property
    def covariance(self) -> Floats:
        """Predicted covariance of the coordinates, shape (n, n)."""
        return np.linalg.inv(self.jacobian.T @ self.jacobian)

    @cached_property
    def inverse(self) -> Floats:
        """Pseudo-inverse of the Jacobian, shape (n, m)."""
        return self.covariance @ self.jacobian.T

    @cached_property
    def quantities(self) -> Floats:
        """Predicted covariance of the reported quantities."""
        return describe(self.posterior, self.z, self.covariance).covariance

    def given(self, manoeuvre: Manoeuvre) -> Posterior:
        """Return the posterior of a recording with the whitening of the plan."""
        model, plan = self.posterior.model, self.posterior.data
        recorded = (RecordedSamples.of(model, manoeuvre),)
        grids = grids_of(model, [manoeuvre], recorded, plan.step)
        arrays = stacked(model, [manoeuvre], recorded, grids, plan.whitenings)
        data = Data(model, (manoeuvre,), recorded, plan.whitenings, plan.left_out, plan.step, arrays)
        return replace(self.posterior, data=data)


@cache
def _reference(parameters: tuple[float, ...], points: int, arm_spread: float) -> Reference:
    """Return what all fits of a manoeuvre share in one process."""
    motion = mission.splines(points).motion(np.array(parameters))
    return Reference.of(mission.base_unknown(arm_spread), motion)


@dataclass(frozen=True)
class Realised:
    """Errors of fits beside what was predicted of them."""

    errors: Floats  # (N, 10): estimates of the base's quantities less the truth
    covariance: Floats  # (10, 10): predicted covariance of these errors
    # (N,): largest change of a coordinate in the last step of every fit, in predicted standard deviations
    last_step: Floats

    @property
    def predicted(self) -> Floats:
        """Predicted standard deviations, shape (10,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def rms(self) -> Floats:
        """Root mean square error over the predicted standard deviation, shape (10,)."""
        return np.sqrt((self.errors**2).mean(axis=0)) / self.predicted

    @property
    def rms_error(self) -> float:
        """Standard error of one entry of `rms` where the prediction is right."""
        return float(1.0 / np.sqrt(2.0 * len(self.errors)))

    @property
    def ratio(self) -> float:
        """Geometric mean of `rms`."""
        return float(np.exp(np.log(self.rms).mean()))

    @cached_property
    def whitened(self) -> Floats:
        """Errors along the principal axes of the predicted correlations, in predicted standard deviations, (N, 10).

        Where the prediction is right they are independent standard normal numbers; those of parameters are correlated.
        """
        sd = self.predicted
        variances, axes = np.linalg.eigh(self.covariance / np.outer(sd, sd))
        return np.asarray(self.errors / sd @ axes / np.sqrt(variances))

    @property
    def directions(self) -> Floats:
        """Root mean square error of every independent direction over its predicted standard deviation, shape (10,)."""
        return np.sqrt((self.whitened**2).mean(axis=0))

    @property
    def scale(self) -> float:
        """Root mean square of the errors of all independent directions together, in predicted standard deviations."""
        return float(np.sqrt((self.whitened**2).mean()))

    @property
    def p_value(self) -> float:
        """P-value of the errors' whole covariance where the prediction is right, NaN with too few flights.

        By the likelihood ratio with Bartlett's correction (Anderson 2003, section 10.8); a mean error counts as one.
        """
        count, size = self.whitened.shape
        if count <= size:
            return float("nan")
        sample = self.whitened.T @ self.whitened / count
        ratio = count * (np.trace(sample) - np.linalg.slogdet(sample)[1] - size)
        correction = 1.0 - (2.0 * size + 1.0 - 2.0 / (size + 1.0)) / (6.0 * count)
        return float(chi2.sf(correction * ratio, size * (size + 1) // 2))


def ratio_interval(ratio: float, count: int, level: float) -> tuple[float, float]:
    """Return the exact interval of a ratio of standard deviations that was measured by independent normal errors.

    Parameters
    ----------
    ratio : float; root mean square error over the predicted standard deviation
    count : int; number of errors
    level : float; probability that the interval contains the true ratio
    """
    few, many = (float(chi2.ppf(part, count)) for part in (0.5 * (1.0 - level), 0.5 * (1.0 + level)))
    return ratio * float(np.sqrt(count / many)), ratio * float(np.sqrt(count / few))


@dataclass(frozen=True)
class _Task:
    parameters: tuple[float, ...]
    points: int
    arm_spread: float


def repeat(
    parameters: Floats,
    points: int,
    count: int,
    *,
    seed: int,
    arm_spread: float = ARM_SPREAD,
    store: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Realised:
    """Fly a manoeuvre many times in MuJoCo, each time with an arm, a bias and noise of its own, and fit the base.

    Parameters
    ----------
    parameters : (n,) array; parameters of the manoeuvre
    points : int; number of free control points of every joint
    count : int; number of flights
    arm_spread : float; relative width of the links' priors, from which the true arm of every flight is drawn
    seed, store, workers, progress
        See `studies.common.monte_carlo.run_trials`.
    """
    task = _Task(tuple(map(float, parameters)), points, arm_spread)
    outcomes = run_trials(estimate, [task] * count, store, seed=seed, workers=workers, progress=progress).complete()
    shared = _reference(task.parameters, points, arm_spread)
    errors, last = (np.array([outcome[key] for outcome in outcomes]) for key in ("error", "last_step"))
    return Realised(errors, shared.quantities, last)


def estimate(task: _Task, rng: np.random.Generator) -> dict[str, Any]:
    """Fly once, fit, and return the error of the base's quantities and the last step of the fit."""
    shared = _reference(task.parameters, task.points, task.arm_spread)
    robot = mission.true_arm(mission.published_robot(), rng, task.arm_spread)
    motion = mission.splines(task.points).motion(np.array(task.parameters))
    posterior = shared.given(mission.recorded(mission.fly(motion, robot), rng))
    z, step = np.zeros(posterior.size), np.zeros(posterior.size)
    for _ in range(STEPS):
        step = shared.inverse @ posterior.least_squares(z)
        z = z - step
    truth = mass_com_inertia(robot.link(BASE).inertial.vector)
    sd = np.linalg.norm(shared.inverse, axis=1)
    estimated = mass_com_inertia(posterior.unknowns.inertials(z)[0].vector)
    return {"error": estimated - truth, "last_step": float(np.abs(step / sd).max())}
