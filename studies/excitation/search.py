"""Manoeuvres of equal duration within equal limits, each the best by one criterion, judged by the posterior.

Beside them: random manoeuvres, what more starts of a search are worth, and searches on other robots.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import hypergeom, spearmanr

from bayesid import Model, Robot
from bayesid._io.progress import Progress
from bayesid._math.arrays import Floats
from bayesid.design import (
    THOROUGH,
    AOptimal,
    BSplines,
    ConditionNumber,
    Criterion,
    Design,
    DOptimal,
    EOptimal,
    InformationGain,
    Paper26,
    Paper26Intended,
    PaperExcitation,
    Plan,
    Predicted,
    Problem,
    Search,
    Store,
    Tip,
    design,
    optimise,
    planned_manoeuvre,
    planned_posterior,
    predict,
)
from bayesid.design.design_result import sample_times
from bayesid.recording.joint_motion import Motion
from studies.base_body import paper
from studies.base_body.analysis import POOR
from studies.common import mission
from studies.common.ets7 import INTERVAL, LIMITS
from studies.common.monte_carlo import Workers
from studies.common.quantities import JUDGED
from studies.common.repeated_fits import Realised, repeat
from studies.truth.bodies import SERVICER4

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
        predicted = self.predicted[row]
        return predicted[over].geometric_mean / predicted[name].geometric_mean

    def worst(self, name: str, row: str) -> float:
        """Return the largest relative standard deviation of mass and moments of inertia."""
        predicted = self.predicted[row][name]
        return float((predicted.sd[JUDGED] / predicted.mean[JUDGED]).max())

    @property
    def consistent(self) -> bool:
        """Whether no manoeuvre is better by a criterion than the one that was designed for it."""
        return all(
            design.costs[name] <= min(other.costs[name] for other in self.designs.values()) + 1e-9
            for name, design in self.designs.items()
            if name != "information-gain"  # an average over draws, which the costs of the others are not
        )


def contest_problem(full: bool, points: int) -> Problem:
    """Return the problem in which the criteria compete, with all of them or few and so many free control points."""
    return mission.problem(mission.base_unknown(), mission.splines(points), *(ALL if full else FEW))


def compete(
    problem: Problem, seed: int, search: Search, first: Sequence[Floats], store: Store, progress: Callable[[str], None]
) -> Contest:
    """Design by every criterion of the problem; ``first`` are manoeuvres from which every search begins, too."""
    designed = design(problem, seed, mission.ENCODERS, search, first=first, store=store, progress=sparse(progress))
    designs = {each.name: each for each in designed}
    motions: dict[str, Motion] = {}
    shrink: dict[str, float] = {}
    sines = paper_problem()
    for name, q in (("printed", paper.EXCITATION), ("poor", POOR)):
        parameters, shrink[name] = shrunk(sines, q)
        motions[name] = sines.plan.family.motion(parameters)
    motions |= {name: each.motion for name, each in designs.items()}
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
        return all(reached.kept for reached in problem.reached(centre + factor * direction))

    if kept(1.0):
        return centre + direction, 1.0
    low, high = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if kept(middle) else (low, middle)
    return centre + low * direction, low


@dataclass(frozen=True)
class Cloud:
    """Random manoeuvres of one family within limits."""

    # (n,): criterion (26) as printed, as intended, and the sum of the largest squared excursions alone
    printed: Floats
    intended: Floats
    motion: Floats
    information: Floats  # (n,): minus half the log-determinant of the posterior covariance of the base's coordinates

    def correlation(self, values: Floats) -> tuple[float, float]:
        """Return the rank correlation with the information, and its standard error."""
        rho = float(spearmanr(values, self.information).statistic)
        return rho, float((1.0 - rho**2) / np.sqrt(len(values) - 3.0))


def random_cloud(problem: Problem, count: int, rng: np.random.Generator) -> Cloud:
    """Draw random manoeuvres, each a random part of the largest that keeps the limits in its direction.

    The problem has (26) in both versions and d-optimality among its criteria.
    """
    family = problem.plan.family
    rows: list[list[float]] = []
    while len(rows) < count:
        direction = family.scale * rng.normal(size=family.size)
        size = 1.0
        while problem.fractions(family.centre + size * direction)[0].max() > 1.0:
            size *= 0.7
        parameters = family.centre + size * rng.uniform(0.3, 1.0) * direction
        costs = problem.costs(parameters)
        largest = np.abs(problem.trajectory(parameters).excursion).max(axis=0)
        rows.append([-costs["paper-26"], -costs["paper-26-intended"], float((largest**2).sum()), -costs["d-optimal"]])
    return Cloud(*np.array(rows).T)


# criteria whose searches begin at many starts: the two whose ratio is a goal
CROWDED: tuple[Criterion, ...] = (Paper26(), DOptimal())


@dataclass(frozen=True)
class Crowd:
    """Descents by one criterion from N random starts."""

    best: Floats  # (n,): parameters of the best manoeuvre, once the best descents were followed to the end
    cost: float  # its cost
    costs: Floats  # (N,): costs at which the first descents ended, in the order of their starts

    def share_of_best(self, count: int) -> Floats:
        """Return for each descent, the best first, the probability that it is the best of ``count`` drawn of all."""
        total = len(self.costs)
        beyond = hypergeom.sf(0, total, np.arange(total + 1), count)  # that one of the k best is among them
        return np.diff(beyond)

    def expected(self, count: int) -> float:
        """Return the mean cost of the best of ``count`` descents drawn of all."""
        return float(self.share_of_best(count) @ np.sort(self.costs))


def crowd_of(
    problem: Problem, criterion: Criterion, seed: int, search: Search, store: Store, progress: Progress, name: str = ""
) -> Crowd:
    """Search by a criterion of the problem from many starts; an interrupted search goes on from the store.

    The starts are those of `bayesid.design.design` with the same seed, and more. The name of the problem is part of
    that in the store.
    """
    kept = store.of(f"{name}{search.starts} starts.{criterion.name}")  # their number decides which are followed
    index = problem.criteria.index(criterion)
    rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(index + 1)[index])
    best = optimise(problem, criterion, rng, search, known=kept.known, keep=kept.keep, progress=progress)
    descents: Sequence[tuple[Floats, float, int] | None] = [kept.known(f"0.{k}") for k in range(search.starts)]
    return Crowd(best.parameters, best.cost, np.array([descent[1] for descent in descents if descent is not None]))


class Searches(NamedTuple):
    """Searches by one criterion that differ in their seeds alone."""

    best: Floats  # (n,): parameters of the best manoeuvre
    costs: Floats  # (N,): cost of the manoeuvre that each search ends with


def searches_of(
    problem: Problem,
    criterion: Criterion,
    seed: int,
    count: int,
    search: Search,
    store: Store,
    progress: Progress,
    name: str = "",
) -> Searches:
    """Search several times, each from random starts of its own; an interrupted study goes on from the store."""
    optima = []
    for number in range(count):
        kept = store.of(f"{name}search {number}.{criterion.name}")
        rng = np.random.default_rng([seed, number])
        optima.append(optimise(problem, criterion, rng, search, known=kept.known, keep=kept.keep, progress=progress))
    costs = np.array([optimum.cost for optimum in optima])
    return Searches(optima[int(costs.argmin())].parameters, costs)


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
    rivals = {}
    for name, robot in ROBOTS.items():
        progress(name)
        problem, called = other_problem(robot()), f"{name}: "
        criterion = problem.criteria[0]
        best = crowd_of(problem, criterion, seed, crowd, store, sparse(progress), called)
        searched = searches_of(problem, criterion, seed, 1, search, store, sparse(progress), called)
        rivals[name] = Rivals(best.cost, float(searched.costs[0]))
    return rivals


FULL, QUICK = THOROUGH, Search(starts=3, iterations=60)  # effort of each search of a full and of a quick run


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    contest: Contest
    realised: Mapping[str, Realised]  # designs that were flown, by name
    cloud: Cloud  # random manoeuvres, splines of all joints
    crowds: Mapping[str, Crowd]  # searches from many starts by criterion, if there were any
    searches: Searches | None  # repeated thorough searches by d-optimality, if there were any
    rivals: Mapping[str, Rivals]  # A search and the best of many descents on other robots, if there were any
    search: Search  # effort of each other search
    full: bool


def run(
    *,
    full: bool = False,
    seed: int = 1,
    search: Search | None = None,
    starts: int | None = None,
    searches: int | None = None,
    repeats: int | None = None,
    flown: Sequence[str] = ("d-optimal",),
    random: int | None = None,
    points: int = mission.POINTS,
    store: Store | None = None,
    trials: Path | None = None,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study; arguments that are not described are options of the command.

    Parameters
    ----------
    search : Search, optional; effort of each design
    flown : sequence of str; designs to fly in a quick run
    random : int, optional; number of random manoeuvres
    points : int; number of free control points of every joint
    """
    search = replace(search or (FULL if full else QUICK), executor=executor)
    repeats = (400 if full else 100) if repeats is None else repeats
    random = (500 if full else 100) if random is None else random
    store = store or Store.forgetful()
    problem, crowds, rivals = contest_problem(full, points), {}, {}
    if starts is not None:
        effort = replace(QUICK, starts=starts, executor=executor)
        crowds = {
            criterion.name: crowd_of(problem, criterion, seed, effort, store, sparse(progress)) for criterion in CROWDED
        }
    first, repeated = [crowd.best for crowd in crowds.values()], None
    if searches:
        effort = replace(THOROUGH, executor=executor)
        repeated = searches_of(problem, DOptimal(), seed, searches, effort, store, sparse(progress))
        first.append(repeated.best)
        if starts is not None:
            rivals = other_robots(seed, replace(QUICK, starts=starts, executor=executor), effort, store, progress)
    contest = compete(problem, seed, search, first, store, progress)
    base = contest.designs["d-optimal"].problem
    cloud = random_cloud(base, random, np.random.default_rng(seed))
    realised = {}
    for number, name in enumerate(contest.designs):
        if full or name in flown:
            realised[name] = repeat(
                contest.designs[name].parameters,
                points,
                repeats,
                seed=1000 * seed + number,
                store=None if trials is None else trials / f"{name}.jsonl",
                workers=workers,
                progress=lambda text, name=name: progress(f"{name}: {text}"),  # type: ignore[misc]
            )
    return Result(contest, realised, cloud, crowds, repeated, rivals, search, full)
