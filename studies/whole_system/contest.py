"""The linear regressor method against the integral method (21) on the same noisy recordings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid import Posterior, Robot
from bayesid.inference.optimum import fit
from studies.common.ets7 import BASE
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
    run: Any, truth: Robot, drawings: Robot, *, count: int, seed: int, progress: Callable[[str], None]
) -> tuple[Method, ...]:
    """Estimate all bodies by both methods, from motion alone and with joint torques."""
    streams = np.random.SeedSequence(seed).spawn(count)
    manoeuvres = [record(run, truth, "six joints", np.random.default_rng(stream)) for stream in streams]
    names, gather = bodies(truth), _gather(truth)
    true = gather @ np.array([truth.link(name).inertial.mass for name in names])
    methods = []
    for torques, suffix in ((False, "motion alone"), (True, "with joint torques")):
        errors, believed = [], []
        for manoeuvre in manoeuvres:
            estimate, covariance = regress(manoeuvre, drawings, torques=torques)
            errors.append(gather @ estimate[::10] / true - 1.0)
            believed.append(np.sqrt(np.diag(gather @ covariance[::10, ::10] @ gather.T)) / true)
        methods.append(Method(f"regressors, {suffix}", np.array(errors), np.array(believed)))
        errors, believed = [], []
        posterior: Posterior | None = None
        for number, manoeuvre in enumerate(manoeuvres):
            progress(f"integral method, {suffix}: recording {number + 1} of {count}")
            posterior = (
                Posterior(model_of(drawings, torques=torques), [manoeuvre])
                if posterior is None
                else posterior.with_manoeuvres([manoeuvre])
            )
            z = true_point(posterior, truth, START_RATE)
            optimum = fit(posterior.at(z), z)
            masses = np.array([body.mass for body in posterior.inertials(optimum.z)])
            spread = [prior.spread for prior in posterior.model.priors]
            slope = np.zeros((4, posterior.size))
            slope[:, : 10 * len(names) : 10] = gather * (2.0 * np.array(spread) * masses)
            errors.append(gather @ masses / true - 1.0)
            believed.append(np.sqrt(np.diag(slope @ optimum.covariance @ slope.T)) / true)
        methods.append(Method(f"integral of the motion, {suffix}", np.array(errors), np.array(believed)))
    return tuple(methods)


def _gather(truth: Robot) -> Floats:
    """Return the matrix that sums masses of bodies, one row per quantity."""
    names = bodies(truth)
    arm = [name for name in names if name not in (BASE, LOAD)]
    groups = ((BASE,), (LOAD,), arm, names)
    return np.array([[float(name in group) for name in names] for group in groups])
