"""Whether samples that are far off lie where chance puts them, or where something has happened."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis.settings import DEFAULT_SETTINGS

__all__ = ["is_event"]

NEIGHBOURS = 3
"""Samples of one recording that are so few apart are near each other."""

TOGETHER = 1
"""Samples of two recordings whose times since the start are so few samples apart coincide."""


def is_event(
    outlying: Sequence[Floats], measured: Sequence[Floats], level: float = DEFAULT_SETTINGS.event_level
) -> bool:
    """Return whether outliers crowd together, or recur at the same time of every recording, more than chance allows.

    Garbled readings fall anywhere. Something that lasts, such as a mass that moves, spoils samples next to each other,
    and something that belongs to the manoeuvre spoils the same samples of its repetitions. The number of such pairs
    among independent outliers is nearly Poisson.

    Parameters
    ----------
    outlying : sequence of (k,) arrays
        Times of the outliers of each recording, increasing [s].
    measured : sequence of (n,) arrays
        Times of all its samples, the outliers among them [s].
    level : float
        Probability of as many pairs by chance, below which outliers are an event.
    """
    pairs, chance = 0, 0.0
    interval = max((float(np.median(np.diff(times))) for times in measured if len(times) > 1), default=0.0)
    for own, times in zip(outlying, measured, strict=True):
        places = np.searchsorted(times, own)
        pairs += int((np.abs(np.subtract.outer(places, places)) <= NEIGHBOURS).sum() - len(own)) // 2
        chance += NEIGHBOURS * len(own) * (len(own) - 1) / max(len(times), 1)
    for (first, its), (second, others) in combinations(zip(outlying, measured, strict=True), 2):
        apart = np.abs(first[:, None] - second[None, :])
        pairs += int((apart < (TOGETHER + 0.5) * interval).sum())
        chance += (2 * TOGETHER + 1) * len(first) * len(second) / max(len(its), len(others), 1)
    return bool(stats.poisson.sf(pairs - 1, chance) < level)
