"""Manoeuvres designed by several criteria, each with the posterior it leads to and the limits it keeps."""

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
"""Probability with which a limit must hold for a go."""

DRAWS = 200
"""Of the prior, for the risk of breaking a limit."""


@dataclass(frozen=True)
class Risk:
    """A limit under the present uncertainty of the robot.

    Attributes
    ----------
    name : str
    limit : float
    quantile : float
        What the largest value along the manoeuvre stays below with probability `CERTAIN`.
    unit : str
    """

    name: str
    limit: float
    quantile: float
    unit: str

    @property
    def go(self) -> bool:
        """Whether the limit holds with that probability."""
        return self.quantile <= self.limit


@dataclass(frozen=True)
class Design:
    """A designed manoeuvre.

    Attributes
    ----------
    name : str
        Also its file's stem.
    criterion : str
        What it was designed by.
    problem : Problem
    parameters : (n,) array
        Of the family of motions.
    found : Found
        How the search went.
    costs : mapping of str to float
        Every criterion of the problem.
    posterior : Posterior
        Of the manoeuvre as it would be recorded without noise.
    predicted : Predicted
    reached : sequence of Reached
    risks : sequence of Risk
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
        """The manoeuvre as it would be recorded, without noise."""
        return self.posterior.manoeuvres[0]

    @property
    def motion(self) -> ParameterisedMotion:
        """The joints' motion."""
        return self.problem.plan.family.motion(self.parameters)

    @property
    def trajectory(self) -> Trajectory:
        """What the robot does at the prior's centre, on a fine grid."""
        return self.problem.trajectory(self.parameters)

    @property
    def go(self) -> bool:
        """Whether every limit holds with 99 % under the present uncertainty."""
        return all(risk.go for risk in self.risks) and all(reached.kept for reached in self.reached)

    def to_dict(self) -> dict[str, Any]:
        """Entry of design.json."""
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
    """Return the design that leads to the smallest posterior, of those that keep their limits."""
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
    """Return the times of all samples of a manoeuvre [s]; the last one is its end if the interval divides it."""
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

    Each criterion is searched from its own random starts, then from the best that the others found, so that none is
    worse off for a search that happened to fail.

    Parameters
    ----------
    seed : int
    encoder : Encoder
        Noise of the encoders, for the predicted posterior.
    store : Store, optional
        Keeps what was found, for a run that is interrupted.

    Raises
    ------
    InputError
        Where no manoeuvre keeps the limits.
    """
    store = Store.forgetful() if store is None else store
    seeds = np.random.SeedSequence(seed).spawn(2 * len(problem.criteria) + 1)
    count = len(problem.criteria)
    found: list[Found] = []
    for index, criterion in enumerate(problem.criteria):
        own = store.of(f"{problem.plan.family.name}.{criterion.name}")
        found.append(
            optimise(
                problem,
                criterion,
                np.random.default_rng(seeds[index]),
                search,
                known=own.known,
                keep=own.keep,
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
                found,
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
    """Compute the posterior a manoeuvre leads to, with the noise of all sensors and encoders, and its limits.

    Compiled functions are shared with those of ``like``.
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
    """Return, for every limit that depends on the inertial parameters, its 99 % quantile over their prior.

    The base starts at rest: the uncertainty of the initial rate, which the manoeuvre does not cause, is left out.
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
    found: Sequence[Found],
    rng: np.random.Generator,
    search: Search,
    store: Store,
    progress: Progress,
) -> Found:
    """Search once more from the best of what all criteria found, and return the better result."""
    points = problem.points(criterion, rng)
    own = problem.cost(criterion, found[index].parameters, points)[0]
    candidates = [(problem.cost(criterion, other.parameters, points)[0], other.parameters) for other in found]
    best_cost, best = min(candidates, key=lambda pair: pair[0])
    kept = store.of(f"{problem.plan.family.name}.{criterion.name}.crossed")
    again = optimise(
        problem,
        criterion,
        rng,
        Search(1, search.iterations, search.tolerance),
        first=best if best_cost < own else found[index].parameters,
        known=kept.known,
        keep=kept.keep,
        progress=progress,
    )
    costs = (again.cost, *found[index].costs)
    evaluations = again.evaluations + found[index].evaluations
    return Found(again.parameters, again.cost, costs, evaluations)
