"""The manoeuvre designed to separate the rivals, and the one that would identify the base best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from bayesid.design import DOptimal, Problem, Search, Separation, Store, optimise
from bayesid.design.design_problem import Known
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.design.visible_directions import with_visible_directions
from studies.common import mission
from studies.separating.setting import RIVALS, drifting, rival_model

__all__ = ["Designed", "design_both", "separating_problem"]


@dataclass(frozen=True)
class Designed:
    """A designed manoeuvre."""

    costs: dict[str, float]  # values of both criteria by name
    largest: dict[str, float]  # largest values of the limited quantities by name
    motion: ParameterisedMotion  # motion of the joints
    # number of directions in which no manoeuvre shows a rival and which the criterion leaves out, by its label
    left_out: dict[str, int]


def separating_problem(points: int = mission.POINTS) -> Problem:
    """Return the problem: six joints on B-splines within the flight's rule, separation and volume as criteria.

    Manoeuvres start at the rate that the first manoeuvre has shown.
    """
    own = mission.problem(rival_model(RIVALS), mission.splines(points), DOptimal(), Separation(RIVALS))
    unknowns = own.plan.unknowns
    return own.knowing(Known(drifting(unknowns), np.eye(unknowns.size)))


def design_both(
    problem: Problem, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> dict[str, Designed]:
    """Design by both criteria from the same random starts, the second also from the first's best."""
    problem = with_visible_directions(problem, np.random.default_rng(seed))
    found: list[np.ndarray] = []
    for criterion in problem.criteria:
        kept = store.of(criterion.name)
        best = optimise(
            problem,
            criterion,
            np.random.default_rng(seed),
            search,
            first=found,
            known=kept.known,
            keep=kept.keep,
            progress=partial(_tell, progress),
        )
        found.append(best.parameters)
    return {
        criterion.name: Designed(
            costs=problem.costs(best),
            largest={item.name: item.largest for item in problem.reached(best)},
            motion=problem.plan.family.motion(best),
            left_out=criterion.left_out if isinstance(criterion, Separation) else {},
        )
        for criterion, best in zip(problem.criteria, found, strict=True)
    }


def _tell(progress: Callable[[str], None], fraction: float, text: str) -> None:
    progress(text)
