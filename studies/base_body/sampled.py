"""The posterior with realistic sensors, sampled by emcee; and what encoders leave of a good accelerometer."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesid.inference import Identification, choose_parameterisation, importance_sample, maximise, sample
from bayesid.inference.mode import fit
from bayesid.inference.posterior import Posterior
from bayesid.inference.simulated_recordings import simulate_recordings
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.simulation.effects import AccelBias, GravityGradient
from bayesid.simulation.model import Manoeuvre, Model, spread_links
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Kind, Sensor, White
from studies.base_body import paper
from studies.base_body.information import BIAS, STAR
from studies.base_body.noise_free import ACCELEROMETER
from studies.base_body.physical import physical_sd, physical_slope
from studies.base_body.setting import blank
from studies.common.ets7 import BASE, RADIUS, ets7, excitation

__all__ = ["ACCEL", "ENCODER", "encoder_grades", "sample_posterior"]

Floats = NDArray[np.float64]

ACCEL = 1e-5
"""Noise of the accelerometer per sample [m/s2], the coarsest the paper names."""

ENCODER = 1e-6
"""Noise of the joints' encoders [rad]; the paper gives none."""

LONGEST = 500
"""Steps of the ensembles at most."""

KINDS = (Kind.ACCEL, Kind.ATTITUDE)


def _model(accel: float, centre: InertialParameters, arm_spread: float) -> Model:
    """Return the model of a star sensor, an accelerometer with an unknown bias and an unknown initial rate."""
    robot = ets7()
    return Model(
        robot=robot,
        sensors=(
            Sensor(Kind.ACCEL, White(accel), position=ACCELEROMETER),
            Sensor(Kind.ATTITUDE, White(STAR)),
        ),
        priors=(BodyPrior(BASE, centre, 1.0), *spread_links(robot, arm_spread, (BASE,))),
        orbit=Orbit(RADIUS),
        effects=(GravityGradient(), AccelBias(BIAS)),
    )


def _planned(seed: int) -> Manoeuvre:
    """Return the paper's manoeuvre with recorded, hence noisy and smoothed, joints."""
    rng, motion, robot = np.random.default_rng(seed), excitation(paper.EXCITATION), ets7()
    exact = blank(motion, KINDS, robot)
    noisy = {
        key: values + ENCODER * rng.normal(size=len(values)) if key.startswith("position") else values
        for key, values in exact.channels.items()
    }
    recording = Recording(exact.name, None, exact.time, noisy)
    smooth = MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER})
    return Manoeuvre(recording, smooth, attitude_sigma=STAR)


def _simulated(seed: int) -> Manoeuvre:
    """Return the same manoeuvre with what the true robot's sensors read while its joints moved exactly."""
    planned = _planned(seed)
    exact = replace(planned, motion=excitation(paper.EXCITATION))
    simulator = Posterior.of(_model(ACCEL, paper.body(paper.TRUTH), 0.0), [exact], step=0.5)
    recording = simulate_recordings(simulator, np.random.default_rng(seed + 1), np.zeros(simulator.size))[0]
    return replace(planned, recording=recording)


def sample_posterior(arm_spread: float, seed: int, effective_samples: float = 1000.0) -> Identification:
    """Identify the base from the paper's initial guess by emcee.

    The mode is first sought with the arm at its nominal values: from so far a guess, letting the arm give way at once
    leads least squares along a curved ridge of bodies that no prior of the arm would allow.

    Parameters
    ----------
    arm_spread : float
        Uncertainty of the links in log-Cholesky coordinates; 0 for an exactly known arm.
    """
    manoeuvre, guess = _simulated(seed), paper.body(paper.GUESS)
    exact = Posterior.of(_model(ACCEL, guess, 0.0), [manoeuvre])
    start = fit(exact, np.zeros(exact.size)).z
    posterior = exact
    if arm_spread > 0.0:
        posterior = Posterior.of(_model(ACCEL, guess, arm_spread), [manoeuvre])
        links = np.zeros(posterior.size - exact.size)
        start = np.concatenate([start[:10], links, start[10:]])
    draws, weights, walkers = np.random.SeedSequence(seed).spawn(3)
    refined, optimum = maximise(posterior, np.random.default_rng(draws), start)
    rng = np.random.default_rng(weights)
    parameterisation = choose_parameterisation(refined, optimum, rng)
    evidence = importance_sample(parameterisation, optimum, rng)
    began = time.perf_counter()
    chains = sample(parameterisation, optimum, walkers, effective_samples=effective_samples, max_steps=LONGEST)
    return Identification(refined, optimum, evidence, chains, time.perf_counter() - began)


def encoder_grades(grades: Sequence[float], seed: int) -> list[Floats]:
    """Relative sd of the ten quantities for accelerometers of these grades when the joints' motion is measured too."""
    planned, rows = _planned(seed), []
    for grade in grades:
        posterior = Posterior.of(_model(grade, paper.body(paper.TRUTH), 0.0), [planned], step=1.0)
        z = np.zeros(posterior.size)
        jacobian = posterior.jacobian(z)
        covariance = np.linalg.inv(jacobian.T @ jacobian)
        rows.append(physical_sd(physical_slope(posterior, z), covariance) / np.abs(paper.TRUTH))
    return rows
