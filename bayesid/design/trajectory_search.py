"""Search for the best manoeuvre: descents from many starts, of which the best are followed to the end.

On ETS-VII 1 of 100 descents from random motions ends in the basin of the best manoeuvre. Those from swings to which the
base reacts much (`bayesid.design.search_starts`) end lower, descents that pass through loosened limits end there more
often, and so do those from good manoeuvres with the courses of some joints exchanged; a thorough search makes use of
all three.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._io.store import JsonStore
from bayesid._math.arrays import Floats
from bayesid.design.criteria import Criterion
from bayesid.design.design_problem import Problem
from bayesid.design.refine import Refined, Shared, Task, fitted_to_fine_limits, refine
from bayesid.design.search_starts import SLACK, exchanged, random_start, reacting_swing

__all__ = ["THOROUGH", "Search", "SearchResult", "Store", "optimise"]

REACTING = 2.0 / 3.0  # fraction of the starts that are swings to which the base reacts much, where the family is linear
FOLLOWED = 3  # number of motions that are followed to the end, unless there are fewer
GENERATION = 6  # exchanges that are made between the same motions; so many descents may run at once
PARENTS = 4  # number of the best motions between which courses are exchanged
# factor on the tolerance with which they are: where limits change, SLSQP's first end is 1 to 2 nats too early
FINISH = 1e-3
# difference of the cost below which two motions count as one: 1 % of ten parameters, where the cost is in nats
ALIKE = 0.1
Kept = tuple[Floats, float, int]  # parameters, cost and number of evaluations of one descent


@dataclass(frozen=True)
class Search:
    """Effort of a search.

    Parameters
    ----------
    starts : int
        Number of starts drawn at random.
    iterations : int
        Largest number of iterations of SLSQP from each.
    exchanges : int
        Number of further starts, the best motions so far with the motions of some joints exchanged.
    loosened : float
        Factor on the limits of a short descent with which those from random starts begin, where it is above one.
    tolerance : float
        Tolerance of the cost at which SLSQP stops at first, relative to that of the start where that is below one.
    executor : concurrent.futures.Executor, optional
        Executor of the descents, in threads, processes or on other machines; by default they run one after the other.
        It has no influence on the result.
    """

    starts: int = 12
    iterations: int = 400
    exchanges: int = 0
    loosened: float = 1.0
    tolerance: float = 1e-3
    executor: Executor | None = field(default=None, compare=False, repr=False)


THOROUGH = Search(exchanges=36, loosened=3.0)
"""Effort with which a search for ETS-VII takes five times the evaluations of the usual one, and ends lower."""


@dataclass(frozen=True)
class SearchResult:
    """Outcome of a search."""

    parameters: Floats  #: (n,) parameters of the best motion
    cost: float  #: cost of the best motion
    costs: tuple[float, ...]  #: costs of the descents that were followed to the end, the best first
    evaluations: int  #: number of evaluations of the cost over all starts


@threadpool_limits.wrap(limits=1)  # sums of several threads are rounded by chance
def optimise(
    problem: Problem,
    criterion: Criterion,
    rng: np.random.Generator,
    search: Search = Search(),
    *,
    first: Sequence[Floats] = (),
    points: list[Floats] | None = None,
    known: Callable[[str], Kept | None] = lambda descent: None,
    keep: Callable[[str, Floats, float, int], None] = lambda descent, parameters, cost, evaluations: None,
    progress: Progress = silent,
) -> SearchResult:
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
    first : sequence of (n,) arrays
        Parameters to start from in addition to the random starts.
    points : list of (n,) arrays, optional
        Points of the unknowns over which the criterion is averaged, by default as many draws as it requires.
    known : callable
        Function of the name of a descent that returns parameters, cost and evaluations of it in an earlier run, or
        None.
    keep : callable
        Function that receives name, parameters, cost and evaluations of every descent when it is done.
    progress : Progress
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If no start leads to a manoeuvre within the limits; the message names the broken limits.
    """
    problem.compile()
    points = problem.points(criterion, rng) if points is None else points
    starts = [*first, *(_start(problem, rng) for _ in range(search.starts))]
    followed = min(FOLLOWED, len(starts) + search.exchanges)
    first_round = [] if len(starts) <= followed and not search.exchanges else starts
    total = (len(first_round) + search.exchanges + followed) * (search.iterations + 1)
    work = _Work(problem, criterion, search, known, keep, progress, total)
    # one point of the unknowns ranks them well enough
    loosened = [1.0] * len(first) + [search.loosened] * search.starts
    pool = work.run(0, first_round, search.tolerance, points[:1], loosened)
    for number in range(-(-search.exchanges // GENERATION)):
        size = min(GENERATION, search.exchanges - number * GENERATION)
        parents = [descent.parameters for descent in _ranked(pool, problem)[:PARENTS]]
        children = [exchanged(problem, parents, rng) for _ in range(size)]
        pool += work.run(2 + number, children, search.tolerance, points[:1])
    last = [descent.parameters for descent in _ranked(pool, problem)[:followed]] if pool else starts
    ends = work.run(1, last, FINISH * search.tolerance, points)
    optimum, *others = _ranked(work.fitted(ends, FINISH * search.tolerance, points), problem)
    costs = (optimum.cost, *(descent.cost for descent in others))
    return SearchResult(optimum.parameters, optimum.cost, costs, work.evaluations)


def _start(problem: Problem, rng: np.random.Generator) -> Floats:
    """Draw a start: mostly a swing to which the base reacts much, else a random motion."""
    family = problem.plan.family
    return reacting_swing(problem, rng) if family.imitates and rng.random() < REACTING else random_start(problem, rng)


def _ranked(done: Sequence[Refined], problem: Problem) -> list[Refined]:
    """Return what keeps the limits, the best first, without what is alike.

    Raises
    ------
    InputError
        If nothing keeps the limits; the message names the broken ones.
    """
    ranked: list[Refined] = []
    for descent in sorted((one for one in done if np.isfinite(one.cost)), key=lambda one: one.cost):
        if not ranked or descent.cost - ranked[-1].cost > ALIKE * min(abs(descent.cost), 1.0):
            ranked.append(descent)
    if not ranked:
        raise InputError(
            f"no manoeuvre of the family {problem.plan.family.name!r} satisfies the limits: "
            f"{_describe(problem, done[0].parameters)}",
            place="design.limits",
            remedy="Relax these limits, allow more time, or move other joints",
        )
    return ranked


@dataclass
class _Work:
    """Descents of one search, with their number and the time that they take."""

    problem: Problem
    criterion: Criterion
    search: Search
    known: Callable[[str], Kept | None]
    keep: Callable[[str, Floats, float, int], None]
    progress: Progress
    total: int
    done: int = 0
    evaluations: int = 0
    best: float = np.inf
    began: float = field(default_factory=time.monotonic)

    def run(
        self,
        number: int,
        starts: Sequence[Floats],
        tolerance: float,
        points: list[Floats],
        loosened: Sequence[float] | None = None,
    ) -> list[Refined]:
        """Run the descents of one round that no earlier run has finished, each within loosened limits first."""
        results: dict[int, Refined] = {}
        shared, tasks = Shared(self.problem), {}
        for index, start in enumerate(starts):
            earlier = self.known(f"{number}.{index}")
            if earlier is not None:
                self._finish(results, index, Refined(*earlier))
            else:
                wide = 1.0 if loosened is None else loosened[index]
                tasks[index] = Task(shared, self.criterion, points, start, self.search.iterations, tolerance, wide)
        for index, result in self._each(tasks):
            if np.isfinite(result.cost):
                self.keep(f"{number}.{index}", result.parameters, result.cost, result.evaluations)
            self._finish(results, index, result)
        return [results[index] for index in range(len(starts))]

    def fitted(self, ends: Sequence[Refined], tolerance: float, points: list[Floats]) -> list[Refined]:
        """Go on with descents until they keep the limits between the instants of the search, too."""
        kept = [
            fitted_to_fine_limits(
                Task(Shared(self.problem), self.criterion, points, end.parameters, self.search.iterations, tolerance)
            )
            for end in ends
            if np.isfinite(end.cost)
        ]
        self.evaluations += sum(descent.evaluations for descent in kept)
        return kept or list(ends)

    def _each(self, tasks: dict[int, Task]):  # type: ignore[no-untyped-def]
        """Return the results of tasks as they become known, each with its number."""
        if self.search.executor is None:
            yield from ((index, refine(task)) for index, task in tasks.items())
            return
        futures = {self.search.executor.submit(refine, task): index for index, task in tasks.items()}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            for future in futures:
                future.cancel()

    def _finish(self, results: dict[int, Refined], index: int, result: Refined) -> None:
        results[index] = result
        self.done += self.search.iterations + 1
        self.evaluations += result.evaluations
        self.best = min(self.best, result.cost)
        spent = max(time.monotonic() - self.began, 1e-9)
        left = spent * (self.total - self.done) / self.done
        self.progress(
            self.done / self.total,
            f"{self.criterion.name}: best {self.best:.4g}, {self.evaluations / spent:.0f} evaluations/s, "
            f"{left:.0f} s remaining",
        )


def _describe(problem: Problem, parameters: Floats) -> str:
    largest: dict[str, tuple[float, str]] = {}
    for index, fraction in zip(problem.limit_of_fraction, problem.fractions(parameters)[0], strict=True):
        limit = problem.applied[index]
        if fraction > max(1.0 + SLACK, largest.get(limit.name, (0.0, ""))[0]):
            unit = "" if limit.unit == "1" else f" {limit.unit}"
            text = f"{limit.name} {fraction * limit.bound:.4g}{unit}, allowed {limit.bound:.4g}"
            largest[limit.name] = (float(fraction), text)
    return "; ".join(text for _, text in largest.values())


@dataclass
class Store:
    """Results of several searches, each of several descents.

    Parameters
    ----------
    file : Path or None
        JSON file of the results; None stores them in memory only.
    key : str
        Key of the design problem; results under another key are discarded.
    results : dict
        Parameters, cost and number of evaluations by search and descent.
    lock : threading.Lock
        Lock of the results, which several searches may add at once.
    """

    file: Path | None
    key: str
    results: dict[str, dict[str, tuple[list[float], float, int]]] = field(default_factory=dict)
    lock: Lock = field(default_factory=Lock, repr=False)

    @classmethod
    def forgetful(cls) -> Store:
        """Return a store in memory only."""
        return cls(None, "")

    @classmethod
    def open(cls, file: Path, key: str) -> Store:
        """Read the results of an interrupted run with the same key, if there are any.

        Parameters
        ----------
        file : Path
            JSON file of the results.
        key : str
            Key of the design problem.

        Raises
        ------
        InputError
            If the file cannot be read.
        """
        return cls(file, key, _kept(file, key).read("results") or {})

    def of(self, search: str) -> Starts:
        """Return the results of one search, by its name."""
        return Starts(self, search)

    def write(self) -> None:
        """Write the file, whole or not at all."""
        if self.file is not None:
            _kept(self.file, self.key).write(results=self.results)

    def remove(self) -> None:
        """Delete the file once the results are no longer needed."""
        if self.file is not None:
            self.file.unlink(missing_ok=True)


@dataclass(frozen=True)
class Starts:
    """Results of one search, by the name of the descent."""

    store: Store
    search: str

    def known(self, descent: str) -> tuple[Floats, float, int] | None:
        """Return parameters, cost and number of evaluations of a descent, None where there are none."""
        entry = self.store.results.get(self.search, {}).get(descent)
        return None if entry is None else (np.array(entry[0]), float(entry[1]), int(entry[2]))

    def keep(self, descent: str, parameters: Floats, cost: float, evaluations: int) -> None:
        """Add the result of a descent, and write the file.

        Parameters
        ----------
        descent : str
            Name of the descent.
        parameters : (n,) array
            Parameters of its end.
        cost : float
            Cost there.
        evaluations : int
            Number of evaluations of the cost.
        """
        with self.store.lock:
            results = self.store.results.setdefault(self.search, {})
            results[descent] = ([float(value) for value in parameters], float(cost), evaluations)
            self.store.write()


def _kept(file: Path, key: str) -> JsonStore:
    return JsonStore(file, key, "search", "study, seed or effort", disposable=True)
