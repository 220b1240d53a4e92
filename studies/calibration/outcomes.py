"""Outcomes of the replicates: whether ranks are uniform, and the coverage of the intervals, by case and by method."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from studies.calibration.data import Case
from studies.calibration.replicate import Method
from studies.common.monte_carlo import read_store

K = TypeVar("K", bound=Hashable)

# points at which the distribution function of the ranks is compared with that of the uniform one
POINTS = np.arange(1, 20) / 20.0


def uniform_p_value(ranks: Floats) -> float:
    """Return the p-value of ranks (N,) in (0, 1) being uniform, exact and simultaneous over `POINTS`.

    The statistic is the smallest binomial tail of any count of ranks below a point (Säilynoja, Bürkner & Vehtari 2022);
    its distribution follows by recursion from point to point, since the counts are a Markov chain.
    """
    total = len(ranks)
    observed = np.searchsorted(np.sort(ranks), POINTS, side="right")
    least = min(np.minimum(stats.binom.cdf(observed, total, POINTS), stats.binom.sf(observed - 1, total, POINTS)))
    every = np.arange(total + 1)
    before, probability, last = np.zeros(1, dtype=int), np.ones(1), 0.0
    for here in POINTS:
        tails = np.minimum(stats.binom.cdf(every, total, here), stats.binom.sf(every - 1, total, here))
        inside = every[tails > least * (1.0 + 1e-9)]
        step = stats.binom.pmf(inside - before[:, None], total - before[:, None], (here - last) / (1.0 - last))
        before, probability, last = inside, probability @ step, here
    return float(np.clip(1.0 - probability.sum(), 0.0, 1.0))


def holm(p_values: Mapping[K, float]) -> dict[K, float]:
    """Return p-values corrected by Holm's method, which needs no independence."""
    ordered = sorted(p_values, key=lambda name: p_values[name])
    corrected: dict[K, float] = {}
    largest = 0.0
    for position, name in enumerate(ordered):
        largest = max(largest, min(1.0, (len(ordered) - position) * p_values[name]))
        corrected[name] = largest
    return corrected


def coverage(ranks: Floats, level: float) -> tuple[float, float]:
    """Return the share of truths within central intervals of a level, and its standard error.

    Parameters
    ----------
    ranks : (N, n) array; ranks of n unknowns in N replicates; those of one replicate may depend on one another
    level : float; level of the intervals
    """
    shares = (np.abs(2.0 * ranks - 1.0) < level).mean(axis=1)
    return float(shares.mean()), float(shares.std(ddof=1) / np.sqrt(len(shares)))


@dataclass(frozen=True)
class Replicates:
    """Replicates of one case that were made."""

    case: Case
    results: Sequence[Mapping[str, Any]]  # results of `studies.calibration.replicate.make`
    failures: Sequence[str]  # messages of the replicates that raised an error

    def ranks(self, method: Method = Method.IMPORTANCE) -> dict[str, Floats]:
        """Ranks of every unknown and of the log likelihood, each (N,), of the N replicates that have the method."""
        made = [result["ranks"][method] for result in self.results if method in result["ranks"]]
        return {name: np.array([ranks[name] for ranks in made]) for name in made[0]} if made else {}

    def bodies(self, method: Method = Method.IMPORTANCE) -> Floats:
        """Ranks of the reported quantities of all identified bodies, shape (N, n)."""
        columns = [
            values
            for name, values in self.ranks(method).items()
            if ".mass" in name or ".com." in name or ".inertia." in name
        ]
        return np.stack(columns, axis=1) if columns else np.zeros((0, 0))

    @cached_property
    def p_values(self) -> dict[str, float]:
        """P-value of the ranks by importance sampling of every unknown, and of the log likelihood."""
        return {name: uniform_p_value(values) for name, values in self.ranks().items()}

    def chi2(self, sensor: str) -> Floats:
        """Chi-square per sample of one sensor at the truth, shape (N,)."""
        return np.array([result["chi2"][sensor][0] / result["chi2"][sensor][1] for result in self.results])

    @property
    def rate_shift(self) -> float:
        """Root mean square difference of the base's own initial rate, in stated standard deviations; 0 from rest."""
        shifts = [shift for result in self.results for shift in result["rate_shift"]]
        return float(np.sqrt(np.mean(np.square(shifts)))) if shifts else 0.0

    def count(self, key: str, value: Any) -> int:
        """Return the number of replicates whose result has a value."""
        return sum(result[key] == value for result in self.results)


def read(store: Path) -> list[Replicates]:
    """Read a store; a case without any replicate is left out."""
    lines = {line["trial"]: line for line in read_store(store)}  # a trial that was repeated counts once
    found = []
    for case in Case:
        mine = [line for line in lines.values() if line["task"]["case"] == case]
        results = [line["result"] for line in mine if "result" in line]
        if mine:
            found.append(Replicates(case, results, [line["error"] for line in mine if "error" in line]))
    return found


ALL = "all cases"  # name of all cases together
LEVELS = (0.5, 0.9, 0.95)  # levels of the intervals whose coverage is counted


@dataclass(frozen=True)
class Coverage:
    """Share of truths within intervals of a level, with its standard error over replicates."""

    level: float
    share: float
    error: float

    @property
    def p_value(self) -> float:
        """Probability that the share lies as far from the level, on either side, where intervals are right."""
        distance = abs(self.share - self.level)
        if self.error == 0.0:
            return float(distance == 0.0)
        return float(2.0 * stats.norm.sf(distance / self.error))

    def __str__(self) -> str:
        return f"{100.0 * self.share:.1f} ± {100.0 * self.error:.1f} %"


def interval_coverage(cases: Sequence[Replicates]) -> dict[tuple[str, float], Coverage]:
    """Return the coverage by importance sampling, by the name of a case or `ALL` and by level."""
    ranks = {str(item.case): item.bodies() for item in cases if len(item.results) > 1}
    found = {
        (name, level): Coverage(level, *coverage(values, level)) for name, values in ranks.items() for level in LEVELS
    }
    if ranks:
        together = list(ranks.values())
        found |= {(ALL, level): Coverage(level, *pooled_coverage(together, level)) for level in LEVELS}
    return found


def pooled_coverage(ranks: Sequence[Floats], level: float) -> tuple[float, float]:
    """Return the coverage of replicates of several cases, each replicate with the same weight, and its error."""
    shares = np.concatenate([(np.abs(2.0 * item - 1.0) < level).mean(axis=1) for item in ranks])
    return float(shares.mean()), float(shares.std() / np.sqrt(len(shares)))
