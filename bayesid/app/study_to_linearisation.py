"""Linearisation point for the practical identifiability of a study: a fit of its recordings, or a prediction.

Planned motion without readings gives a prediction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._io.words import counted
from bayesid.app.schema import Study
from bayesid.app.study_to_encoders import ASSUMED, assume_missing, encoder_noise
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.design.predicted_posterior import planned_posterior
from bayesid.identifiability.hypothetical_experiment import blanked, has
from bayesid.identifiability.practical_identifiability import Basis
from bayesid.inference.conventions import refuse_conventions
from bayesid.inference.mode import Optimum, fit, maximise
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.simulation.model import Manoeuvre, Model

__all__ = [
    "LinearisationPoint",
    "fitted_point",
    "lacking_sensors",
    "missing_part",
    "planned_manoeuvres",
    "prepare",
]

# deviation of chi-square from its mean, in standard deviations of chi-square, that noise alone rarely reaches
MISFIT = 3.0


@dataclass(frozen=True)
class LinearisationPoint:
    """Posterior with the mode at which it is linearised."""

    basis: Basis  #: basis of the posterior, a fit or a prediction
    statement: str  #: description of the basis in sentences
    posterior: Posterior  #: posterior with its noise linearised at the mode
    optimum: Optimum  #: mode of the posterior


def missing_part(study: Study) -> str:
    """Return what a study lacks for practical identifiability, an empty text if nothing."""
    if not study.recordings:
        return "the study names no [[recordings]], not even a planned motion of the joints"
    return "" if study.unknowns.bodies else "the study has no [unknowns] bodies"


def prepare(study: Study, seed: int) -> LinearisationPoint:
    """Return the linearisation point of a study.

    The recordings are fitted. Where they lack the readings of a declared sensor, their motion is taken as planned.

    Parameters
    ----------
    study : Study
        Study with at least one recording and one unknown body.
    seed : int
        Seed of the random starts of the fit.
    """
    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    if lacking := lacking_sensors(model, manoeuvres):
        return _predicted(study, model, manoeuvres, lacking)
    refuse_conventions(model, manoeuvres)
    posterior = Posterior.of(model, manoeuvres)
    refuse_wrong_units(posterior)
    return fitted_point(posterior, np.random.default_rng(seed))


def fitted_point(posterior: Posterior, rng: np.random.Generator) -> LinearisationPoint:
    """Return the linearisation point of a posterior, which is fitted.

    Parameters
    ----------
    posterior : Posterior
    rng : numpy.random.Generator
        Source of the random starts of the fit.
    """
    refined, optimum = maximise(posterior, rng)
    statement = (
        f"The model was fitted to {_count(posterior.manoeuvres)} with {refined.samples} scalar sensor samples; "
        f"chi-square is {optimum.chi2 / refined.samples:.3f} per sample."
    )
    if optimum.chi2 - refined.samples > MISFIT * np.sqrt(2.0 * refined.samples):
        statement += " The model does not explain the data, but the results below assume it: run a diagnosis first."
    return LinearisationPoint(Basis.FIT, statement, refined, optimum)


def _predicted(
    study: Study, model: Model, manoeuvres: Sequence[Manoeuvre], lacking: Sequence[str]
) -> LinearisationPoint:
    planned, assumed = planned_manoeuvres(study, model, manoeuvres)
    posterior = planned_posterior(model, planned)
    centre = np.zeros(posterior.size)
    posterior = relinearised(posterior, centre)
    statement = (
        f"This is a prediction: {_count(manoeuvres)} without {', '.join(lacking)} cannot be fitted. "
        "The motion is assumed to be as planned, and the sensors to read the prediction of the prior's centre with the "
        "declared noise."
    )
    if assumed:
        statement += f" The study gives no encoder noise for {', '.join(assumed)}: {ASSUMED:g} rad or m is assumed."
    return LinearisationPoint(Basis.PREDICTION, statement, posterior, fit(posterior, centre))


def _count(manoeuvres: Sequence[Manoeuvre]) -> str:
    return counted(len(manoeuvres), "recording")


def lacking_sensors(model: Model, manoeuvres: Sequence[Manoeuvre]) -> list[str]:
    """Return the declared sensors that some recording does not hold.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    """
    lacking = [
        sensor.kind.value
        for sensor in model.sensors
        if not all(has(manoeuvre.recording, sensor.kind) for manoeuvre in manoeuvres)
    ]
    columns = [f"torque.{joint}" for joint in (model.torque.joints if model.torque is not None else ())]
    recorded = all(column in manoeuvre.recording.channels for manoeuvre in manoeuvres for column in columns)
    return lacking if recorded else [*lacking, "torque"]


def planned_manoeuvres(
    study: Study, model: Model, manoeuvres: Sequence[Manoeuvre]
) -> tuple[list[Manoeuvre], list[str]]:
    """Return the manoeuvres of a study with placeholders for the readings that they lack, to be simulated.

    A plan has no noise from which that of the encoders could be estimated. Where the study does not give it either it
    is assumed, for the joints of the list.

    Parameters
    ----------
    study : Study
    model : Model
    manoeuvres : sequence of Manoeuvre
    """
    robot, (noise, assumed) = model.robot, assume_missing(encoder_noise(study, model.robot))
    planned = []
    for section, manoeuvre in zip(study.recordings, manoeuvres, strict=True):
        motion = MeasuredMotion.from_recording(
            manoeuvre.recording, robot, sigma=noise, start=section.start, blocks_per_second=manoeuvre.blocks_per_second
        )
        planned.append(blanked(replace(manoeuvre, motion=motion), model.sensors, model.torque))
    return planned, assumed
