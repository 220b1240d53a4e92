"""ETS-VII with realistic sensors, two sets of limits, and the families of manoeuvres that compete within them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from bayesid import BodyPrior, Kind, Manoeuvre, Model, Orbit, Sensor, White
from bayesid.design import BSplines, Criterion, Limits, PaperExcitation, Plan, Problem, Tip, TrajectoryFamily
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.effects import AccelBias, GravityGradient
from studies.common import flight
from studies.common.ets7 import ACCEL, ACCELEROMETER, BASE, BIAS, ENCODER, RADIUS, RATE, ets7, extended_wrist
from studies.truth.mujoco import Truth

__all__ = ["DURATION", "FAST", "fly", "model_of", "paper_family", "problem", "recorded", "splines"]

Floats = NDArray[np.floating]

DURATION = 120.0
"""Length of every manoeuvre [s]."""

INTERVAL = 0.5
"""Time between samples of all sensors [s]."""

REACH = 2.6
"""Joint range allowed to all, either way [rad]; the paper's printed optimum needs 2.5, more than its own limit."""

FAST = Limits(joint_speed=0.4)
"""No rule for the tip: what the paper's printed optimum needs at this duration [rad/s]."""

STEP = 0.1
"""Integration step of MuJoCo [s]."""


@cache
def model_of() -> Model:
    """Return the model: base unknown, arm known, the accelerometer's bias and the initial rate to be marginalised."""
    robot = ets7()
    robot = replace(robot, joints=tuple(replace(joint, lower=-REACH, upper=REACH) for joint in robot.joints))
    sensors = (Sensor(Kind.RATE, White(RATE)), Sensor(Kind.ACCEL, White(ACCEL), position=ACCELEROMETER))
    base = BodyPrior(BASE, robot.link(BASE).inertial, 1.0)
    return Model(robot, sensors, (base,), Orbit(RADIUS), (GravityGradient(), AccelBias(BIAS)))


def posture() -> Floats:
    """Return the joints before and after: the wrist extended."""
    return np.array([0.0, 0.0, 0.0, *extended_wrist()])


def paper_family() -> PaperExcitation:
    """Return (27) on the first three joints."""
    return PaperExcitation(posture(), DURATION, moving=(0, 1, 2))


def splines(points: int = 8) -> BSplines:
    """Return quintic splines on all joints."""
    return BSplines(posture(), range(6), DURATION, points)


def problem(family: TrajectoryFamily, limits: Limits, criteria: tuple[Criterion, ...]) -> Problem:
    """Return a design problem of a family within limits."""
    model = model_of()
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, "tip"), step=2.0, thinning=2)
    return Problem(plan, limits, criteria)


def fly(motion: Motion) -> Truth:
    """Fly a manoeuvre in MuJoCo and return its readings without noise."""
    return flight.fly(ets7(), motion, np.arange(0.0, DURATION + 1e-9, INTERVAL), step=STEP)


def recorded(truth: Truth, rng: np.random.Generator) -> Manoeuvre:
    """Record a flight with fresh noise of all sensors and encoders, and a fresh bias of the accelerometer."""
    robot = model_of().robot
    joints = [joint.name for joint in robot.joints]
    channels = flight.readings(truth, joints, {"position": ENCODER}, rng)
    biased = truth._replace(accel=truth.accel + BIAS * rng.standard_normal(3))
    channels |= flight.readings(biased, joints, {"rate": RATE, "accel": ACCEL}, rng)
    return flight.smoothed("manoeuvre", truth.times, channels, robot, ENCODER)
