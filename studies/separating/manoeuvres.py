"""The manoeuvre designed to separate the rivals, and the one that would identify the base best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design import BSplines, DOptimal, Plan, Problem, Search, Separation, Store, Tip, optimise
from bayesid.design.design_problem import Known
from bayesid.design.plan import Trajectory
from bayesid.design.trajectories import ParameterisedMotion
from studies.common.ets7 import LIMITS, START, TIP
from studies.ets7_limits.setting import DURATION, INTERVAL, POINTS
from studies.separating.setting import RIVALS, drifting, rival_model

__all__ = ["Designed", "design_both", "separating_problem"]


@dataclass(frozen=True)
class Designed:
    """A designed manoeuvre.

    Attributes
    ----------
    parameters : (n,) array
        Parameters of the motion in its family.
    costs : mapping of str to float
        Values of both criteria by name.
    largest : dict of str to float
        Largest values of the limited quantities by name.
    motion : ParameterisedMotion
        Motion of the joints.
    trajectory : Trajectory
        Motion of the robot at the prior's centre.
    """

    parameters: Floats
    costs: dict[str, float]
    largest: dict[str, float]
    motion: ParameterisedMotion
    trajectory: Trajectory


def separating_problem(duration: float = DURATION, points: int = POINTS, thinning: int = 4) -> Problem:
    """Return the problem: six joints on B-splines within the flight rules, separation and volume as criteria.

    Manoeuvres start at the rate that the first manoeuvre has shown.
    """
    model = rival_model(RIVALS)
    family = BSplines(START, range(len(START)), duration, points)
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, TIP), thinning=thinning)
    criteria: Any = (Separation(RIVALS), DOptimal())  # frozen, which the protocol's attributes are not
    return Problem(plan, LIMITS, criteria, Known(drifting(plan.unknowns), np.eye(plan.unknowns.size)))


def design_both(
    problem: Problem, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> dict[str, Designed]:
    """Design by both criteria, each from the same random starts."""
    designs = {}
    for criterion in problem.criteria:
        kept = store.of(criterion.name)
        best = optimise(
            problem,
            criterion,
            np.random.default_rng(seed),
            search,
            known=kept.known,
            keep=kept.keep,
            progress=lambda fraction, text: progress(text),
        ).parameters
        designs[criterion.name] = Designed(
            parameters=best,
            costs=problem.costs(best),
            largest={item.name: item.largest for item in problem.reached(best)},
            motion=problem.plan.family.motion(best),
            trajectory=problem.trajectory(best),
        )
    return designs
