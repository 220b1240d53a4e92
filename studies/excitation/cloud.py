"""Whether base motion measures the excitation: criterion (26) against the posterior over random manoeuvres."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import numpy as np
from scipy.stats import spearmanr

from bayesid._math.arrays import Floats
from bayesid.design import DOptimal, Paper26, Paper26Intended, Problem
from bayesid.design.plan import PlannedOutcome

__all__ = ["Cloud", "Sensitivity", "random_cloud", "sensitivity"]


@dataclass(frozen=True)
class Cloud:
    """Random manoeuvres of one family within limits.

    Attributes
    ----------
    printed, intended, motion : (n,) arrays
        Criterion (26) as printed, as intended, and the sum of the largest squared excursions alone.
    log_det : (n,) array
        Log-determinant of the posterior covariance of the base's coordinates.
    """

    printed: Floats
    intended: Floats
    motion: Floats
    log_det: Floats

    def correlation(self, values: Floats) -> tuple[float, float]:
        """Return the rank correlation with the information (minus the log-determinant), and its standard error."""
        rho = float(spearmanr(values, -self.log_det).statistic)
        return rho, float((1.0 - rho**2) / np.sqrt(len(values) - 3.0))


def random_cloud(problem: Problem, count: int, rng: np.random.Generator) -> Cloud:
    """Draw random manoeuvres, each a random part of the largest that keeps the limits in its direction."""
    plan, family = problem.plan, problem.plan.family

    @jax.jit
    def judged(parameters: jax.Array) -> tuple[jax.Array, ...]:
        outcome: PlannedOutcome = plan.outcome(parameters, jax.numpy.asarray(problem.centre))
        largest = jax.numpy.abs(outcome.trajectory.excursion).max(axis=0)
        criteria = -Paper26().cost(plan, outcome), -Paper26Intended().cost(plan, outcome)
        return *criteria, (largest**2).sum(), 2.0 * DOptimal().cost(plan, outcome)

    rows: list[list[float]] = []
    while len(rows) < count:
        direction = family.scale * rng.normal(size=family.size)
        size = 1.0
        while problem.fractions(family.centre + size * direction)[0].max() > 1.0:
            size *= 0.7
        rows.append([float(value) for value in judged(family.centre + size * rng.uniform(0.3, 1.0) * direction)])
    return Cloud(*np.array(rows).T)


@dataclass(frozen=True)
class Sensitivity:
    """Weights of the errors in (25) along a manoeuvre.

    Attributes
    ----------
    time : (T,) array
        Sample times [s].
    rate, accel : (T, 10) arrays
        Norm of the derivative of rate and acceleration with respect to each log-Cholesky coordinate of the base, in
        standard deviations of a sample.
    """

    time: Floats
    rate: Floats
    accel: Floats


def sensitivity(problem: Problem, parameters: Floats) -> Sensitivity:
    """Return the sensitivities (25) along the manoeuvre of some parameters."""
    plan = problem.plan
    slopes = np.asarray(jax.jit(plan.slopes)(parameters, problem.centre))[:, :, plan.bodies()]
    rate, accel = (np.linalg.norm(slopes[:, start : start + 3], axis=1) for start in (0, 3))
    return Sensitivity(plan.samples, rate, accel)
