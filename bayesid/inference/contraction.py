"""How much the data told of a quantity beyond its prior."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

from bayesid._math.arrays import Floats

__all__ = ["CONTRACTED", "PRIOR_ONLY", "Contraction", "ContractionVerdict", "compare", "half_range"]

CONTRACTED, PRIOR_ONLY = 0.5, 0.1
"""Shrinkage from which on a quantity counts as learnt, and below which what is said of it is the prior."""


class ContractionVerdict(Enum):
    """Whether the data told of a quantity."""

    CONTRACTED = "learnt"
    WEAKLY = "weakly"
    NOT = "not learnt"

    @classmethod
    def of(cls, shrinkage: float) -> ContractionVerdict:
        """Judge one minus the ratio of posterior to prior width: `CONTRACTED` and `PRIOR_ONLY` are the thresholds."""
        if shrinkage >= CONTRACTED:
            return cls.CONTRACTED
        return cls.WEAKLY if shrinkage >= PRIOR_ONLY else cls.NOT


class Contraction(NamedTuple):
    """What the data told of one quantity.

    ``prior_sd`` in the quantity's unit; ``shrinkage`` one minus the ratio of posterior to prior width.
    """

    prior_sd: float
    shrinkage: float

    @property
    def verdict(self) -> ContractionVerdict:
        """Whether the data told of it."""
        return ContractionVerdict.of(self.shrinkage)

    def to_dict(self) -> dict[str, Any]:
        """Form in JSON."""
        return {"prior_sd": self.prior_sd, "shrinkage": self.shrinkage, "verdict": self.verdict.value}


def compare(names: Sequence[str], prior: Floats, posterior: Floats) -> dict[str, Contraction]:
    """Compare draws of n quantities from prior and posterior, shapes (draws, n).

    Widths are half the central 68 %, which is the standard deviation of a normal distribution and finite for all.
    """
    before, after = half_range(prior), half_range(posterior)
    return {
        name: Contraction(float(wide), float(1.0 - narrow / wide))
        for name, wide, narrow in zip(names, before, after, strict=True)
    }


def half_range(draws: Floats) -> Floats:
    """Return half the range of the central 68 % of draws (m, n), shape (n,)."""
    low, high = np.quantile(draws, [0.16, 0.84], axis=0)
    return np.asarray(0.5 * (high - low))
