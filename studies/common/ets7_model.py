"""ETS-VII as the models of several studies state it: sensors, orbit, and the posture with the wrist extended."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bayesid import BodyPrior, Effect, Model, Orbit, Robot, Sensor, SensorKind, White
from bayesid._math.arrays import Floats
from bayesid.simulation.effects import GravityGradient
from studies.common.ets7 import ACCEL, ACCELEROMETER, ENCODER, RADIUS, RATE, extended_wrist

__all__ = ["NOISE", "extended_start", "motion_sensors", "orbiting_model"]

NOISE = {"position": ENCODER, "rate": RATE, "accel": ACCEL}
"""Family of channels -> noise per sample of a recording [rad, rad/s, m/s2], in the order in which it is drawn."""


def motion_sensors(rate: float = RATE, accel: float = ACCEL) -> tuple[Sensor, Sensor]:
    """Return rate sensor and accelerometer with white noise per sample [rad/s, m/s2]."""
    return Sensor(SensorKind.RATE, White(rate)), Sensor(SensorKind.ACCEL, White(accel), position=ACCELEROMETER)


def orbiting_model(robot: Robot, priors: Sequence[BodyPrior], *effects: Effect, **options: Any) -> Model:
    """Return a model with rate sensor and accelerometer on the orbit of ETS-VII, gravity gradient included.

    Parameters
    ----------
    robot : Robot
    priors : sequence of BodyPrior
    *effects
        Effects beside the gravity gradient.
    **options
        Further arguments of `bayesid.Model`.
    """
    return Model(robot, motion_sensors(), tuple(priors), Orbit(RADIUS), (GravityGradient(), *effects), **options)


def extended_start() -> Floats:
    """Return the joint positions with the first three at zero and the wrist extended, shape (6,) [rad]."""
    return np.array([0.0, 0.0, 0.0, *extended_wrist()])
