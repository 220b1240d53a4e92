"""Outcomes of the replicates, by case and by method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from studies.calibration.cases import Case
from studies.calibration.replicate import Method
from studies.calibration.uniformity import uniform_p_value
from studies.common.monte_carlo import read_store

__all__ = ["Replicates", "read"]


@dataclass(frozen=True)
class Replicates:
    """Replicates of one case that were made.

    Attributes
    ----------
    case : Case
    results : sequence of dict
        Results of `studies.calibration.replicate.make`.
    failures : sequence of str
        Messages of the replicates that raised an error.
    """

    case: Case
    results: Sequence[Mapping[str, Any]]
    failures: Sequence[str]

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
