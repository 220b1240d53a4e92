"""Comparison of the predicted standard deviations with estimates from flights of an independent simulator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bayesid import Posterior
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference import maximise
from bayesid.inference.body_quantities import linearise
from bayesid.inference.noise_changes import relinearised
from studies.common.monte_carlo import run_trials
from studies.ets7_limits.flights import fly, record
from studies.ets7_limits.setting import limits_problem, model_of
from studies.truth.mujoco import Truth

__all__ = ["RATE_AT_START", "Check", "Planned", "check"]

RATE_AT_START = np.array([1e-4, -5e-5, 8e-5])
"""Rate of the base at the start in MuJoCo [rad/s], which the fits do not know."""


@dataclass(frozen=True)
class Planned:
    """Manoeuvre to fly, and the integration step of its fits.

    Parameters
    ----------
    parameters : tuple of float
        Parameters of the family of manoeuvres of `limits_problem`.
    duration : float
        Length of the manoeuvre [s].
    points : int
        Number of free control points of every joint.
    step : float, optional
        Integration step of the fits [s], by default chosen from the recording.
    """

    parameters: tuple[float, ...]
    duration: float
    points: int
    step: float | None = None

    def posterior(self, rng: np.random.Generator) -> Posterior:
        """Return the posterior of a recording of the flight with fresh noise; the arm is known exactly."""
        flown = _flown(self.parameters, self.duration, self.points)
        return Posterior.of(model_of(), [record(flown, "flight", rng)], step=self.step)


@dataclass(frozen=True)
class Check:
    """Estimates beside their prediction.

    Attributes
    ----------
    truth, predicted : (10,) arrays
        True quantities of the base, and the predicted standard deviations of their estimates.
    estimates : (N, 10) array
        Modes of the posteriors.
    chi2 : (N,) array
        Chi-square per scalar sample.
    """

    truth: Floats
    predicted: Floats
    estimates: Floats
    chi2: Floats

    @property
    def ratio(self) -> Floats:
        """Root mean square error over the predicted standard deviation, shape (10,)."""
        return np.asarray(np.sqrt(((self.estimates - self.truth) ** 2).mean(axis=0)) / self.predicted)

    @property
    def sampling_error(self) -> float:
        """Standard deviation of `ratio` where the prediction is right."""
        return float(1.0 / np.sqrt(2.0 * len(self.estimates)))

    @property
    def offset(self) -> Floats:
        """Mean error in units of its standard deviation, shape (10,)."""
        return (self.estimates.mean(axis=0) - self.truth) / (self.predicted / np.sqrt(len(self.estimates)))


def check(
    planned: Planned,
    noises: int,
    seed: int,
    store: Path | None = None,
    workers: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Check:
    """Fly a manoeuvre once, record it with many noises, and fit each recording.

    Parameters
    ----------
    planned : Planned
        Manoeuvre to fly.
    noises : int
        Number of recordings.
    seed, store, workers, progress
        See `studies.common.monte_carlo.run_trials`.
    """
    posterior = planned.posterior(np.random.default_rng(seed))
    z = posterior.starting_point()
    knowledge = Knowledge.at(relinearised(posterior, z), z)
    task = Planned(planned.parameters, planned.duration, planned.points, posterior.step)
    outcomes = run_trials(estimate, [task] * noises, store, seed=seed, workers=workers, progress=progress).complete()
    estimates, chi2 = (np.array([outcome[key] for outcome in outcomes]) for key in ("estimate", "chi2"))
    return Check(knowledge.values, knowledge.sd, estimates, chi2)


def estimate(planned: Planned, rng: np.random.Generator) -> dict[str, Any]:
    """Fit one recording of the flight and return the mode and chi-square per sample."""
    refined, optimum = maximise(planned.posterior(rng), rng)
    return {"estimate": linearise(refined, optimum.z).values, "chi2": optimum.chi2 / refined.samples}


@cache
def _flown(parameters: tuple[float, ...], duration: float, points: int) -> Truth:
    motion = limits_problem(duration, points).plan.family.motion(np.array(parameters))
    return fly(motion, duration, RATE_AT_START)
