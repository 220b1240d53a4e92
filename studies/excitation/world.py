"""ETS-VII with realistic sensors, two sets of limits, and the families of manoeuvres that compete within them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from bayesid import BodyPrior, Manoeuvre, Model
from bayesid.design import BSplines, Criterion, Limits, PaperExcitation, Plan, Problem, Tip, TrajectoryFamily
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.effects import AccelBias
from studies.common import flight
from studies.common.ets7 import BASE, BIAS, ENCODER, TIP, ets7
from studies.common.ets7_model import NOISE, extended_start, orbiting_model
from studies.truth.mujoco import Truth

__all__ = ["DURATION", "FAST", "fly", "model_of", "paper_family", "problem", "recorded", "splines"]

DURATION = 120.0
"""Length of every manoeuvre [s]."""

INTERVAL = 0.5
"""Time between samples of all sensors [s]."""

REACH = 2.6
"""Range of every joint, either way [rad]; the paper's printed optimum needs 2.5, more than the limit it states."""

FAST = Limits(joint_speed=0.4)
"""Limits without a rule for the tip: the joint speed [rad/s] that the paper's printed optimum needs in this time."""

STEP = 0.1
"""Integration step of MuJoCo [s]."""


@cache
def model_of() -> Model:
    """Return the model: base unknown, arm known, the accelerometer's bias and the initial rate to be marginalised."""
    robot = ets7()
    robot = replace(robot, joints=tuple(replace(joint, lower=-REACH, upper=REACH) for joint in robot.joints))
    return orbiting_model(robot, [BodyPrior(BASE, robot.link(BASE).inertial, 1.0)], AccelBias(BIAS))


def paper_family() -> PaperExcitation:
    """Return the paper's motion (27) of the first three joints."""
    return PaperExcitation(extended_start(), DURATION, moving=(0, 1, 2))


def splines(points: int = 8) -> BSplines:
    """Return quintic splines on all joints, with so many free control points each."""
    return BSplines(extended_start(), range(6), DURATION, points)


def problem(family: TrajectoryFamily, limits: Limits, criteria: tuple[Criterion, ...]) -> Problem:
    """Return a design problem of a family within limits."""
    model = model_of()
    return Problem(Plan(model, family, INTERVAL, Tip.of(model.robot, TIP), step=2.0, thinning=2), limits, criteria)


def fly(motion: Motion) -> Truth:
    """Fly a manoeuvre in MuJoCo and return its readings without noise."""
    return flight.fly(ets7(), motion, np.arange(0.0, DURATION + 1e-9, INTERVAL), step=STEP)


def recorded(truth: Truth, rng: np.random.Generator) -> Manoeuvre:
    """Record a flight with fresh noise of all sensors and encoders, and a fresh bias of the accelerometer."""
    robot = model_of().robot
    joints = [joint.name for joint in robot.joints]
    channels = flight.readings(truth, joints, {"position": ENCODER}, rng)
    biased = truth._replace(accel=truth.accel + BIAS * rng.standard_normal(3))
    channels |= flight.readings(biased, joints, {family: NOISE[family] for family in ("rate", "accel")}, rng)
    return flight.smoothed("manoeuvre", truth.times, channels, robot, ENCODER)
