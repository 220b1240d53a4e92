"""Whether a search ends as low as the best of many descents on other robots, too."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from bayesid import Robot
from bayesid.design import BSplines, DOptimal, Plan, Problem, Search, Store, Tip
from studies.common import mission
from studies.common.ets7 import INTERVAL, LIMITS
from studies.excitation.contest import sparse
from studies.excitation.saturation import crowd_of, searches_of
from studies.truth.bodies import SERVICER4

__all__ = ["Rivals", "other_problem", "other_robots"]

# robots by what they are called in the report
ROBOTS: Mapping[str, Callable[[], Robot]] = {
    "the planar table": lambda: Robot.shipped("planar"),
    "a servicer of four joints": lambda: Robot.from_urdf(SERVICER4),
}

POSTURE = (0.0, -0.6, 1.0, -0.4)  # joint positions before and after every manoeuvre [rad], as many as there are joints


class Rivals(NamedTuple):
    """Costs by d-optimality on one robot."""

    crowd: float  # the best of many descents from random starts, the best few of them followed to the end
    search: float  # where a search from other starts ends


def other_problem(robot: Robot) -> Problem:
    """Return the problem of the manoeuvre for a robot, with sensors, limits and duration of the mission."""
    start = np.array(POSTURE[: len(robot.joints)])
    family = BSplines(start, range(len(start)), mission.DURATION, mission.POINTS)
    model = mission.base_unknown(robot=robot)
    plan = Plan(model, family, INTERVAL, Tip.of(robot), step=2.0, thinning=2)
    return Problem(plan, LIMITS, (DOptimal(),)).with_encoder(mission.ENCODERS)


def other_robots(
    seed: int, crowd: Search, search: Search, store: Store, progress: Callable[[str], None]
) -> dict[str, Rivals]:
    """Search on each robot with two efforts, that of the many descents and that of a search; seeds differ."""
    found = {}
    for name, robot in ROBOTS.items():
        progress(name)
        problem, called = other_problem(robot()), f"{name}: "
        criterion = problem.criteria[0]
        best = crowd_of(problem, criterion, seed, crowd, store, sparse(progress), called)
        searched = searches_of(problem, criterion, seed, 1, search, store, sparse(progress), called)
        found[name] = Rivals(best.cost, float(searched.costs[0]))
    return found
