"""Joints that a study names, and the noise of their encoders as it states it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.app.schema.validation_messages import suggest
from bayesid.robot.robot import Robot

__all__ = ["ASSUMED", "JointNoise", "assume_missing", "encoder_noise", "named_joint"]

ASSUMED = 1e-6
"""Noise of an encoder for which neither study nor data give a value, that of a good encoder [rad or m]."""

JointNoise = dict[int, dict[str, float | None]]
"""Noise of position (0), velocity (1), acceleration (2) by joint; None where it is to be estimated from the data."""


def encoder_noise(study: Study, robot: Robot) -> JointNoise:
    """Return the noise per sample of all joints of a robot.

    Parameters
    ----------
    study : Study
    robot : Robot

    Raises
    ------
    InputError
        If the study states the noise of a joint that the robot lacks.
    """
    encoder = study.sensors.encoder
    for key in ("sigma", "velocity_sigma", "acceleration_sigma"):
        given = getattr(encoder, key)
        for name in given if isinstance(given, Mapping) else ():
            named_joint(name, robot, f"sensors.encoder.{key}.{name}", study.file)
    families: tuple[Literal["position", "velocity", "acceleration"], ...] = ("position", "velocity", "acceleration")
    return {
        derivative: {joint.name: encoder.sigma_of(family, joint.name) for joint in robot.joints}
        for derivative, family in enumerate(families)
    }


def assume_missing(noise: JointNoise) -> tuple[JointNoise, list[str]]:
    """Return the noise with `ASSUMED` for positions whose noise the study omits, and the names of these joints.

    Planned motion has no samples from which the noise could be estimated.
    """
    positions = {joint: ASSUMED if sigma is None else sigma for joint, sigma in noise[0].items()}
    return {**noise, 0: {**positions}}, [joint for joint, sigma in noise[0].items() if sigma is None]


def named_joint(name: str, robot: Robot, place: str, file: Path | None = None) -> int:
    """Return the index in `Robot.joints` of the joint that a study names at a place of its file.

    Parameters
    ----------
    name : str
    robot : Robot
    place : str
        Place in the study file, for the message.
    file : Path, optional
        Study file, for the message.

    Raises
    ------
    InputError
        If the robot has no moving joint of that name.
    """
    names = [joint.name for joint in robot.joints]
    if name not in names:
        hint = suggest(name, names)
        remedy = hint or (f"Choose one of {', '.join(names)}" if names else "Remove it")
        raise InputError(f"the robot has no moving joint '{name}'", file=file, place=place, remedy=remedy)
    return names.index(name)
