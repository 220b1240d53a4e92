"""What more starts of a search are worth: the best of n among N descents from random starts, and repeated searches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import hypergeom

from bayesid._io.progress import Progress
from bayesid._math.arrays import Floats
from bayesid.design import Criterion, DOptimal, Paper26, Problem, Search, Store, optimise

__all__ = ["CROWDED", "Crowd", "Searches", "crowd_of", "searches_of"]

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
    kept = store.of(
        f"{name}{search.starts} starts.{criterion.name}"
    )  # which descents are followed depends on their number
    index = problem.criteria.index(criterion)
    rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(index + 1)[index])
    found = optimise(problem, criterion, rng, search, known=kept.known, keep=kept.keep, progress=progress)
    descents: Sequence[tuple[Floats, float, int] | None] = [kept.known(f"0.{k}") for k in range(search.starts)]
    return Crowd(found.parameters, found.cost, np.array([item[1] for item in descents if item is not None]))


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
    found = []
    for number in range(count):
        kept = store.of(f"{name}search {number}.{criterion.name}")
        rng = np.random.default_rng([seed, number])
        found.append(optimise(problem, criterion, rng, search, known=kept.known, keep=kept.keep, progress=progress))
    costs = np.array([item.cost for item in found])
    return Searches(found[int(costs.argmin())].parameters, costs)
