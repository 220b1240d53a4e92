"""Posterior contraction: how much narrower the posterior of a quantity is than its prior."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from bayesid._math.arrays import Floats

__all__ = ["CONTRACTED", "PRIOR_ONLY", "Contraction", "ContractionVerdict", "compare", "half_range"]

CONTRACTED, PRIOR_ONLY = 0.5, 0.1
"""Shrinkage from which on a quantity counts as learnt, and below which its posterior is little more than the prior."""


class ContractionVerdict(Enum):
    """Verdict on the posterior contraction of one quantity."""

    CONTRACTED = "learnt"
    WEAKLY = "weakly"
    NOT = "not learnt"

    @classmethod
    def of(cls, shrinkage: float) -> ContractionVerdict:
        """Return the verdict on a shrinkage, by the thresholds `CONTRACTED` and `PRIOR_ONLY`."""
        if shrinkage >= CONTRACTED:
            return cls.CONTRACTED
        return cls.WEAKLY if shrinkage >= PRIOR_ONLY else cls.NOT


class Contraction(NamedTuple):
    """Posterior contraction of one quantity.

    Attributes
    ----------
    prior_sd : float
        Standard deviation of the prior, from its central 68 %, in the unit of the quantity.
    shrinkage : float
        One minus the ratio of posterior to prior width.
    """

    prior_sd: float
    shrinkage: float

    @property
    def verdict(self) -> ContractionVerdict:
        """Verdict on the shrinkage."""
        return ContractionVerdict.of(self.shrinkage)

    def to_dict(self) -> dict[str, Any]:
        """Return the contraction in the form that it has in JSON."""
        return {"prior_sd": self.prior_sd, "shrinkage": self.shrinkage, "verdict": self.verdict.value}


def compare(names: Sequence[str], prior: Floats, posterior: Floats) -> dict[str, Contraction]:
    """Compare draws of n quantities from prior and posterior, shapes (draws, n).

    A width is half the range of the central 68 %, which for a normal distribution is the standard deviation and is
    finite for every distribution.
    """
    before, after = half_range(prior), half_range(posterior)
    return {
        name: Contraction(float(wide), float(1.0 - narrow / wide))
        for name, wide, narrow in zip(names, before, after, strict=True)
    }


def half_range(draws: Floats) -> Floats:
    """Return half the range of the central 68 % of the draws (m, n), shape (n,)."""
    low, high = np.quantile(draws, [0.16, 0.84], axis=0)
    return np.asarray(0.5 * (high - low))
