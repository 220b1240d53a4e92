"""Coverage of the intervals of the bodies' true values, in every case and in all cases together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from studies.calibration.outcomes import Replicates
from studies.calibration.uniformity import coverage

__all__ = ["ALL", "LEVELS", "Coverage", "interval_coverage", "pooled_coverage"]

ALL = "all cases"
"""Name of all cases together."""

LEVELS = (0.5, 0.9, 0.95)
"""Levels of the intervals whose coverage is counted."""


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
