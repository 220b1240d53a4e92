"""Section 4.1 without noise and without prior, from the paper's initial guess."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.simulated_recordings import simulate_recordings
from bayesid.recording.joint_motion import Excitation
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Kind, Sensor, White
from studies.base_body import paper
from studies.base_body.physical import physical_sd, physical_slope
from studies.base_body.setting import POOR, blank, heavy_arm
from studies.common.ets7 import BASE, RADIUS, ets7, excitation

__all__ = ["ACCELEROMETER", "NoiseFree", "guess_model", "identify_exact", "record", "run_noise_free"]

Floats = NDArray[np.floating]

ACCELEROMETER = (0.4, 0.3, 0.8)
"""Mounting point [m]; the paper does not state one."""

WEIGHT = 1e-5
"""Of a rate [rad/s] and an acceleration [m/s2] in the sum of squares; the paper weighs its SI units alike."""

STEP, TRUTH_STEP = 1.0, 0.25
"""Integration steps of the fit and of its data [s]: different, so that no error of the integration cancels."""

KINDS = (Kind.RATE, Kind.ACCEL)


@dataclass(frozen=True)
class NoiseFree:
    """One noise-free identification.

    Attributes
    ----------
    estimate : (10,) array
        In the order of `paper.TRUTH`.
    error : (10,) array
        Relative to the truth.
    misfit : float
        Root mean square residual, in units of `WEIGHT`.
    uncertainty : (10,) array
        Relative sd of each parameter if every sample had white noise of `WEIGHT`.
    evaluations : int
    """

    estimate: Floats
    error: Floats
    misfit: float
    uncertainty: Floats
    evaluations: int
    peak: Floats
    recording: Recording

    @property
    def worst(self) -> float:
        """Largest relative error of the ten parameters."""
        return float(np.abs(self.error).max())


def guess_model(robot: Robot | None = None, *, gradient: bool = True, rate_sigma: float = 0.0) -> Model:
    """Return the model whose prior centre, where fits start, is the paper's initial guess."""
    return Model(
        robot=ets7() if robot is None else robot,
        sensors=(Sensor(Kind.RATE, White(WEIGHT)), Sensor(Kind.ACCEL, White(WEIGHT), position=ACCELEROMETER)),
        priors=(BodyPrior(BASE, paper.body(paper.GUESS), 1.0),),
        orbit=Orbit(RADIUS),
        effects=(GravityGradient(),) if gradient else (),
        rate_sigma=rate_sigma,
    )


def record(model: Model, motions: Sequence[Excitation], step: float = TRUTH_STEP) -> list[Recording]:
    """Simulate noise-free recordings of the true base with the integration step of the truth."""
    planned = [Manoeuvre(blank(motion, KINDS), motion) for motion in motions]
    simulator = Posterior.of(replace(model, rate_sigma=0.0), planned, step=step)
    return simulate_recordings(simulator, z=simulator.unknowns.coordinates([paper.body(paper.TRUTH)]))


def identify_exact(posterior: Posterior) -> NoiseFree:
    """Identify the base by least squares alone, from the paper's initial guess."""
    optimum = fit(posterior, posterior.starting_point())
    estimate = mass_com_inertia(np.asarray(posterior.unknowns.values_at(optimum.z).inertial))
    slope = physical_slope(posterior, optimum.z)
    recording = posterior.manoeuvres[0].recording
    return NoiseFree(
        estimate=estimate,
        error=estimate / paper.TRUTH - 1.0,
        misfit=float(np.sqrt(optimum.chi2 / posterior.samples)),
        uncertainty=physical_sd(slope, optimum.covariance) / np.abs(paper.TRUTH),
        evaluations=optimum.evaluations,
        peak=np.abs(recording.vector("rate")[1]).max(axis=0),
        recording=recording,
    )


def run_noise_free(*, full: bool) -> dict[str, NoiseFree]:
    """Run the paper's cases; ``full`` adds the heavier arm, an unknown initial rate and more."""
    motions = [excitation(q) for q in (paper.EXCITATION, POOR)]
    model = guess_model()
    well, poor = (Manoeuvre(own, motion) for own, motion in zip(record(model, motions), motions, strict=True))
    posterior = Posterior.of(model, [well], step=STEP, flat_prior=True)
    blind = Posterior.of(guess_model(gradient=False), [well], step=STEP, flat_prior=True)
    cases = {
        "well": identify_exact(posterior),
        "poor": identify_exact(with_manoeuvres(posterior, [poor])),
        "well, no gradient": identify_exact(blind),
    }
    if full:
        cases["poor, no gradient"] = identify_exact(with_manoeuvres(blind, [poor]))
        free = guess_model(rate_sigma=0.1)
        cases["well, rate unknown"] = identify_exact(Posterior.of(free, [well], step=STEP, flat_prior=True))
        heavy = guess_model(heavy_arm(ets7()))
        own = Manoeuvre(record(heavy, motions[:1])[0], motions[0])
        cases["well, arm 1/7"] = identify_exact(Posterior.of(heavy, [own], step=STEP, flat_prior=True))
    return cases
