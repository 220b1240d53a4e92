"""Whether base motion measures the excitation: criterion (26) against the posterior over random manoeuvres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from bayesid._math.arrays import Floats
from bayesid.design import Problem

__all__ = ["Cloud", "random_cloud"]


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
