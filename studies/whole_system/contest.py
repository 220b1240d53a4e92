"""The linear regressor method against the integral method (21) on the same noisy recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bayesid import Posterior, Robot
from bayesid._math.arrays import Floats
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from studies.common.monte_carlo import run_trials
from studies.truth.mujoco import Truth
from studies.whole_system.linear import regress
from studies.whole_system.sampled import true_point
from studies.whole_system.setting import bodies, groups, model_of
from studies.whole_system.world import record

__all__ = ["Method", "contest"]


@dataclass(frozen=True)
class Method:
    """One method over K recordings of one flight that differ by their noise."""

    title: str  # title of the method
    # (K, 4): relative errors of the masses of `groups`, and the standard deviations that the method itself states
    errors: Floats
    believed: Floats


def contest(
    run: Truth, truth: Robot, drawings: Robot, *, count: int, seed: int, progress: Callable[[str], None]
) -> tuple[Method, ...]:
    """Estimate all bodies by both methods, from motion alone and with joint torques."""
    names = bodies(truth)
    gather = np.array([[float(name in members) for name in names] for members in groups(truth).values()])
    true = gather @ np.array([truth.link(name).inertial.mass for name in names])
    first: dict[bool, Posterior] = {}  # their compiled functions serve all recordings

    def recording(number: int, rng: np.random.Generator) -> dict[str, tuple[Floats, Floats]]:
        """Return the errors and stated deviations on one recording, by the title of the method."""
        manoeuvre, outcome = record(run, truth, "six joints", rng), {}
        for torques, suffix in ((False, "motion alone"), (True, "with joint torques")):
            estimate, covariance = regress(manoeuvre, drawings, torques=torques)
            deviations = np.sqrt(np.diag(gather @ covariance[::10, ::10] @ gather.T))
            outcome[f"regressors, {suffix}"] = gather @ estimate[::10] / true - 1.0, deviations / true
            if torques not in first:
                first[torques] = Posterior.of(model_of(drawings, torques=torques), [manoeuvre])
            posterior = with_manoeuvres(first[torques], [manoeuvre])
            z = true_point(posterior, truth)
            optimum = fit(relinearised(posterior, z), z)
            masses = np.array([body.mass for body in posterior.unknowns.inertials(optimum.z)])
            spread = np.array([prior.spread for prior in posterior.model.priors])
            slope = np.zeros((len(gather), posterior.size))
            slope[:, : 10 * len(names) : 10] = gather * (2.0 * spread * masses)
            deviations = np.sqrt(np.diag(slope @ optimum.covariance @ slope.T))
            outcome[f"integral of the motion, {suffix}"] = gather @ masses / true - 1.0, deviations / true
        return outcome

    trials = run_trials(recording, range(count), seed=seed, progress=lambda text: progress(f"methods: {text}"))
    outcomes = trials.complete()
    return tuple(
        Method(title, *(np.array([outcome[title][part] for outcome in outcomes]) for part in (0, 1)))
        for title in outcomes[0]
    )
