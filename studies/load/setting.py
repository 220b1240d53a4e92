"""ETS-VII with a load on its last link, the manoeuvres allowed, and MuJoCo as the spacecraft that flies them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid import BodyPrior, Load, Model, Recording, Robot
from bayesid._math.arrays import Floats
from bayesid.design import Criterion, Limits, PaperExcitation, Plan, PlannedMotion, Problem, Tip, TrajectoryFamily
from studies.common.ets7 import TIP, ets7
from studies.common.ets7_model import NOISE, extended_start, orbiting_model
from studies.common.flight import fly, readings
from studies.load import paper

__all__ = ["LOAD", "MuJoCoSpacecraft", "excitation", "model", "problem", "ship"]

LOAD, LINK = "load", "link6"
"""Name of the load, and link that carries it."""

DURATION, INTERVAL = 120.0, 0.5
"""Length of a manoeuvre, and time between samples of all sensors [s]."""

RANGE = np.pi / 2.0
"""Joint range that the paper states, either way [rad]."""

LIMITS = Limits(joint_speed=0.2)
"""Limits of the manoeuvres: a joint speed [rad/s], since the paper states none."""

JOLT = 2.0
"""Time to either side of the places where (27) meets its connecting splines, within which readings of the base's
sensors are left out [s]. The third derivative of the joints jumps there, which no smoothing of samples at 2 Hz follows:
accelerations of the joints are wrong by some fifteen standard deviations."""

PLAN_STEP, TRUTH_STEP = 2.0, 0.1
"""Integration steps of design and truth [s]."""


def ship(load: Floats = paper.GUESS) -> Robot:
    """Return ETS-VII with the paper's joint ranges and a load of ten quantities."""
    shipped = ets7()
    urdf = shipped.urdf.replace('"-6.283185307179586"', f'"{-RANGE!r}"').replace('"6.283185307179586"', f'"{RANGE!r}"')
    return Robot.from_string(urdf).with_load(Load(LOAD, LINK, paper.body(load)))


def model(spread: float, rate_sigma: float = 0.0) -> Model:
    """Return what is known before the first manoeuvre: the paper's guess of the load, in orbit, at rest.

    Parameters
    ----------
    spread : float
        Relative width of the load's prior.
    rate_sigma : float
        Standard deviation of the prior of the initial rate [rad/s].
    """
    return orbiting_model(ship(), [BodyPrior(LOAD, paper.body(paper.GUESS), spread)], rate_sigma=rate_sigma)


def excitation() -> PaperExcitation:
    """Return the paper's motion (27): the first three joints oscillate, the wrist is extended."""
    return PaperExcitation(extended_start(), DURATION)


def problem(known: Model, family: TrajectoryFamily, *criteria: Criterion, limits: Limits = LIMITS) -> Problem:
    """Return the design problem of a family of manoeuvres."""
    plan = Plan(known, family, interval=INTERVAL, tip=Tip.of(known.robot, TIP), step=PLAN_STEP, thinning=4)
    return Problem(plan, limits, criteria)


@dataclass(frozen=True)
class MuJoCoSpacecraft:
    """ETS-VII with the true load in MuJoCo, at rest before every manoeuvre.

    Parameters
    ----------
    seed : int, optional
        Seed of the noise; there is none where left out.
    jolts : tuple of float
        Times [s] about which the readings of the base's sensors are left out (`JOLT`).
    """

    seed: int | None = None
    jolts: tuple[float, ...] = ()

    def execute(self, plan: Recording) -> Recording:
        """Fly a plan and return its recording."""
        robot = ship(paper.TRUTH)
        joints = [joint.name for joint in robot.joints]
        run = fly(robot, PlannedMotion(plan, joints), plan.time, step=TRUTH_STEP)
        rng = None if self.seed is None else np.random.default_rng([self.seed, *plan.name.encode()])
        channels = readings(run, joints, NOISE, rng, by_channel=NOISE)
        left_out = np.zeros(len(plan.time), dtype=bool)
        for jolt in self.jolts:
            left_out |= np.abs(plan.time - jolt) <= JOLT
        for name in (name for name in channels if not name.startswith("position.")):
            channels[name] = np.where(left_out, np.nan, channels[name])
        return Recording(plan.name, None, plan.time, channels)
