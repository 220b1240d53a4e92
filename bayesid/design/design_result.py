"""Manoeuvres designed by several criteria, each with its predicted posterior and the limits it reaches."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Lock
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, part_of, silent
from bayesid._math.arrays import Floats
from bayesid.design.criteria import Criterion, known_criteria
from bayesid.design.decision_rate import DecisionRate
from bayesid.design.design_problem import Problem, Reached
from bayesid.design.predicted_posterior import Encoder, Predicted, planned_manoeuvre, planned_posterior, predict
from bayesid.design.search_starts import adapted_to_family
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.design.trajectory import Trajectory
from bayesid.design.trajectory_search import Search, SearchResult, Store, optimise
from bayesid.inference.posterior import Posterior
from bayesid.simulation.model import Manoeuvre

__all__ = ["Design", "Risk", "best_design", "decisions", "design", "evaluate", "risks", "sample_times"]

CERTAIN = 0.99  # probability with which a limit must hold for a manoeuvre to be flown
PASSES = 4  # largest number of passes over all criteria until the manoeuvres agree; the last one only exchanges them
# shares of a design's progress at which the searches from random starts and all searches end
SEARCHING, EVALUATING = 0.7, 0.9
DRAWS = 200  # number of draws of the prior for the risk of breaking a limit, enough for a 99 % quantile


@dataclass(frozen=True)
class Risk:
    """Risk of breaking a limit under the present uncertainty of the robot."""

    name: str  #: name of the limit
    limit: float  #: bound of the limited quantity, in the unit
    #: value that the quantity stays below along the whole manoeuvre with probability `CERTAIN`, in the unit
    quantile: float
    unit: str  #: unit of the quantity

    @property
    def go(self) -> bool:
        """True if the limit holds with probability `CERTAIN`."""
        return self.quantile <= self.limit


@dataclass(frozen=True)
class Design:
    """Designed manoeuvre."""

    name: str  #: name of the manoeuvre, which is also the stem of its file
    criterion: str  #: name of the criterion by which it was designed
    problem: Problem  #: design problem
    parameters: Floats  #: (n,) parameters of the motion in its family
    optimum: SearchResult  #: outcome of the search
    costs: Mapping[str, float]  #: values of all criteria of the problem, by name
    posterior: Posterior  #: posterior of the manoeuvre as it would be recorded without noise
    predicted: Predicted  #: predicted posterior of the bodies to identify
    reached: Sequence[Reached]  #: largest values of all limited quantities
    risks: Sequence[Risk]  #: risks of the limits that depend on the inertial parameters
    #: expected rates of decisions between the rivals that the criterion distinguishes, by label
    decisions: Mapping[str, DecisionRate]

    @property
    def designed_by(self) -> Criterion | None:
        """Criterion by which it was designed, None if that is not one of the problem's."""
        return next((one for one in self.problem.criteria if one.name == self.criterion), None)

    @property
    def manoeuvre(self) -> Manoeuvre:
        """Manoeuvre as it would be recorded without noise."""
        return self.posterior.manoeuvres[0]

    @property
    def motion(self) -> ParameterisedMotion:
        """Motion of the joints."""
        return self.problem.plan.family.motion(self.parameters)

    @property
    def trajectory(self) -> Trajectory:
        """Motion of the robot at the prior's centre, on a fine grid."""
        return self.problem.trajectory(self.parameters)

    @property
    def go(self) -> bool:
        """True if every limit is satisfied with 99 % probability under the present uncertainty."""
        return all(risk.go for risk in self.risks) and all(reached.kept for reached in self.reached)

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of the manoeuvre in design.json."""
        family = self.problem.plan.family
        return {
            "name": self.name,
            "criterion": self.criterion,
            "parameterisation": family.name,
            "duration": family.duration,
            "parameters": dict(zip(family.names, map(float, self.parameters), strict=True)),
            "predicted_sd": dict(zip(self.predicted.names, map(float, self.predicted.sd), strict=True)),
            "log_det_covariance": self.predicted.log_det,
            "worst_direction_sd": self.predicted.worst,
            "limits": {
                reached.name: {
                    "limit": reached.limit,
                    "largest": reached.largest,
                    "unit": reached.unit,
                    "active": bool(reached.active),
                }
                for reached in self.reached
            },
            "go": bool(self.go),
            "risk": {
                risk.name: {"limit": risk.limit, "quantile_99": risk.quantile, "go": bool(risk.go)}
                for risk in self.risks
            },
            "criteria": dict(self.costs),
            **(
                {"decisions": {label: rate._asdict() for label, rate in self.decisions.items()}}
                if self.decisions
                else {}
            ),
            "search": {"costs_of_starts": list(self.optimum.costs), "evaluations": self.optimum.evaluations},
            "file": f"{self.name}.csv",
        }


def best_design(designs: Sequence[Design]) -> Design:
    """Return the design with the smallest posterior covariance among those that satisfy their limits.

    Raises
    ------
    InputError
        If no design satisfies its limits.
    """
    kept = [design for design in designs if all(reached.kept for reached in design.reached)]
    if not kept:
        broken = {reached.name for design in designs for reached in design.reached if not reached.kept}
        problem = f"no design satisfies its limits throughout the manoeuvre: {', '.join(sorted(broken))}"
        raise InputError(problem, place="design.limits", remedy="Relax these limits, or allow more time")
    return min(kept, key=lambda design: design.predicted.log_det)


def sample_times(duration: float, interval: float) -> Floats:
    """Return the times of all samples of a manoeuvre [s]; the last is its end if the interval divides the duration.

    Parameters
    ----------
    duration : float
        Duration of the manoeuvre [s].
    interval : float
        Time between samples [s].
    """
    return interval * np.arange(int(np.floor(duration / interval + 1e-6)) + 1)


@threadpool_limits.wrap(limits=1)  # sums of several threads are rounded by chance
def design(
    problem: Problem,
    seed: int,
    encoder: Encoder,
    search: Search = Search(),  # noqa: B008  (immutable)
    *,
    first: Sequence[Floats] = (),
    store: Store | None = None,
    progress: Progress = silent,
) -> list[Design]:
    """Design a manoeuvre by every criterion of a problem.

    Each criterion is minimised from many starts, and again from any other manoeuvre that is better by it, until the
    manoeuvre designed by each criterion is the best by it. Criteria are adapted to what the family's manoeuvres can
    show. The best manoeuvres by the criteria from which another starts (`Criterion.starts_from`) are sought in any
    case, and returned if the problem has these criteria.

    Parameters
    ----------
    problem : Problem
        Design problem with its criteria.
    seed : int
        Seed of all random numbers.
    encoder : Encoder
        Noise of the encoders.
    search : Search
        Effort of the search by each criterion.
    first : sequence of (n,) arrays
        Parameters to start from in addition to the random starts, such as the best of a family that this one contains.
    store : Store, optional
        Store of the results, for a run that may be interrupted.
    progress : Progress
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If no manoeuvre satisfies the limits.
    """
    store = Store.forgetful() if store is None else store
    asked, problem = len(problem.criteria), with_starts(problem)
    count = len(problem.criteria)
    *seeds, last, visible = np.random.SeedSequence(seed).spawn(2 * count + 2)
    problem = adapted_to_family(problem.with_encoder(encoder), np.random.default_rng(visible))
    points = {
        criterion.name: problem.points(criterion, np.random.default_rng(stream))
        for criterion, stream in zip(problem.criteria, seeds[count:], strict=True)
    }
    shares = _Shares(part_of(progress, 0.0, SEARCHING), count)

    optima: dict[int, SearchResult] = {}

    def search_by(index: int) -> SearchResult:
        criterion = problem.criteria[index]
        earlier = [
            optima[place].parameters for place in optima if problem.criteria[place].name in criterion.starts_from
        ]
        kept = store.of(f"{problem.plan.family.name}.{criterion.name}")
        return optimise(
            problem,
            criterion,
            np.random.default_rng(seeds[index]),
            search,
            first=[*first, *earlier],
            points=points[criterion.name],
            known=kept.known,
            keep=kept.keep,
            progress=shares.of(index),
        )

    problem.compile()
    for later in (False, True):
        places = [place for place, criterion in enumerate(problem.criteria) if bool(criterion.starts_from) is later]
        if places:
            results = _each(search_by, places, search.executor)
            optima |= dict(zip(places, results, strict=True))
    ends = [optima[place] for place in range(count)]
    ends = _consistent(problem, points, ends, search, store, part_of(progress, SEARCHING, EVALUATING))
    streams = last.spawn(count)

    def evaluate_by(index: int) -> Design:
        name, rng = problem.criteria[index].name, np.random.default_rng(streams[index])
        return evaluate(problem, name, ends[index], encoder, rng, points=points)

    progress(EVALUATING, "predicting the result of each manoeuvre")
    return _each(evaluate_by, range(asked), search.executor)


def with_starts(problem: Problem) -> Problem:
    """Return the problem with the criteria that others start from, after its own."""
    names = [criterion.name for criterion in problem.criteria]
    needed = dict.fromkeys(name for criterion in problem.criteria for name in criterion.starts_from)
    missing = [known_criteria()[name]() for name in needed if name not in names]
    return problem.judged_by([*problem.criteria, *missing]) if missing else problem


def evaluate(
    problem: Problem,
    name: str,
    optimum: SearchResult,
    encoder: Encoder,
    rng: np.random.Generator,
    *,
    points: Mapping[str, list[Floats]] = MappingProxyType({}),
) -> Design:
    """Return the design of a motion with its predicted posterior, given all sensor and encoder noise, and its limits.

    Parameters
    ----------
    problem : Problem
        Design problem.
    name : str
        Name of the manoeuvre and of its criterion.
    optimum : SearchResult
        Outcome of the search, with the parameters of the motion.
    encoder : Encoder
        Noise of the encoders.
    rng : numpy.random.Generator
        Source of the draws for the risks and the rates of decisions.
    points : mapping of str to list of (n,) arrays
        Points of the unknowns over which each criterion is averaged, by its name; by default the prior's centre.
    """
    plan = problem.plan
    parameters = optimum.parameters
    manoeuvre = planned_manoeuvre(
        plan.model,
        plan.family.motion(parameters),
        sample_times(plan.family.duration, plan.interval),
        name,
        encoder,
        plan.attitude,
        plan.wheels,
        attitude_sigma=plan.attitude_sigma,
        argument_of_latitude=plan.argument_of_latitude,
    )
    posterior = planned_posterior(plan.model, [manoeuvre])
    return Design(
        name=name,
        criterion=name,
        problem=problem,
        parameters=parameters,
        optimum=optimum,
        costs=problem.costs(parameters, points),
        posterior=posterior,
        predicted=predict(posterior),
        reached=problem.reached(parameters),
        risks=risks(problem, parameters, rng),
        decisions=decisions(problem, parameters, rng),
    )


def decisions(problem: Problem, parameters: Floats, rng: np.random.Generator) -> dict[str, DecisionRate]:
    """Return the expected rates of decisions between the rivals of a problem's criteria, by label.

    Parameters
    ----------
    problem : Problem
        Problem whose criteria are adapted to its family.
    parameters : (n,) array
        Motion in its family.
    rng : numpy.random.Generator
    """
    comparing = [criterion for criterion in problem.criteria if criterion.rivals]
    shown = problem.shown(parameters) if comparing else {}
    parts = [criterion.expected(problem.plan, shown[criterion.name], rng) for criterion in comparing]
    return {label: rate for part in parts for label, rate in part.items()}


def risks(problem: Problem, parameters: Floats, rng: np.random.Generator, draws: int = DRAWS) -> list[Risk]:
    """Return the risks of all limits that depend on the inertial parameters, with 99 % quantiles over their prior.

    The base starts at rest. The uncertainty of the initial rate is left out, because the manoeuvre does not cause it.

    Parameters
    ----------
    problem : Problem
    parameters : (n,) array
        Motion in its family.
    rng : numpy.random.Generator
    draws : int
        Number of draws of the prior.
    """
    limits = [limit for limit in problem.applied if limit.depends]
    largest = problem.largest(parameters, problem.draws(draws, rng), limits)
    return [
        Risk(limit.name, limit.bound, float(np.quantile(largest[:, index], CERTAIN)), limit.unit)
        for index, limit in enumerate(limits)
    ]


def _consistent(
    problem: Problem,
    points: Mapping[str, list[Floats]],
    optima: Sequence[SearchResult],
    search: Search,
    store: Store,
    progress: Progress,
) -> list[SearchResult]:
    """Return for each criterion a manoeuvre that no other is better than, by descents from those that are better."""
    result, alone = list(optima), replace(search, starts=0, exchanges=0)
    for number in range(PASSES):
        changed = False
        for index, criterion in enumerate(problem.criteria):
            draws = points[criterion.name]
            costs = [problem.cost(criterion, optimum.parameters, draws)[0] for optimum in result]
            best = int(np.argmin(costs))
            if costs[best] >= costs[index]:
                continue
            changed = True
            kept = store.of(f"{problem.plan.family.name}.{criterion.name}.again-{number}")
            again = SearchResult(result[best].parameters, costs[best], (), 0)
            if number < PASSES - 1:
                again = optimise(
                    problem,
                    criterion,
                    np.random.default_rng(0),  # no number is drawn
                    alone,
                    first=[result[best].parameters],
                    points=draws,
                    known=kept.known,
                    keep=kept.keep,
                )
            evaluations = again.evaluations + result[index].evaluations
            result[index] = SearchResult(again.parameters, again.cost, (again.cost, *result[index].costs), evaluations)
            progress((number + index / len(result)) / PASSES, f"{criterion.name}: best {again.cost:.4g}")
        if not changed:
            break
    return result


T = TypeVar("T")  # type of the result of one search


def _each(function: Callable[[int], T], places: Sequence[int], executor: Executor | None) -> list[T]:
    """Return a function's values at some places, computed in threads if there is an executor.

    If one fails or the user interrupts, the executor is shut down, so that the others end as well.
    """
    if executor is None:
        return [function(place) for place in places]
    with ThreadPoolExecutor(len(places)) as threads:
        try:
            return list(threads.map(function, places))
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise


class _Shares:
    """Progress of several computations at once, which is their mean.

    Parameters
    ----------
    progress : Progress
        Receiver of the mean.
    count : int
        Number of computations.
    """

    def __init__(self, progress: Progress, count: int) -> None:
        self._progress, self._fractions, self._lock = progress, [0.0] * count, Lock()

    def of(self, index: int) -> Progress:
        """Return the progress of one computation."""

        def receive(fraction: float, text: str) -> None:
            with self._lock:
                self._fractions[index] = fraction
                self._progress(sum(self._fractions) / len(self._fractions), text)

        return receive
