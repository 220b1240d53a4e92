"""ETS-VII with a load on its last link, the manoeuvres allowed, and MuJoCo as the spacecraft that flies them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid import BodyPrior, Kind, Load, Model, Orbit, Recording, Robot, Sensor, White
from bayesid.design import Criterion, Limits, PaperExcitation, Plan, PlannedMotion, Problem, Tip, TrajectoryFamily
from bayesid.simulation.effects import GravityGradient
from studies.common.ets7 import ACCEL, ACCELEROMETER, ENCODER, RADIUS, RATE, ets7, extended_wrist
from studies.common.flight import fly, readings
from studies.load import paper

__all__ = ["LOAD", "MuJoCoSpacecraft", "excitation", "model", "problem", "ship"]

Floats = NDArray[np.floating]

LOAD, LINK = "load", "link6"
DURATION, INTERVAL = 120.0, 0.5
"""Length of a manoeuvre, and time between samples of all sensors [s]."""

RANGE = np.pi / 2.0
"""Joint range the paper states [rad]."""

LIMITS = Limits(joint_speed=0.2)
"""The paper states no speed [rad/s]."""

JOLT = 2.0
"""Where (27) meets its connecting splines the third derivative jumps, which no smoothing of samples at 2 Hz follows:
the joints' accelerations are wrong there by some fifteen standard deviations. What is read this near is left out
[s]."""

PLAN_STEP, TRUTH_STEP = 2.0, 0.1
"""Integration steps of design and truth [s]."""


def ship(load: Floats = paper.GUESS) -> Robot:
    """Return ETS-VII with the paper's joint ranges and a load."""
    shipped = ets7()
    urdf = shipped.urdf.replace('"-6.283185307179586"', f'"{-RANGE!r}"').replace('"6.283185307179586"', f'"{RANGE!r}"')
    return Robot.from_string(urdf).with_load(Load(LOAD, LINK, paper.body(load)))


def model(spread: float) -> Model:
    """Return what is known before the first manoeuvre: the paper's guess, in orbit, at rest."""
    return Model(
        robot=ship(),
        sensors=(Sensor(Kind.RATE, White(RATE)), Sensor(Kind.ACCEL, White(ACCEL), position=ACCELEROMETER)),
        priors=(BodyPrior(LOAD, paper.body(paper.GUESS), spread),),
        orbit=Orbit(RADIUS),
        effects=(GravityGradient(),),
        rate_sigma=0.0,
    )


def excitation() -> PaperExcitation:
    """Return the paper's (27): the first three joints oscillate, the wrist extended."""
    return PaperExcitation([0.0, 0.0, 0.0, *extended_wrist()], DURATION)


def problem(known: Model, family: TrajectoryFamily, *criteria: Criterion, limits: Limits = LIMITS) -> Problem:
    """Return the design problem of a family of manoeuvres."""
    plan = Plan(known, family, interval=INTERVAL, tip=Tip.of(known.robot, "tip"), step=PLAN_STEP, thinning=4)
    return Problem(plan, limits, criteria)


@dataclass(frozen=True)
class MuJoCoSpacecraft:
    """ETS-VII with the true load in MuJoCo, at rest before every manoeuvre.

    Parameters
    ----------
    seed : int, optional
        Of the noise; there is none where left out.
    jolts : tuple of float
        Times [s] about which the sensors of the base are not read (`JOLT`).
    """

    seed: int | None = None
    jolts: tuple[float, ...] = ()

    def execute(self, plan: Recording) -> Recording:
        """Fly a plan."""
        robot = ship(paper.TRUTH)
        joints = [joint.name for joint in robot.joints]
        run = fly(robot, PlannedMotion(plan, joints), plan.time, step=TRUTH_STEP)
        noise = {"position": ENCODER, "rate": RATE, "accel": ACCEL}
        rng = None if self.seed is None else np.random.default_rng([self.seed, *plan.name.encode()])
        channels = readings(run, joints, noise, rng, by_channel=noise)
        unread = np.zeros(len(plan.time), dtype=bool)
        for jolt in self.jolts:
            unread |= np.abs(plan.time - jolt) <= JOLT
        for name in (name for name in channels if not name.startswith("position.")):
            channels[name] = np.where(unread, np.nan, channels[name])
        return Recording(plan.name, None, plan.time, channels)
