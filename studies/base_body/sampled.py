"""The posterior with realistic sensors, sampled by emcee, and the limit that encoders set to a good accelerometer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference import Identification
from bayesid.inference.identification import identify
from bayesid.inference.mode import fit
from bayesid.inference.posterior import Posterior
from bayesid.inference.simulated_recordings import simulate_recordings
from bayesid.recording.joint_motion import sample_joints
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import SensorKind
from studies.base_body import paper
from studies.base_body.information import STAR
from studies.base_body.setting import planned
from studies.common.ets7 import ACCEL, ENCODER, ets7, excitation
from studies.common.flight import smoothed
from studies.common.models import base_model

__all__ = ["encoder_grades", "sample_posterior"]

LONGEST = 500
"""Largest number of steps of the ensembles."""


def _model(accel: float, centre: InertialParameters, arm_spread: float) -> Model:
    """Return the model of a star sensor, an accelerometer with an unknown bias and an unknown initial rate."""
    return base_model({SensorKind.ACCEL: accel, SensorKind.ATTITUDE: STAR}, centre=centre, arm_spread=arm_spread)


def _planned(seed: int) -> Manoeuvre:
    """Return the paper's manoeuvre with joints that were recorded with noise and smoothed."""
    rng, motion, robot = np.random.default_rng(seed), excitation(paper.EXCITATION), ets7()
    blank = planned(_model(ACCEL, paper.body(paper.TRUTH), 0.0), motion).recording
    joints = sample_joints(motion, robot, blank.time)
    noisy = {key: values + ENCODER * rng.normal(size=len(values)) for key, values in joints.items()}
    return replace(smoothed("manoeuvre", blank.time, {**noisy, **blank.channels}, robot, ENCODER), attitude_sigma=STAR)


def _simulated(seed: int) -> Manoeuvre:
    """Return the same manoeuvre with the readings of the true robot's sensors while its joints moved exactly."""
    manoeuvre = _planned(seed)
    exact = replace(manoeuvre, motion=excitation(paper.EXCITATION))
    simulator = Posterior.of(_model(ACCEL, paper.body(paper.TRUTH), 0.0), [exact], step=0.5)
    recording = simulate_recordings(simulator, np.random.default_rng(seed + 1), np.zeros(simulator.size))[0]
    return replace(manoeuvre, recording=recording)


def sample_posterior(arm_spread: float, seed: int) -> Identification:
    """Identify the base from the paper's initial guess by emcee.

    The mode is first sought with the arm at its nominal values. From so far a guess, a fit that may change the arm at
    once follows a curved ridge to bodies that no prior of the arm would allow.

    Parameters
    ----------
    arm_spread : float
        Relative width of the links' priors; 0 for an exactly known arm.
    seed : int
        Seed of all random numbers.
    """
    manoeuvre, guess = _simulated(seed), paper.body(paper.GUESS)
    posterior = Posterior.of(_model(ACCEL, guess, 0.0), [manoeuvre])
    start = fit(posterior, np.zeros(posterior.size)).z
    if arm_spread > 0.0:
        posterior = Posterior.of(_model(ACCEL, guess, arm_spread), [manoeuvre])
        start = np.concatenate([start[:10], np.zeros(posterior.size - len(start)), start[10:]])
    return identify(posterior, seed, start=start, effective_samples=1000.0, max_steps=LONGEST)


def encoder_grades(grades: Sequence[float], seed: int) -> list[Floats]:
    """Return relative standard deviations (10,) by grade of the accelerometer where the joints are measured too."""
    manoeuvre, rows = _planned(seed), []
    for grade in grades:
        posterior = Posterior.of(_model(grade, paper.body(paper.TRUTH), 0.0), [manoeuvre], step=1.0)
        rows.append(Knowledge.at(posterior, np.zeros(posterior.size)).sd / np.abs(paper.TRUTH))
    return rows
