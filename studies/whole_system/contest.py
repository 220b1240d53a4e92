"""The linear regressor method against the integral method (21) on the same noisy recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid import Posterior, Robot
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from studies.common.ets7 import BASE
from studies.common.monte_carlo import run_trials
from studies.truth.mujoco import Truth
from studies.whole_system.linear import regress
from studies.whole_system.sampled import true_point
from studies.whole_system.setting import LOAD, bodies, model_of
from studies.whole_system.world import START_RATE, record

__all__ = ["Method", "contest"]

Floats = NDArray[np.floating]

QUANTITIES = ("mass of the base", "mass of the load", "mass of the arm", "mass of the whole system")


@dataclass(frozen=True)
class Method:
    """One method over K recordings of one flight that differ by their noise.

    Attributes
    ----------
    title : str
    errors, believed : (K, 4) arrays
        Relative errors of four masses (`QUANTITIES`) and the standard deviations that the method itself states.
    """

    title: str
    errors: Floats
    believed: Floats


def contest(
    run: Truth, truth: Robot, drawings: Robot, *, count: int, seed: int, progress: Callable[[str], None]
) -> tuple[Method, ...]:
    """Estimate all bodies by both methods, from motion alone and with joint torques."""
    names, gather = bodies(truth), _gather(truth)
    true = gather @ np.array([truth.link(name).inertial.mass for name in names])
    ways = ((False, "motion alone"), (True, "with joint torques"))
    first: dict[bool, Posterior] = {}  # their compiled functions serve all recordings

    def recording(number: int, rng: np.random.Generator) -> dict[str, tuple[Floats, Floats]]:
        """Errors and stated deviations of every method on one recording, by the method's title."""
        manoeuvre, outcome = record(run, truth, "six joints", rng), {}
        for torques, suffix in ways:
            estimate, covariance = regress(manoeuvre, drawings, torques=torques)
            deviations = np.sqrt(np.diag(gather @ covariance[::10, ::10] @ gather.T))
            outcome[f"regressors, {suffix}"] = gather @ estimate[::10] / true - 1.0, deviations / true
            if torques not in first:
                first[torques] = Posterior.of(model_of(drawings, torques=torques), [manoeuvre])
            posterior = with_manoeuvres(first[torques], [manoeuvre])
            z = true_point(posterior, truth, START_RATE)
            optimum = fit(relinearised(posterior, z), z)
            masses = np.array([body.mass for body in posterior.unknowns.inertials(optimum.z)])
            spread = [prior.spread for prior in posterior.model.priors]
            slope = np.zeros((4, posterior.size))
            slope[:, : 10 * len(names) : 10] = gather * (2.0 * np.array(spread) * masses)
            deviations = np.sqrt(np.diag(slope @ optimum.covariance @ slope.T))
            outcome[f"integral of the motion, {suffix}"] = gather @ masses / true - 1.0, deviations / true
        return outcome

    trials = run_trials(recording, range(count), seed=seed, progress=lambda text: progress(f"methods: {text}"))
    outcomes = trials.complete()
    methods = []
    for title in outcomes[0]:
        errors, believed = (np.array([outcome[title][part] for outcome in outcomes]) for part in (0, 1))
        methods.append(Method(title, errors, believed))
    return tuple(methods)


def _gather(truth: Robot) -> Floats:
    """Return the matrix that sums masses of bodies, one row per quantity."""
    names = bodies(truth)
    arm = [name for name in names if name not in (BASE, LOAD)]
    groups = ((BASE,), (LOAD,), arm, names)
    return np.array([[float(name in group) for name in names] for group in groups])
