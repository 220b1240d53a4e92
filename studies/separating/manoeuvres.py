"""The manoeuvre designed to separate the rivals, and the one that would identify the base best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid.design import (
    BSplines,
    DOptimal,
    Plan,
    Problem,
    Search,
    Separation,
    Store,
    Tip,
    optimise,
)
from bayesid.design.design_problem import Reached
from bayesid.design.plan import Trajectory
from bayesid.design.trajectories import ParameterisedMotion
from studies.common.ets7 import LIMITS, START, TIP
from studies.ets7_limits.setting import DURATION, INTERVAL, POINTS
from studies.separating.setting import RIVALS, drifting, rival_model

__all__ = ["Designed", "Drifting", "design_both", "separating_problem"]

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Drifting(Problem):
    """A problem whose manoeuvres start at the rate that the first manoeuvre has shown."""

    @cached_property
    def centre(self) -> Floats:
        """The prior's centre, at that rate."""
        return drifting(self.plan.model, self.plan.unknowns.names)


@dataclass(frozen=True)
class Designed:
    """A designed manoeuvre.

    Attributes
    ----------
    name : str
        Of its criterion.
    parameters : (n,) array
    costs : mapping of str to float
        Of all criteria.
    reached : list of Reached
    motion : ParameterisedMotion
    trajectory : Trajectory
    """

    name: str
    parameters: Floats
    costs: dict[str, float]
    reached: list[Reached]
    motion: ParameterisedMotion
    trajectory: Trajectory


def separating_problem(duration: float = DURATION, points: int = POINTS, thinning: int = 4) -> Drifting:
    """Return the problem: six joints on B-splines within the flight rules, separation and volume as criteria."""
    model = rival_model(RIVALS)
    family = BSplines(START, range(len(START)), duration, points)
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, TIP), thinning=thinning)
    criteria: Any = (Separation(RIVALS), DOptimal())  # frozen, which the protocol's attributes are not
    return Drifting(plan, LIMITS, criteria)


def design_both(
    problem: Drifting, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> dict[str, Designed]:
    """Design by both criteria, each from its own random starts, the same for both."""
    found, family = {}, problem.plan.family
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
        )
        found[criterion.name] = Designed(
            name=criterion.name,
            parameters=best.parameters,
            costs=problem.costs(best.parameters),
            reached=problem.reached(best.parameters),
            motion=family.motion(best.parameters),
            trajectory=problem.trajectory(best.parameters),
        )
    return found
