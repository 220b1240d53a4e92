"""Section 4.1 without noise and without prior, from the paper's initial guess."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.simulated_recordings import simulate_recordings
from bayesid.recording.joint_motion import Excitation
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import SensorKind
from studies.base_body import paper
from studies.base_body.setting import POOR, heavy_arm, planned
from studies.common.ets7 import ets7, excitation
from studies.common.models import base_model

__all__ = ["NoiseFree", "guess_model", "identify_exact", "run_noise_free"]

WEIGHT = 1e-5
"""Standard deviation that weights a rate [rad/s] and an acceleration [m/s2]; the paper weights its SI units alike."""

STEP, TRUTH_STEP = 1.0, 0.25
"""Integration steps of the fit and of its data [s], which differ so that no error of the integration cancels."""


@dataclass(frozen=True)
class NoiseFree:
    """One noise-free identification.

    Attributes
    ----------
    estimate : (10,) array
        Estimated quantities in the order of `paper.TRUTH`.
    misfit : float
        Root mean square residual, in units of `WEIGHT`.
    uncertainty : (10,) array
        Standard deviations that white noise of `WEIGHT` per sample would leave, relative to the true quantities.
    recording : Recording
        Data that were fitted.
    """

    estimate: Floats
    misfit: float
    uncertainty: Floats
    recording: Recording

    @property
    def error(self) -> Floats:
        """Errors of the estimate relative to the truth, shape (10,)."""
        return self.estimate / paper.TRUTH - 1.0

    @property
    def worst(self) -> float:
        """Largest relative error of the ten quantities."""
        return float(np.abs(self.error).max())

    @property
    def peak(self) -> Floats:
        """Largest rate about each axis of the base [rad/s], shape (3,)."""
        return np.abs(self.recording.vector("rate")[1]).max(axis=0)


def guess_model(robot: Robot | None = None, *, gradient: bool = True, rate_sigma: float = 0.0) -> Model:
    """Return the model whose prior is centred on the paper's initial guess, where fits start."""
    return base_model(
        {SensorKind.RATE: WEIGHT, SensorKind.ACCEL: WEIGHT},
        robot=robot,
        centre=paper.body(paper.GUESS),
        gradient=gradient,
        bias=0.0,
        rate_sigma=rate_sigma,
    )


def simulated(model: Model, motions: Sequence[Excitation]) -> list[Manoeuvre]:
    """Return manoeuvres with noise-free recordings of the true base, simulated with `TRUTH_STEP`."""
    simulator = Posterior.of(model, [planned(model, motion) for motion in motions], step=TRUTH_STEP)
    truth = simulator.unknowns.coordinates([paper.body(paper.TRUTH)])
    recordings = simulate_recordings(simulator, z=truth)
    return [replace(item, recording=made) for item, made in zip(simulator.manoeuvres, recordings, strict=True)]


def identify_exact(posterior: Posterior) -> NoiseFree:
    """Identify the base by least squares alone, from the paper's initial guess."""
    optimum = fit(posterior, posterior.starting_point())
    knowledge = Knowledge.at(posterior, optimum.z)
    return NoiseFree(
        estimate=knowledge.values,
        misfit=float(np.sqrt(optimum.chi2 / posterior.samples)),
        uncertainty=knowledge.sd / np.abs(paper.TRUTH),
        recording=posterior.manoeuvres[0].recording,
    )


def run_noise_free(*, full: bool) -> dict[str, NoiseFree]:
    """Run the paper's cases; ``full`` adds the heavier arm, an unknown initial rate and more."""
    motions = [excitation(q) for q in (paper.EXCITATION, POOR)]
    well, poor = simulated(guess_model(), motions)
    posterior = _flat(guess_model(), well)
    no_gradient = _flat(guess_model(gradient=False), well)
    cases = {
        "well": identify_exact(posterior),
        "poor": identify_exact(with_manoeuvres(posterior, [poor])),
        "well, no gradient": identify_exact(no_gradient),
    }
    if full:
        cases["poor, no gradient"] = identify_exact(with_manoeuvres(no_gradient, [poor]))
        cases["well, rate unknown"] = identify_exact(_flat(guess_model(rate_sigma=0.1), well))
        heavy = guess_model(heavy_arm(ets7()))
        cases["well, arm 1/7"] = identify_exact(_flat(heavy, simulated(heavy, motions[:1])[0]))
    return cases


def _flat(model: Model, manoeuvre: Manoeuvre) -> Posterior:
    return Posterior.of(model, [manoeuvre], step=STEP, flat_prior=True)
