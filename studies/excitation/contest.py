"""Manoeuvres of equal duration within equal limits, each the best by one criterion, judged by the posterior."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from bayesid import Model
from bayesid._math.arrays import Floats
from bayesid.design import (
    AOptimal,
    ConditionNumber,
    Criterion,
    Design,
    DOptimal,
    EOptimal,
    InformationGain,
    Paper26,
    Paper26Intended,
    PaperExcitation,
    Predicted,
    Problem,
    Search,
    Store,
    design,
    planned_manoeuvre,
    planned_posterior,
    predict,
)
from bayesid.design.designed import sample_times
from bayesid.recording.joint_motion import Motion
from studies.base_body import paper
from studies.base_body.analysis import POOR
from studies.common import mission
from studies.common.ets7 import INTERVAL
from studies.common.quantities import JUDGED

__all__ = ["Contest", "compete", "contest_problem", "paper_problem", "shrunk", "sparse"]

# criteria of a quick run: the paper's, the one usual for arms on the ground, and the posterior's volume
FEW: tuple[Criterion, ...] = (Paper26(), Paper26Intended(), ConditionNumber(), DOptimal())

ALL: tuple[Criterion, ...] = (*FEW, AOptimal(), EOptimal(), InformationGain(draws=2))  # criteria of a full run


@dataclass(frozen=True)
class Contest:
    """Manoeuvres within the rule of the flight."""

    designs: Mapping[str, Design]  # designed manoeuvres by criterion, splines of all joints, with the arm known to 5 %
    # predicted posteriors of all manoeuvres by what is known of the arm; beside the designs these are ``printed`` and
    # ``poor``, the paper's manoeuvre and its poor neighbour, made smaller until they keep the rule
    predicted: Mapping[str, Mapping[str, Predicted]]
    shrink: Mapping[str, float]  # factors by which these two were made smaller
    motions: Mapping[str, Motion]  # motions of all manoeuvres

    def factor(self, name: str, over: str, row: str) -> float:
        """Return how many times smaller one manoeuvre's geometric-mean sd is than that of another."""
        own = self.predicted[row]
        return own[over].geometric_mean / own[name].geometric_mean

    def worst(self, name: str, row: str) -> float:
        """Return the largest relative standard deviation of mass and moments of inertia."""
        own = self.predicted[row][name]
        return float((own.sd[JUDGED] / own.mean[JUDGED]).max())

    @property
    def consistent(self) -> bool:
        """Whether no manoeuvre is better by a criterion than the one that was designed for it."""
        return all(
            item.costs[name] <= min(other.costs[name] for other in self.designs.values()) + 1e-9
            for name, item in self.designs.items()
            if name != "information-gain"  # an average over draws, which the costs of the others are not
        )


def contest_problem(full: bool, points: int) -> Problem:
    """Return the problem in which the criteria compete, with all of them or few and so many free control points."""
    return mission.problem(mission.base_unknown(), mission.splines(points), *(ALL if full else FEW))


def compete(
    problem: Problem, seed: int, search: Search, first: Sequence[Floats], store: Store, progress: Callable[[str], None]
) -> Contest:
    """Design by every criterion of the problem; ``first`` are manoeuvres from which every search begins, too."""
    found = design(problem, seed, mission.ENCODERS, search, first=first, store=store, progress=sparse(progress))
    designs = {item.name: item for item in found}
    motions: dict[str, Motion] = {}
    shrink: dict[str, float] = {}
    sines = paper_problem()
    for name, q in (("printed", paper.EXCITATION), ("poor", POOR)):
        parameters, shrink[name] = shrunk(sines, q)
        motions[name] = sines.plan.family.motion(parameters)
    motions |= {name: item.motion for name, item in designs.items()}
    predicted = {}
    for row, spread in mission.ROWS.items():
        progress(f"predictions with the {row}")
        tell = partial(_predicted, mission.base_unknown(spread))
        predicted[row] = {name: tell(motion) for name, motion in motions.items()}
    return Contest(designs, predicted, shrink, motions)


def paper_problem() -> Problem:
    """Return the problem of the paper's motion (27) of the first three joints, whose limits alone matter here."""
    family = PaperExcitation(mission.start(), mission.DURATION, moving=(0, 1, 2))
    return mission.problem(mission.base_unknown(0.0), family, Paper26())


def _predicted(model: Model, motion: Motion) -> Predicted:
    times = sample_times(mission.DURATION, INTERVAL)
    return predict(planned_posterior(model, [planned_manoeuvre(model, motion, times, "plan", mission.ENCODERS)]))


def sparse(progress: Callable[[str], None]) -> Callable[[float, str], None]:
    """Return a progress that passes on a line every five percent."""
    told = [-1]

    def show(fraction: float, text: str) -> None:
        if int(20 * fraction) > told[0]:
            told[0] = int(20 * fraction)
            progress(f"{100.0 * fraction:.0f} %, {text}")

    return show


def shrunk(problem: Problem, q: Sequence[float] | Floats) -> tuple[Floats, float]:
    """Make a manoeuvre smaller, towards rest, until it keeps the limits; return its parameters and the factor."""
    centre = problem.plan.family.centre
    direction = np.asarray(q) - centre

    def kept(factor: float) -> bool:
        return all(item.kept for item in problem.reached(centre + factor * direction))

    if kept(1.0):
        return centre + direction, 1.0
    low, high = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if kept(middle) else (low, middle)
    return centre + low * direction, low
