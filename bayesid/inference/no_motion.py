"""Refusal of recordings in which nothing moves: a sampler would look for the prior for minutes, and find it."""

from __future__ import annotations

import numpy as np

from bayesid._io.errors import InputError
from bayesid.inference.posterior import Posterior
from bayesid.recording.recording import WHEEL_SPEED
from bayesid.simulation.sensors import SensorKind

__all__ = ["refuse_no_motion"]

STILL = 1e-3  # range of a joint's motion below which it hardly moves the base [rad or m]
QUIET = 1.5  # standard deviation of readings about their mean, relative to the noise, up to which they are constant
ACTING = (WHEEL_SPEED, "wheel_momentum", "base_force", "base_torque")  # families of columns of what else moves the base


def refuse_no_motion(posterior: Posterior) -> None:
    """Refuse recordings from which nothing is learnt.

    Raises
    ------
    InputError
        If in every recording no joint moves, nothing else acts, and sensors read constants and noise.
    """
    if posterior.manoeuvres and all(_nothing_moves(posterior, index) for index in range(len(posterior.manoeuvres))):
        raise InputError(
            "no joint moves, and the sensors read only constants and noise: the recordings contain no information, and "
            "the posterior equals the prior",
            file=posterior.manoeuvres[0].recording.file,
            remedy="Record a motion; `bayesid design` designs one",
        )


def _nothing_moves(posterior: Posterior, index: int) -> bool:
    recording = posterior.manoeuvres[index].recording
    if posterior.model.torque is not None or posterior.model.sensor(SensorKind.ATTITUDE) is not None:
        return False
    for name, values in recording.channels.items():
        family = name.partition(".")[0]
        if family in ACTING or (family == "position" and np.nanmax(values) - np.nanmin(values) > STILL):
            return False
    for sensor in posterior.model.sensors:
        measured, sigma = posterior.data.measured(index, sensor.kind)[1], posterior.data.sigma(index, sensor.kind)
        if (measured.std(axis=0) > QUIET * sigma).any():
            return False
    return True
