"""ETS-VII with a load on its last link, what is known of it, and MuJoCo as the spacecraft that flies the plans."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesid import BodyPrior, Load, Model, Recording, Robot
from bayesid._math.arrays import Floats
from bayesid.design import PaperExcitation, PlannedMotion
from bayesid.simulation.effects import AccelBias
from bayesid.simulation.model import RATE_SIGMA, spread_links
from studies.common import mission
from studies.common.ets7 import BASE, BIAS, LIMITS
from studies.common.ets7_model import NOISE, orbiting_model
from studies.common.flight import readings
from studies.common.quantities import body_of
from studies.load import paper

__all__ = ["LOAD", "SAFE", "MuJoCoSpacecraft", "excitation", "ideal", "load_unknown", "ship"]

LOAD, LINK = "load", "link6"
"""Name of the load, and link that carries it."""

SAFE = replace(LIMITS, base_rotation=0.5)
"""Rule of the flight, and a bound on the rotation of the base [rad], which depends on the load."""


def ship(load: Floats = paper.GUESS, robot: Robot | None = None) -> Robot:
    """Return ETS-VII, by default with the nominal arm, and a load of ten quantities."""
    return (mission.ship() if robot is None else robot).with_load(Load(LOAD, LINK, body_of(load)))


def load_unknown(spread: float, arm_spread: float) -> Model:
    """Return what is known before the first manoeuvre: the base exactly, the arm to some width, the paper's guess.

    Parameters
    ----------
    spread, arm_spread : float
        Relative widths of the priors of the load and of the links.
    """
    robot = ship()
    links = spread_links(robot, arm_spread, (BASE, LOAD))
    prior = BodyPrior(LOAD, body_of(paper.GUESS), spread)
    return orbiting_model(robot, [prior, *links], AccelBias(BIAS), rate_sigma=RATE_SIGMA)


def ideal() -> Model:
    """Return the model of the paper, without noise: exact arm, base at rest, no bias of the accelerometer."""
    return orbiting_model(ship(), [BodyPrior(LOAD, body_of(paper.GUESS), 1.0)], rate_sigma=0.0)


def excitation() -> PaperExcitation:
    """Return the paper's motion (27): the first three joints oscillate, the wrist is extended."""
    return PaperExcitation(mission.start(), mission.DURATION)


@dataclass(frozen=True)
class MuJoCoSpacecraft:
    """ETS-VII with the true load in MuJoCo, at rest before every manoeuvre.

    Parameters
    ----------
    seed : int, optional
        Seed of arm, bias and noise; the arm is nominal and there is no noise where left out.
    arm_spread : float
        Relative width of the distribution from which the true arm is drawn.
    step : float
        MuJoCo's integration step [s].
    """

    seed: int | None = None
    arm_spread: float = 0.0
    step: float = mission.TRUTH_STEP

    @cached_property
    def robot(self) -> Robot:
        """The robot as it truly is."""
        if self.seed is None or self.arm_spread == 0.0:
            return ship(paper.TRUTH)
        return ship(paper.TRUTH, mission.true_arm(mission.ship(), np.random.default_rng(self.seed), self.arm_spread))

    def motion(self, plan: Recording) -> PlannedMotion:
        """Return the motion of the joints that a plan leads to."""
        return PlannedMotion(plan, [joint.name for joint in self.robot.joints])

    def execute(self, plan: Recording) -> Recording:
        """Fly a plan and return its recording."""
        truth = mission.fly(self.motion(plan), self.robot, step=self.step)
        rng = None if self.seed is None else np.random.default_rng([self.seed, *plan.name.encode()])
        if self.seed is not None:
            bias = BIAS * np.random.default_rng([self.seed, 1]).standard_normal(3)
            truth = truth._replace(accel=truth.accel + bias)
        channels = readings(truth, [joint.name for joint in self.robot.joints], NOISE, rng, by_channel=NOISE)
        return Recording(plan.name, None, plan.time, channels)
