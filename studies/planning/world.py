"""The path that is planned, what the planner takes for granted, and how MuJoCo flies the true ship."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid import Model, Robot
from bayesid._math.arrays import Floats
from bayesid.robot.body_prior import draw_inertial
from bayesid.robot.joint_state import JointState
from studies.common import mission
from studies.common.ets7 import BASE, TIP
from studies.common.flight import prescribed, true_robot
from studies.truth.numerics import quintic_step

__all__ = ["EXCURSION", "SPREAD", "FlownPose", "Swing", "fly", "planners_model", "true_ship"]

# position (3,) [m] and quaternion x, y, z, w to orbit axes, counted in orbit axes from where the base started
FlownPose = tuple[Floats, Floats]

# excursion of the joints in the first plan [rad], whose end is the target if the ship is as it was published
EXCURSION = np.array([1.3, -1.5, 0.6, 0.5, -0.7, 0.6])

SPREAD = 0.15  # relative width of the planner's prior of the base: its mass is then known to 30 %


@dataclass(frozen=True)
class Swing:
    """A path in joint space on which each joint goes from rest to rest on a quintic."""

    # (6,): joint positions before and after [rad]
    start: Floats
    goal: Floats
    duration: float = mission.DURATION  # duration of the path [s]

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        steps = [quintic_step(instant / self.duration) for instant in np.asarray(time, dtype=float)]
        value, slope, bend = np.array(steps).T[:, :, None] * (self.goal - self.start)
        return JointState(self.start + value, slope / self.duration, bend / self.duration**2)


def planners_model(arm_spread: float) -> Model:
    """Return what the planner holds possible: the ship as published, its base to `SPREAD`, the arm to a width."""
    return mission.base_unknown(arm_spread, base_spread=SPREAD)


def true_ship(rng: np.random.Generator, arm_spread: float) -> Robot:
    """Draw the true ship from what the planner holds possible."""
    robot = mission.true_arm(mission.ship(), rng, arm_spread)
    return robot.with_inertial(BASE, draw_inertial(robot.link(BASE).inertial, SPREAD, rng))


def fly(robot: Robot, swing: Swing) -> dict[str, FlownPose]:
    """Fly a path from rest and return the final poses of ``base`` and ``tip``."""
    model, end = true_robot(robot), [swing.duration]
    truth = model.run(prescribed(swing, end, mission.TRUTH_STEP), end, step=mission.TRUTH_STEP)
    body = model.data.body(TIP)
    tip = Rotation.from_matrix(np.array(body.xmat).reshape(3, 3)).as_quat()
    return {"base": (np.array(model.data.qpos[:3]), truth.attitude[-1]), "tip": (np.array(body.xpos), tip)}
