"""Noise of the joints' encoders, as a study states it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from bayesid.app.named_joints import named_joint
from bayesid.app.schema import Study
from bayesid.robot.robot import Robot

__all__ = ["ASSUMED", "JointNoise", "assume_missing", "encoder_noise"]

ASSUMED = 1e-6
"""Noise of an encoder for which neither study nor data give a value, that of a good encoder [rad or m]."""

JointNoise = dict[int, dict[str, float | None]]
"""Noise of position (0), velocity (1), acceleration (2) by joint; None where it is to be estimated from the data."""


def encoder_noise(study: Study, robot: Robot) -> JointNoise:
    """Return the noise per sample of all joints of a robot.

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
