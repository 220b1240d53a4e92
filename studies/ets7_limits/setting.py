"""ETS-VII within its flight rules: the robot, what is unknown of it, and the manoeuvres to choose from."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesid import BodyPrior, Kind, Model, Orbit, Robot, Sensor, White
from bayesid.design import BSplines, DOptimal, Limits, Plan, Problem, Tip
from bayesid.simulation.effects import AccelBias, GravityGradient
from bayesid.simulation.model import spread_links

__all__ = ["ACCEL", "ARM_SPREAD", "BASE", "BIAS", "DURATION", "ENCODER", "INTERVAL", "LIMITS", "POINT", "RADIUS"]
__all__ += ["RATE", "START", "TIP", "limits_problem", "model_of"]

BASE, TIP = "base_link", "tip"
RADIUS = 6.916e6
"""Of the orbit, as the paper states it [m]."""

POINT = (0.4, 0.3, 0.8)
"""Of the accelerometer in the base [m]; no source states it."""

START = np.array([0.0, -0.6, 1.0, -0.4, 0.3, 0.0])
"""Joint positions before and after every manoeuvre [rad]; assumed."""

LIMITS = Limits(tip_speed=0.05, tip_rate=float(np.radians(5.0)))
"""Of the experiments on ETS-VII [m/s, rad/s]."""

DURATION, INTERVAL = 240.0, 0.5
"""Of a manoeuvre, and between samples of all sensors [s]."""

RATE, ACCEL, ENCODER = 1e-5, 1e-5, 1e-6
"""Noise per sample that manoeuvres are designed for [rad/s, m/s2], and of the joints [rad]."""

BIAS = 1e-4
"""Prior standard deviation of the accelerometer's constant error [m/s2]."""

SPREAD = 1.0
"""Of the prior of the base: its mass is then uncertain by a factor of e^2."""

ARM_SPREAD = 0.025
"""Of a link where the arm is not known exactly: its mass is then known to 5 %."""

POINTS = 6
"""Free control points of every joint."""


def model_of(arm_spread: float = 0.0, rate: float = RATE, accel: float = ACCEL, spread: float = SPREAD) -> Model:
    """Return the model: base, initial rate and accelerometer bias unknown, and the arm where it has a spread.

    Parameters
    ----------
    arm_spread, spread : float
        Relative width of the priors of the links and of the base.
    rate, accel : float
        Noise per sample [rad/s, m/s2].
    """
    robot = Robot.shipped("ets7")
    sensors = (Sensor(Kind.RATE, White(rate)), Sensor(Kind.ACCEL, White(accel), position=POINT))
    priors = (BodyPrior(BASE, robot.link(BASE).inertial, spread), *spread_links(robot, arm_spread, (BASE,)))
    return Model(robot, sensors, priors, Orbit(RADIUS), (GravityGradient(), AccelBias(BIAS)))


def limits_problem(duration: float = DURATION, points: int = POINTS, thinning: int = 4) -> Problem:
    """Return the problem: six joints on B-splines, the flight rules, the posterior's volume.

    Parameters
    ----------
    duration : float
        [s]
    points : int
        Free control points of every joint.
    thinning : int
        Of the samples that are simulated in the search.
    """
    model = model_of()
    family = BSplines(START, range(len(START)), duration, points)
    tip = Tip.of(model.robot, TIP)
    criteria: Any = (DOptimal(),)  # frozen, which the protocol's attributes are not
    return Problem(Plan(model, family, INTERVAL, tip, thinning=thinning), LIMITS, criteria)
