"""Search for the best manoeuvre: SLSQP with exact gradients from several starts, within the limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.design.criteria import Criterion
from bayesid.design.design_problem import Problem

__all__ = ["Found", "Search", "optimise"]


FILLED = 0.8
"""Fraction of the tightest limit that random starts use, so that they begin inside the limits."""

SHRUNK = 12
"""Largest number of times that a random start is shrunk."""

SLACK = 1e-6
"""Fraction of a limit by which the optimiser may exceed it, since the smooth maximum lies above the true one."""


@dataclass(frozen=True)
class Search:
    """Effort of a search.

    Parameters
    ----------
    starts : int
        Number of random starts.
    iterations : int
        Largest number of iterations of SLSQP from each start.
    tolerance : float
        Tolerance of the cost, relative to that of the start, at which SLSQP stops.
    """

    starts: int = 4
    iterations: int = 200
    tolerance: float = 1e-5


@dataclass(frozen=True)
class Found:
    """Outcome of a search.

    Attributes
    ----------
    parameters : (n,) array
        Parameters of the best motion.
    cost : float
        Cost of the best motion.
    costs : tuple of float
        Costs of the feasible starts, the best first.
    evaluations : int
        Number of evaluations of the cost over all starts.
    """

    parameters: Floats
    cost: float
    costs: tuple[float, ...]
    evaluations: int


def optimise(
    problem: Problem,
    criterion: Criterion,
    rng: np.random.Generator,
    search: Search = Search(),
    *,
    first: Floats | None = None,
    known: Callable[[int], tuple[Floats, float, int] | None] = lambda start: None,
    keep: Callable[[int, Floats, float, int], None] = lambda start, parameters, cost, evaluations: None,
    progress: Progress = silent,
) -> Found:
    """Minimise a criterion within the limits.

    Parameters
    ----------
    problem : Problem
        Family of motions and limits.
    criterion : Criterion
        Criterion to minimise, one of the problem's.
    rng : numpy.random.Generator
        Source of the random starts.
    search : Search
        Effort of the search.
    first : (n,) array, optional
        Parameters to start from in place of the first random start.
    known : callable
        Function of the number of a start that returns parameters, cost and evaluations of an earlier run from it, or
        None.
    keep : callable
        Function that receives number, parameters, cost and evaluations of every start when it is done.
    progress : Progress
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If no start leads to a manoeuvre within the limits; the message names the broken limits.
    """
    points = problem.points(criterion, rng)
    results: list[tuple[float, Floats]] = []
    evaluations, broken = 0, ""
    for start in range(search.starts):
        begin = _random_start(problem, rng)
        if start == 0 and first is not None:
            begin = np.array(first, dtype=float)
        earlier = known(start)
        if earlier is not None:
            results.append((earlier[1], earlier[0]))
            evaluations += earlier[2]
            continue
        begin = _repaired(problem, begin)
        fractions = problem.fractions(begin)[0]
        if fractions.max() > 1.0 + SLACK:
            broken = _describe(problem, fractions)
            continue
        run = _Run(problem, criterion, points, start, search, progress, begin)
        run.minimise()
        evaluations += run.evaluations
        results.append((run.best_cost, run.best))
        keep(start, run.best, run.best_cost, run.evaluations)
    if not results:
        raise InputError(
            f"no manoeuvre of the family {problem.plan.family.name!r} was found within the limits: {broken}",
            place="design.limits",
            remedy="Loosen these limits, allow more time, or move other joints",
        )
    results.sort(key=lambda pair: pair[0])
    return Found(results[0][1], results[0][0], tuple(cost for cost, _ in results), evaluations)


class _Run:
    """One run of SLSQP, with the best point so far that keeps the limits."""

    def __init__(
        self,
        problem: Problem,
        criterion: Criterion,
        points: list[Floats],
        number: int,
        search: Search,
        progress: Progress,
        begin: Floats,
    ) -> None:
        self.problem, self.criterion, self.points = problem, criterion, points
        self.number, self.search, self.progress = number, search, progress
        self.best, self.evaluations, self.iteration = begin, 0, 0
        self.best_cost = problem.cost(criterion, begin, points)[0]
        self.unit = max(abs(self.best_cost), 1e-12)  # SLSQP's tolerance is absolute

    def minimise(self) -> None:
        family = self.problem.plan.family
        constraints: Any = {"type": "ineq", "fun": self.margin, "jac": self.margin_slope}
        report: Any = self.report
        options: Any = {"maxiter": self.search.iterations, "ftol": self.search.tolerance}
        for tighter in (1.0, 0.99, 0.97, 0.9):  # in case the fine grid shows larger values
            self.bound = tighter
            end = minimize(
                self.cost,
                (self.best - family.centre) / family.scale,
                jac=True,
                method="SLSQP",
                constraints=constraints,
                callback=report,
                options=options,
            )
            # SLSQP's iterates lie slightly outside the limits until it has converged
            self.consider(_repaired(self.problem, family.centre + family.scale * end.x, tighter))
            if all(reached.kept for reached in self.problem.reached(self.best)):
                return
            self.best = _repaired(self.problem, self.best, 0.98 * tighter)
            self.best_cost = self.problem.cost(self.criterion, self.best, self.points)[0]

    def consider(self, parameters: Floats) -> None:
        """Keep the parameters if they are better than the best so far and break no limit."""
        value = self.problem.cost(self.criterion, parameters, self.points)[0]
        if value < self.best_cost and self.problem.fractions(parameters)[0].max() <= self.bound + SLACK:
            self.best, self.best_cost = parameters, value

    def cost(self, x: Floats) -> tuple[float, Floats]:
        family = self.problem.plan.family
        parameters = family.centre + family.scale * x
        value, slope = self.problem.cost(self.criterion, parameters, self.points)
        self.evaluations += 1
        if not np.isfinite(value):
            return 1e6, np.zeros_like(x)
        if value < self.best_cost and self.problem.fractions(parameters)[0].max() <= self.bound + SLACK:
            self.best, self.best_cost = parameters, value
        return value / self.unit, slope * family.scale / self.unit

    def margin(self, x: Floats) -> Floats:
        family = self.problem.plan.family
        return self.bound - self.problem.fractions(family.centre + family.scale * x)[0]

    def margin_slope(self, x: Floats) -> Floats:
        family = self.problem.plan.family
        return -self.problem.fractions(family.centre + family.scale * x)[1] * family.scale

    def report(self, x: Floats) -> None:
        self.iteration += 1
        done = (self.number + min(1.0, self.iteration / self.search.iterations)) / self.search.starts
        self.progress(done, f"{self.criterion.name}: start {self.number + 1}, best {self.best_cost:.4g}")


def _random_start(problem: Problem, rng: np.random.Generator) -> Floats:
    """Draw parameters and shrink them towards the centre until they use at most `FILLED` of the tightest limit.

    Only limits that a smaller motion helps to keep are considered.
    """
    family = problem.plan.family
    direction = family.scale * rng.normal(size=family.size)
    helped = [limit.shrinks for limit in problem.applied]
    for size in 0.6 ** np.arange(SHRUNK):
        if problem.fractions(family.centre + size * direction)[0][helped].max() <= FILLED:
            break
    return family.centre + size * direction


def _repaired(problem: Problem, parameters: Floats, bound: float = 1.0 - 1e-3) -> Floats:
    """Return parameters that keep the limits, by descent from given ones; the same parameters where none is broken."""
    family = problem.plan.family

    def excess(x: Floats) -> tuple[float, Floats]:
        value, slope = problem.fractions(family.centre + family.scale * x)
        over = np.maximum(value - bound, 0.0)
        return float(0.5 * over @ over), (over @ slope) * family.scale

    x = (parameters - family.centre) / family.scale
    if excess(x)[0] == 0.0:
        return parameters
    # a slightly lower bound, so that the result lies inside the limits
    bound -= 2e-3
    return family.centre + family.scale * minimize(excess, x, jac=True, method="L-BFGS-B").x


def _describe(problem: Problem, fractions: Floats) -> str:
    parts = [
        f"{limit.name} {fraction * limit.bound:.4g}{'' if limit.unit == '1' else f' {limit.unit}'} where "
        f"{limit.bound:.4g} is allowed"
        for limit, fraction in zip(problem.applied, fractions, strict=True)
        if fraction > 1.0 + SLACK
    ]
    return "; ".join(parts)
