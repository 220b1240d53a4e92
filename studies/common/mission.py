"""The one mission of `excitation`, `ets7_limits`, `load`, `separating` and `planning`: what they all take as given.

Posture, duration, sensors, encoders, joint ranges, the rule for the tip and the knowledge of the arm are those of this
file, so that the tables of these studies may be laid side by side. The arm is known to 5 % of each link's mass; where a
study also shows the arm known exactly, that is the idealised row.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from bayesid import Manoeuvre, Model, Robot, SensorKind
from bayesid._math.arrays import Floats
from bayesid.design import BSplines, Criterion, Limits, Plan, Problem, Tip, TrajectoryFamily
from bayesid.design.design_result import sample_times
from bayesid.recording.joint_motion import Motion
from bayesid.report.numbers import format_number
from bayesid.robot.body_prior import draw_inertial
from bayesid.simulation.model import spread_links
from studies.common import flight
from studies.common.ets7 import (
    ACCEL,
    BASE,
    BIAS,
    ENCODER,
    EXCURSION,
    INTERVAL,
    LIMITS,
    RAMPS,
    RATE,
    TIP,
    FlightManoeuvre,
    ets7,
    extended_wrist,
)
from studies.common.models import ARM_SPREAD, NOISE, base_model
from studies.truth.mujoco import Truth

DURATION = 120.0  # length of every manoeuvre [s]
POINTS = 8  # number of free control points of every joint's spline

# range of every joint, either way [rad]; the paper's printed optimum needs 2.5, more than the limit it states
REACH = 2.6

ENCODERS = {0: ENCODER}  # noise of the encoders as designs want it: of positions alone

# relative widths of the links' priors by what is known of the arm, the headline first
ROWS = {"arm known to 5 %": ARM_SPREAD, "arm known exactly": 0.0}

TRUTH_STEP = 0.5  # integration step of MuJoCo [s]; rates then differ by 5e-12 rad/s from those with a fifth of it


# the sensors in words, for the setup of a report
SENSORS = (
    f"White noise (1 sigma) at a sampling interval of {INTERVAL:g} s: rates {format_number(RATE)} rad/s, accelerations "
    f"{format_number(ACCEL)} m/s², encoders {format_number(ENCODER)} rad"
)


@cache
def published_robot() -> Robot:
    """Return ETS-VII with the ranges of its joints."""
    robot = ets7()
    return replace(robot, joints=tuple(replace(joint, lower=-REACH, upper=REACH) for joint in robot.joints))


def start() -> Floats:
    """Return the joint positions before and after every manoeuvre, with the wrist extended, shape (6,) [rad]."""
    return np.array([0.0, 0.0, 0.0, *extended_wrist()])


def base_unknown(arm_spread: float = ARM_SPREAD, **options: Any) -> Model:
    """Return the model in which the base is to be identified; rate at the start and accelerometer's bias are unknown.

    Parameters
    ----------
    arm_spread : float; relative width of the links' priors; the arm is known exactly where it is 0
    **options
        Further arguments of `studies.common.models.base_model`.
    """
    options = {"robot": published_robot(), **options}
    return base_model({SensorKind.RATE: RATE, SensorKind.ACCEL: ACCEL}, arm_spread=arm_spread, **options)


def flight_manoeuvre(size: float = 1.0) -> FlightManoeuvre:
    """Return the flight's own manoeuvre, or a part of it, in the middle of the mission's duration."""
    middle = 0.5 * (RAMPS[0][0] + RAMPS[-1][-1])
    return FlightManoeuvre(start(), size * EXCURSION, earlier=middle - 0.5 * DURATION)


def splines(points: int = POINTS, duration: float = DURATION) -> BSplines:
    """Return quintic splines on all joints, with so many free control points each."""
    return BSplines(start(), range(6), duration, points)


def problem(
    model: Model, family: TrajectoryFamily, *criteria: Criterion, limits: Limits = LIMITS, **options: Any
) -> Problem:
    """Return the problem of choosing a manoeuvre, with the noise of the encoders in its criteria.

    Parameters
    ----------
    model : Model
    family : TrajectoryFamily
    *criteria
        Criteria that may be evaluated.
    limits : Limits; limits, by default the rule of the flight
    **options
        Further arguments of `bayesid.design.Problem`.
    """
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, TIP), step=2.0, thinning=2)
    return Problem(plan, limits, criteria, **options).with_encoder(ENCODERS)


def true_arm(robot: Robot, rng: np.random.Generator, arm_spread: float = ARM_SPREAD) -> Robot:
    """Return the robot with links drawn from their priors, so that what is not known of the arm is so in truth."""
    for prior in spread_links(robot, arm_spread, (BASE,)):
        robot = robot.with_inertial(prior.name, draw_inertial(prior.centre, prior.spread, rng))
    return robot


def fly(
    motion: Motion, robot: Robot | None = None, duration: float = DURATION, step: float = TRUTH_STEP, **hidden: Any
) -> Truth:
    """Fly a manoeuvre in MuJoCo and return what truly happened at the samples; see `studies.common.flight.fly`."""
    times = sample_times(duration, INTERVAL)
    return flight.fly(published_robot() if robot is None else robot, motion, times, step=step, **hidden)


def recorded(truth: Truth, rng: np.random.Generator, name: str = "manoeuvre", bias: Floats | None = None) -> Manoeuvre:
    """Record a flight with fresh noise of sensors and encoders and a bias of the accelerometer, fresh by default."""
    bias = BIAS * rng.standard_normal(3) if bias is None else bias
    return flight.record(truth._replace(accel=truth.accel + bias), name, published_robot(), NOISE, rng)
