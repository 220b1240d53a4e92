"""ETS-VII with realistic sensors, two sets of limits, and the families of manoeuvres that compete within them."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid import BodyPrior, Kind, Manoeuvre, MeasuredMotion, Model, Orbit, Recording, Robot, Sensor, White
from bayesid.design import BSplines, Criterion, Limits, PaperExcitation, Parameterisation, Plan, Problem, Tip
from bayesid.effects import AccelBias, GravityGradient
from bayesid.motion import Motion
from studies.base_body import paper
from studies.base_body.setting import extended_wrist
from studies.truth import mujoco as truth

__all__ = [
    "BASE",
    "DURATION",
    "ENCODER",
    "FAST",
    "RULE",
    "fly",
    "model_of",
    "paper_family",
    "problem",
    "recorded",
    "splines",
]

Floats = NDArray[np.floating]

BASE = "base_link"
DURATION = 120.0
"""Of every manoeuvre [s]."""

INTERVAL = 0.5
"""Between samples of all sensors [s]."""

RATE_SIGMA, ACCEL_SIGMA, ENCODER = 1e-5, 1e-5, 1e-6
"""Noise per sample: two seconds of arc per second, a good accelerometer, encoders [rad/s, m/s2, rad]."""

ACCEL_BIAS = 1e-4
"""Prior standard deviation of the accelerometer's constant error [m/s2]."""

POINT = (0.4, 0.3, 0.8)
"""Of the accelerometer in the base [m]."""

REACH = 2.6
"""Joint range allowed to all, either way [rad]; the paper's printed optimum needs 2.5, more than its own limit."""

RULE = Limits(tip_speed=0.05, tip_rate=float(np.radians(5.0)))
"""What was allowed on ETS-VII."""

FAST = Limits(joint_speed=0.4)
"""No rule for the tip: what the paper's printed optimum needs at this duration [rad/s]."""

STEP = 0.1
"""Of the independent simulator [s]."""


@cache
def model_of() -> Model:
    """Return the model: base unknown, arm known, the accelerometer's bias and the initial rate to be marginalised."""
    robot = Robot.shipped("ets7")
    robot = replace(robot, joints=tuple(replace(joint, lower=-REACH, upper=REACH) for joint in robot.joints))
    sensors = (Sensor(Kind.RATE, White(RATE_SIGMA)), Sensor(Kind.ACCEL, White(ACCEL_SIGMA), position=POINT))
    base = BodyPrior(BASE, robot.link(BASE).inertial, 1.0)
    return Model(robot, sensors, (base,), Orbit(paper.RADIUS), (GravityGradient(), AccelBias(ACCEL_BIAS)))


def posture() -> Floats:
    """Return the joints before and after: the wrist extended."""
    return np.array([0.0, 0.0, 0.0, *extended_wrist()])


def paper_family() -> PaperExcitation:
    """Return (27) on the first three joints."""
    return PaperExcitation(posture(), DURATION, moving=(0, 1, 2))


def splines(points: int = 8) -> BSplines:
    """Return quintic splines on all joints."""
    return BSplines(posture(), range(6), DURATION, points)


def problem(family: Parameterisation, limits: Limits, criteria: tuple[Criterion, ...]) -> Problem:
    """Return a design problem of a family within limits."""
    model = model_of()
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, "tip"), step=2.0, thinning=2)
    return Problem(plan, limits, criteria)


def fly(motion: Motion) -> Any:
    """Fly a manoeuvre with the independent simulator and return its readings without noise."""
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        Robot.shipped("ets7").write_urdf(urdf)
        model = truth.TruthModel(urdf, orbit=truth.Orbit(radius=paper.RADIUS), accel_position=POINT)
    time = np.arange(0.0, DURATION + 1e-9, INTERVAL)
    return model.run(lambda t: tuple(part[0] for part in motion.evaluate(np.array([t]))), time, step=STEP)


def recorded(run: Any, rng: np.random.Generator) -> Manoeuvre:
    """Record a flight with fresh noise of all sensors and encoders, and a fresh bias of the accelerometer."""
    time, robot = np.asarray(run.times), model_of().robot
    channels = {
        f"position.{joint.name}": run.position[:, k] + ENCODER * rng.standard_normal(len(time))
        for k, joint in enumerate(robot.joints)
    }
    bias = ACCEL_BIAS * rng.standard_normal(3)
    for family, values, sigma in (("rate", run.rate, RATE_SIGMA), ("accel", run.accel + bias, ACCEL_SIGMA)):
        noisy = values + sigma * rng.standard_normal(values.shape)
        channels |= {f"{family}.{axis}": noisy[:, k] for k, axis in enumerate("xyz")}
    recording = Recording("manoeuvre", None, time, channels)
    return Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER}))
