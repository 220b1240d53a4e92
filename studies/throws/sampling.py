"""Samples of the joint posterior of a few throws, to see whether the Laplace approximation may be trusted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesid import BodyPrior, Manoeuvre, MeasuredMotion, Posterior
from bayesid.inference import identify
from bayesid.inference.body_quantities import bodies_of
from studies.throws.data import Timing, read_throws
from studies.throws.model import STEP, Settings, build_model
from studies.throws.start import guess

__all__ = ["Sampled", "sample_jointly"]

Floats = NDArray[np.floating]

MAX_STEPS = 800
"""Of each ensemble."""

COUNT = 2
"""Throws sampled together: each brings its knots and six more unknowns of its own."""


@dataclass(frozen=True)
class Sampled:
    """Principal moments of a body with the device, by emcee and by the Laplace approximation [kg m2].

    Attributes
    ----------
    mean, sd, laplace_mean, laplace_sd : (3,) array
    unknowns : int
    effective_samples, r_hat, acceptance : float
    converged : bool
    """

    body: str
    throws: int
    unknowns: int
    mean: Floats
    sd: Floats
    laplace_mean: Floats
    laplace_sd: Floats
    effective_samples: float
    r_hat: float
    acceptance: float
    evaluations: int
    converged: bool


def sample_jointly(folder: Path, body: str, settings: Settings, timing: Timing, seed: int) -> Sampled:
    """Sample the extended model of the first throws of a body, everything unknown at once.

    The prior's centre is the regression's and its width 10 %: as wide as the sampler needs, and narrow enough for the
    mass, which the motion does not tell, not to stretch the posterior.
    """
    recordings = read_throws(folder, body, timing, COUNT)
    model = build_model(body, settings, timing.duration)
    centre = guess(recordings, model.priors[0].centre)
    model = replace(model, priors=(BodyPrior("base_link", centre, 0.1),))
    manoeuvres = [
        Manoeuvre(recording, MeasuredMotion.from_recording(recording, model.robot)) for recording in recordings
    ]
    posterior = Posterior.of(model, manoeuvres, step=STEP)
    found = identify(posterior, seed, effective_samples=1000.0, max_steps=MAX_STEPS)
    draws = found.chains.flat
    rng = np.random.default_rng(seed)
    laplace = rng.multivariate_normal(found.optimum.z, found.optimum.covariance, size=4000)
    ours = _moments(found.posterior, np.asarray(draws[:: max(1, len(draws) // 20000)]))
    theirs = _moments(found.posterior, laplace)
    return Sampled(
        body=body,
        throws=COUNT,
        unknowns=posterior.size,
        mean=ours.mean(axis=0),
        sd=ours.std(axis=0),
        laplace_mean=theirs.mean(axis=0),
        laplace_sd=theirs.std(axis=0),
        effective_samples=found.chains.effective_samples,
        r_hat=found.chains.r_hat,
        acceptance=found.chains.acceptance,
        evaluations=found.chains.evaluations,
        converged=found.chains.converged,
    )


def _moments(posterior: Posterior, z: Floats) -> Floats:
    xx, yy, zz, xy, xz, yz = bodies_of(posterior, z)["base_link"].values[:, 4:].T
    return np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1))
