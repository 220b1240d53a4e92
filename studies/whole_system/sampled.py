"""The whole system identified from one recorded manoeuvre of the independent simulator, sampled with emcee."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayesid import Identification, Manoeuvre, Posterior, Robot, identify
from bayesid._math.arrays import Floats
from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.common.quantities import squared_distances
from studies.whole_system.setting import COULOMB, VISCOUS, bodies, model_of
from studies.whole_system.world import START_RATE

__all__ = ["Sampled", "sampled", "true_point"]


@dataclass(frozen=True)
class Sampled:
    """One identification."""

    title: str  # sensors in use
    result: Identification  # posterior of all bodies
    # squared Mahalanobis distance of the true bodies from the mean, in coordinates linear in the parameters
    distance: float
    # twice the probability of a larger distance under a normal posterior, or of a smaller one if that is less
    p_value: float
    truth: dict[str, Floats]  # true mass, centre of mass and inertia about it of every body


def sampled(
    truth: Robot,
    drawings: Robot,
    manoeuvre: Manoeuvre,
    *,
    torques: bool,
    seed: int,
    effective_samples: float,
    progress: Callable[[str], None],
) -> Sampled:
    """Identify all bodies from a manoeuvre, with or without its joint torques."""
    title = "motion and joint torques" if torques else "motion alone"
    posterior = Posterior.of(model_of(drawings, torques=torques), [manoeuvre])
    result = identify(
        posterior,
        seed,
        effective_samples=effective_samples,
        progress=lambda fraction, text: progress(f"{title}: {text}"),
    )
    count = 10 * len(posterior.model.priors)
    linear = posterior.unknowns.to_linear(result.chains.flat)[:, :count]
    true = posterior.unknowns.to_linear(true_point(posterior, truth)[None])[0, :count]
    distance = float(squared_distances(true - linear.mean(axis=0), np.cov(linear.T)))
    described = {name: mass_com_inertia(truth.link(name).inertial.vector) for name in bodies(truth)}
    p_value = 2.0 * min(stats.chi2.sf(distance, count), stats.chi2.cdf(distance, count))
    return Sampled(title, result, distance, float(p_value), described)


def true_point(posterior: Posterior, truth: Robot) -> Floats:
    """Return the coordinates of the truth."""
    priors, effects = posterior.model.priors, posterior.model.effects
    z = posterior.unknowns.coordinates([truth.link(prior.name).inertial for prior in priors], START_RATE[None])
    frictions = 2 * sum(effect.uses("friction") for effect in effects)
    if frictions:
        widths = [parameter.sigma for effect in effects for parameter in effect.parameters]
        z[-frictions:] = np.tile([COULOMB, VISCOUS], frictions // 2) / widths
    return z
