"""ETS-VII within its flight rules: the robot, what is unknown of it, and the manoeuvres to choose from."""

from __future__ import annotations

from typing import Any

from bayesid import BodyPrior, Kind, Model, Orbit, Sensor, White
from bayesid.design import BSplines, DOptimal, Plan, Problem, Tip
from bayesid.simulation.effects import AccelBias, GravityGradient
from bayesid.simulation.model import spread_links
from studies.common.ets7 import ACCEL, ACCELEROMETER, BASE, BIAS, LIMITS, RADIUS, RATE, START, TIP, ets7

__all__ = ["ARM_SPREAD", "DURATION", "INTERVAL", "POINTS", "SPREAD", "limits_problem", "model_of"]

DURATION, INTERVAL = 240.0, 0.5
"""Length of a manoeuvre, and time between samples of all sensors [s]."""

SPREAD = 1.0
"""Relative width of the prior of the base: its mass is then uncertain by a factor of e^2."""

ARM_SPREAD = 0.025
"""Relative width of a link's prior where the arm is not known exactly: its mass is then known to 5 %."""

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
    robot = ets7()
    sensors = (Sensor(Kind.RATE, White(rate)), Sensor(Kind.ACCEL, White(accel), position=ACCELEROMETER))
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
