"""Manoeuvres designed by several criteria, each with its predicted posterior and the limits it reaches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, part_of, silent
from bayesid._math.arrays import Floats
from bayesid.design.criteria import Criterion
from bayesid.design.design_problem import Problem, Reached
from bayesid.design.plan import Trajectory
from bayesid.design.predicted_posterior import Encoder, Predicted, planned_manoeuvre, planned_posterior, predict
from bayesid.design.search_store import Store
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.design.trajectory_search import Found, Search, optimise
from bayesid.inference.posterior import Posterior
from bayesid.simulation.model import Manoeuvre

__all__ = ["Design", "Risk", "best_design", "design", "evaluate", "sample_times"]

CERTAIN = 0.99
"""Probability with which a limit must hold for a manoeuvre to be flown."""

DRAWS = 200
"""Number of draws of the prior for the risk of breaking a limit, enough for a 99 % quantile."""


@dataclass(frozen=True)
class Risk:
    """Risk of breaking a limit under the present uncertainty of the robot.

    Attributes
    ----------
    name : str
        Name of the limit.
    limit : float
        Bound of the limited quantity, in the unit.
    quantile : float
        Value that the quantity stays below along the whole manoeuvre with probability `CERTAIN`, in the unit.
    unit : str
        Unit of the quantity.
    """

    name: str
    limit: float
    quantile: float
    unit: str

    @property
    def go(self) -> bool:
        """True if the limit holds with probability `CERTAIN`."""
        return self.quantile <= self.limit


@dataclass(frozen=True)
class Design:
    """Designed manoeuvre.

    Attributes
    ----------
    name : str
        Name of the manoeuvre, which is also the stem of its file.
    criterion : str
        Name of the criterion by which it was designed.
    problem : Problem
        Design problem.
    parameters : (n,) array
        Parameters of the motion in its family.
    found : Found
        Outcome of the search.
    costs : mapping of str to float
        Values of all criteria of the problem, by name.
    posterior : Posterior
        Posterior of the manoeuvre as it would be recorded without noise.
    predicted : Predicted
        Predicted posterior of the bodies to identify.
    reached : sequence of Reached
        Largest values of all limited quantities.
    risks : sequence of Risk
        Risks of the limits that depend on the inertial parameters.
    """

    name: str
    criterion: str
    problem: Problem
    parameters: Floats
    found: Found
    costs: Mapping[str, float]
    posterior: Posterior
    predicted: Predicted
    reached: Sequence[Reached]
    risks: Sequence[Risk]

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
        """True if every limit holds with 99 % probability under the present uncertainty."""
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
                item.name: {
                    "limit": item.limit,
                    "largest": item.largest,
                    "unit": item.unit,
                    "active": bool(item.active),
                }
                for item in self.reached
            },
            "go": bool(self.go),
            "risk": {
                item.name: {"limit": item.limit, "quantile_99": item.quantile, "go": bool(item.go)}
                for item in self.risks
            },
            "criteria": dict(self.costs),
            "search": {"costs_of_starts": list(self.found.costs), "evaluations": self.found.evaluations},
            "file": f"{self.name}.csv",
        }


def best_design(designs: Sequence[Design]) -> Design:
    """Return the design with the smallest posterior covariance among those that keep their limits.

    Raises
    ------
    InputError
        If no design keeps its limits.
    """
    kept = [design for design in designs if all(reached.kept for reached in design.reached)]
    if not kept:
        broken = {item.name for design in designs for item in design.reached if not item.kept}
        raise InputError(
            f"no design keeps its limits along all of the manoeuvre: {', '.join(sorted(broken))}",
            place="design.limits",
            remedy="Loosen these limits, or allow more time",
        )
    return min(kept, key=lambda design: design.predicted.log_det)


def sample_times(duration: float, interval: float) -> Floats:
    """Return the times of all samples of a manoeuvre [s]; the last is its end if the interval divides the duration."""
    return interval * np.arange(int(np.floor(duration / interval + 1e-6)) + 1)


def design(
    problem: Problem,
    seed: int,
    encoder: Encoder,
    search: Search = Search(),  # noqa: B008  (immutable)
    *,
    store: Store | None = None,
    progress: Progress = silent,
) -> list[Design]:
    """Design a manoeuvre by every criterion of a problem.

    Each criterion is minimised from separate random starts, and then from the best result over all criteria, so that a
    search that happened to fail does no harm.

    Parameters
    ----------
    problem : Problem
        Design problem with its criteria.
    seed : int
        Seed of all random numbers.
    encoder : Encoder
        Noise of the encoders, for the predicted posterior.
    search : Search
        Effort of the search by each criterion.
    store : Store, optional
        Store of the results, for a run that may be interrupted.
    progress : Progress
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If no manoeuvre keeps the limits.
    """
    store = Store.forgetful() if store is None else store
    seeds = np.random.SeedSequence(seed).spawn(2 * len(problem.criteria) + 1)
    count = len(problem.criteria)
    first: list[Found] = []
    for index, criterion in enumerate(problem.criteria):
        starts = store.of(f"{problem.plan.family.name}.{criterion.name}")
        first.append(
            optimise(
                problem,
                criterion,
                np.random.default_rng(seeds[index]),
                search,
                known=starts.known,
                keep=starts.keep,
                progress=part_of(progress, index / (2 * count), (index + 1) / (2 * count)),
            )
        )
    polished = []
    for index, criterion in enumerate(problem.criteria):
        polished.append(
            _crossed(
                problem,
                criterion,
                index,
                first,
                np.random.default_rng(seeds[count + index]),
                search,
                store,
                part_of(progress, (count + index) / (2 * count), (count + index + 1) / (2 * count)),
            )
        )
    rng = np.random.default_rng(seeds[-1])
    designs: list[Design] = []
    for criterion, item in zip(problem.criteria, polished, strict=True):
        like = designs[0].posterior if designs else None
        designs.append(evaluate(problem, criterion.name, item, encoder, rng, like))
    return designs


def evaluate(
    problem: Problem,
    name: str,
    found: Found,
    encoder: Encoder,
    rng: np.random.Generator,
    like: Posterior | None = None,
) -> Design:
    """Return the design of a motion with its predicted posterior, given all sensor and encoder noise, and its limits.

    Parameters
    ----------
    problem : Problem
        Design problem.
    name : str
        Name of the manoeuvre and of its criterion.
    found : Found
        Outcome of the search, with the parameters of the motion.
    encoder : Encoder
        Noise of the encoders.
    rng : numpy.random.Generator
        Source of the draws for the risks.
    like : Posterior, optional
        Posterior of another design of the problem; it has no effect any more.
    """
    plan = problem.plan
    parameters = found.parameters
    manoeuvre = planned_manoeuvre(
        plan.model,
        plan.family.motion(parameters),
        sample_times(plan.family.duration, plan.interval),
        name,
        encoder,
        plan.attitude,
        attitude_sigma=plan.attitude_sigma,
        argument_of_latitude=plan.argument_of_latitude,
    )
    posterior = planned_posterior(plan.model, [manoeuvre], like)
    return Design(
        name=name,
        criterion=name,
        problem=problem,
        parameters=parameters,
        found=found,
        costs=problem.costs(parameters),
        posterior=posterior,
        predicted=predict(posterior),
        reached=problem.reached(parameters),
        risks=risks(problem, parameters, rng),
    )


def risks(problem: Problem, parameters: Floats, rng: np.random.Generator, draws: int = DRAWS) -> list[Risk]:
    """Return the risks of all limits that depend on the inertial parameters, with 99 % quantiles over their prior.

    The base starts at rest. The uncertainty of the initial rate is left out, because the manoeuvre does not cause it.
    """
    limits = [limit for limit in problem.applied if limit.depends]
    largest = problem.largest(parameters, problem.draws(draws, rng), limits)
    return [
        Risk(limit.name, limit.bound, float(np.quantile(largest[:, index], CERTAIN)), limit.unit)
        for index, limit in enumerate(limits)
    ]


def _crossed(
    problem: Problem,
    criterion: Criterion,
    index: int,
    first: Sequence[Found],
    rng: np.random.Generator,
    search: Search,
    store: Store,
    progress: Progress,
) -> Found:
    """Search once more from the best result over all criteria, and return the outcome with the costs of all starts."""
    points = problem.points(criterion, rng)
    present = problem.cost(criterion, first[index].parameters, points)[0]
    candidates = [(problem.cost(criterion, other.parameters, points)[0], other.parameters) for other in first]
    best_cost, best = min(candidates, key=lambda pair: pair[0])
    kept = store.of(f"{problem.plan.family.name}.{criterion.name}.crossed")
    again = optimise(
        problem,
        criterion,
        rng,
        Search(1, search.iterations, search.tolerance),
        first=best if best_cost < present else first[index].parameters,
        known=kept.known,
        keep=kept.keep,
        progress=progress,
    )
    costs = (again.cost, *first[index].costs)
    evaluations = again.evaluations + first[index].evaluations
    return Found(again.parameters, again.cost, costs, evaluations)
