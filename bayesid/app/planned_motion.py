"""Recordings that lack the readings of a declared sensor, whose joint motion is taken as planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bayesid.app.schema import Study
from bayesid.app.study_to_encoders import assume_missing, encoder_noise
from bayesid.identifiability.hypothetical_experiment import blanked, has
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["lacking_sensors", "planned_manoeuvres"]


def lacking_sensors(model: Model, manoeuvres: Sequence[Manoeuvre]) -> list[str]:
    """Return the declared sensors that some recording does not hold."""
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
    """
    robot, (noise, assumed) = model.robot, assume_missing(encoder_noise(study, model.robot))
    planned = []
    for section, manoeuvre in zip(study.recordings, manoeuvres, strict=True):
        motion = MeasuredMotion.from_recording(manoeuvre.recording, robot, sigma=noise, start=section.start)
        planned.append(blanked(replace(manoeuvre, motion=motion), model.sensors, model.torque))
    return planned, assumed
