"""The whole system identified from one recorded manoeuvre of the independent simulator, sampled with emcee."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesid import Identification, Manoeuvre, Posterior, Robot, identify
from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.whole_system.setting import COULOMB, VISCOUS, bodies, model_of

__all__ = ["Sampled", "distance", "sampled", "true_point"]

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Sampled:
    """One identification.

    Attributes
    ----------
    title : str
        Sensors in use.
    result : Identification
    distance : float
        Squared Mahalanobis distance of the true bodies from the mean, in coordinates linear in the parameters.
    p_value : float
        Of a distance that large, under a normal posterior.
    truth : mapping of str to (10,) array
        Mass, centre of mass, inertia about it of every body.
    """

    title: str
    result: Identification
    distance: float
    p_value: float
    truth: dict[str, Floats]


def sampled(
    title: str,
    truth: Robot,
    drawings: Robot,
    manoeuvre: Manoeuvre,
    rate: Floats,
    *,
    torques: bool,
    seed: int,
    effective_samples: float,
    progress: Callable[[str], None],
) -> Sampled:
    """Identify all bodies; ``rate`` is the true initial rate of the base, base axes [rad/s]."""
    posterior = Posterior.of(model_of(drawings, torques=torques), [manoeuvre])

    def tell(fraction: float, text: str) -> None:
        progress(f"{title}: {text}")

    result = identify(posterior, seed, effective_samples=effective_samples, progress=tell)
    z = true_point(posterior, truth, rate)
    count = 10 * len(posterior.model.priors)
    linear = posterior.unknowns.to_linear(result.chains.flat)[:, :count]
    square = distance(posterior.unknowns.to_linear(z[None])[0, :count], linear.mean(axis=0), np.cov(linear.T))
    described = {name: mass_com_inertia(truth.link(name).inertial.vector) for name in bodies(truth)}
    return Sampled(title, result, square, float(stats.chi2.sf(square, count)), described)


def true_point(posterior: Posterior, truth: Robot, rate: Floats) -> Floats:
    """Return the coordinates of the truth."""
    priors = posterior.model.priors
    z = posterior.unknowns.coordinates([truth.link(prior.name).inertial for prior in priors], rate[None])
    frictions = 2 * sum(effect.uses("friction") for effect in posterior.model.effects)
    if frictions:
        widths = [p.sigma for effect in posterior.model.effects for p in effect.parameters]
        z[-frictions:] = np.tile([COULOMB, VISCOUS], frictions // 2) / widths
    return z


def distance(point: Floats, mean: Floats, covariance: Floats) -> float:
    """Squared Mahalanobis distance."""
    scale = 1.0 / np.sqrt(np.diag(covariance))
    d = (point - mean) * scale
    return float(d @ np.linalg.solve(covariance * np.outer(scale, scale), d))
