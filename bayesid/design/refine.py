"""Descent from one start by SLSQP with exact gradients, as a task that any executor can run."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import blake2b
from typing import Any

import numpy as np
from scipy.optimize import minimize
from threadpoolctl import threadpool_limits

from bayesid._math.arrays import Floats
from bayesid.design.criteria import Criterion
from bayesid.design.design_problem import Problem
from bayesid.design.search_starts import repaired, within_limits

__all__ = ["Refined", "Shared", "Task", "fitted_to_fine_limits", "refine"]

# largest number of times that a descent goes on because its end breaks a limit between the instants of the search
TRIES = 8
# effort of a descent within loosened limits: largest number of iterations, and factor on the tolerance
LOOSENED_ITERATIONS, LOOSENED_TOLERANCE = 60, 10.0
SPARE = 0.999  # fraction of a bound at which such a limit is to end


@dataclass(frozen=True)
class Refined:
    """Best motion of a descent that keeps the limits."""

    parameters: Floats  #: (n,) parameters of the motion
    cost: float  #: its cost; infinite where none keeps the limits
    evaluations: int  #: number of evaluations of the cost


class Shared:
    """Problem that tasks carry to other processes, each of which compiles it once.

    Parameters
    ----------
    problem : Problem
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def __reduce__(self) -> tuple[Callable[[bytes], Shared], tuple[bytes]]:
        return _revived, (pickle.dumps(self.problem),)


_known: dict[bytes, Shared] = {}


def _revived(content: bytes) -> Shared:
    key = blake2b(content).digest()
    if key not in _known:
        _known[key] = Shared(pickle.loads(content))
    return _known[key]


@dataclass(frozen=True)
class Task:
    """Descent to be run.

    Parameters
    ----------
    shared : Shared
        Problem.
    criterion : Criterion
        Criterion to minimise.
    points : list of (n,) arrays
        Points of the unknowns over which it is averaged, empty for the prior's centre.
    start : (n,) array
        Parameters to start from.
    iterations : int
        Largest number of iterations.
    tolerance : float
        Tolerance of the cost at which SLSQP stops, relative to that of the start where that is below one.
    loosened : float
        Factor on the limits of a short descent that comes first, where it is above one.
    """

    shared: Shared
    criterion: Criterion
    points: list[Floats]
    start: Floats
    iterations: int
    tolerance: float
    loosened: float = 1.0


@threadpool_limits.wrap(limits=1)  # sums of several threads are rounded by chance
def refine(task: Task) -> Refined:
    """Run a descent, from a start that is repaired first if it breaks a limit.

    Within loosened limits a descent passes by many of the minima at which one within the limits ends.
    """
    start, earlier = task.start, 0
    if task.loosened > 1.0:
        problem = task.shared.problem
        shares = np.ones(len(problem.applied)) if problem.shares is None else np.array(problem.shares)
        wide = _Descent(
            replace(
                task,
                shared=Shared(problem.using(task.loosened * shares)),
                iterations=min(task.iterations, LOOSENED_ITERATIONS),
                tolerance=LOOSENED_TOLERANCE * task.tolerance,
            )
        )
        wide.run()
        start, earlier = wide.best, wide.evaluations
    run = _Descent(replace(task, start=start))
    run.run()
    return Refined(run.best, run.best_cost, earlier + run.evaluations)


class _Descent:
    """SLSQP with the best point so far that keeps the limits, since its iterates lie slightly outside."""

    def __init__(self, task: Task) -> None:
        self.task, self.problem = task, task.shared.problem
        self.evaluations = 0
        self.best = repaired(self.problem, np.array(task.start, dtype=float))
        self.best_cost = np.inf
        if within_limits(self.problem, self.best):
            self.best_cost = self._value(self.best)[0]
        # most costs are in nats; SLSQP's first steps follow the size of the gradient, and its tolerance is absolute
        self.unit = float(np.clip(abs(self.best_cost), 1e-12, 1.0))

    def run(self) -> None:
        """Descend from the best point, if there is one within the limits."""
        if not np.isfinite(self.best_cost) or not self.task.iterations:
            return
        family = self.problem.plan.family
        constraints: Any = {"type": "ineq", "fun": self._margin, "jac": self._margin_slope}
        options: Any = {"maxiter": self.task.iterations, "ftol": self.task.tolerance}
        begin = (self.best - family.centre) / family.scale
        end = minimize(self._cost, begin, jac=True, method="SLSQP", constraints=constraints, options=options)
        final = repaired(self.problem, self._parameters(end.x), 1.0)
        self._consider(final, self._value(final)[0])

    def _parameters(self, x: Floats) -> Floats:
        family = self.problem.plan.family
        return family.centre + family.scale * x

    def _value(self, parameters: Floats) -> tuple[float, Floats]:
        self.evaluations += 1
        return self.problem.cost(self.task.criterion, parameters, self.task.points)

    def _consider(self, parameters: Floats, value: float) -> None:
        if value < self.best_cost and within_limits(self.problem, parameters):
            self.best, self.best_cost = parameters, value

    def _cost(self, x: Floats) -> tuple[float, Floats]:
        parameters = self._parameters(x)
        value, slope = self._value(parameters)
        if not np.isfinite(value):
            return 1e6, np.zeros_like(x)
        self._consider(parameters, value)
        return value / self.unit, slope * self.problem.plan.family.scale / self.unit

    def _margin(self, x: Floats) -> Floats:
        return 1.0 - self.problem.fractions(self._parameters(x))[0]

    def _margin_slope(self, x: Floats) -> Floats:
        return -self.problem.fractions(self._parameters(x))[1] * self.problem.plan.family.scale


def fitted_to_fine_limits(task: Task) -> Refined:
    """Go on with a descent until its end keeps the limits between the instants of the search, too.

    A limit that is broken there gets as much less of its bound at the instants as it is broken by, and the descent goes
    on with that. The cost is infinite where no end keeps the limits.
    """
    problem, parameters, evaluations = task.shared.problem, task.start, 0
    shares = np.ones(len(problem.applied))
    for _ in range(TRIES):
        used = np.array([reached.largest / reached.limit for reached in problem.reached(parameters)])
        if used.max() <= 1.0:
            cost = problem.cost(task.criterion, parameters, task.points)[0]
            return Refined(parameters, cost, evaluations + 1)
        shares = np.where(used > 1.0, SPARE * shares / np.maximum(used, 1.0), shares)
        done = refine(replace(task, shared=Shared(problem.using(shares)), start=parameters))
        parameters, evaluations = done.parameters, evaluations + done.evaluations
    return Refined(parameters, np.inf, evaluations)
