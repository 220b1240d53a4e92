"""Whether ranks are uniform: simultaneous test of their distribution function, Holm's correction, and coverage."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import TypeVar

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats

__all__ = ["POINTS", "coverage", "holm", "uniform_p_value"]

K = TypeVar("K", bound=Hashable)

POINTS = np.arange(1, 20) / 20.0
"""Points at which the distribution function of the ranks is compared with that of the uniform one."""


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
    ranks : (N, n) array
        Ranks of n unknowns in N replicates; those of one replicate may depend on one another.
    level : float
        Level of the intervals.
    """
    shares = (np.abs(2.0 * ranks - 1.0) < level).mean(axis=1)
    return float(shares.mean()), float(shares.std(ddof=1) / np.sqrt(len(shares)))
