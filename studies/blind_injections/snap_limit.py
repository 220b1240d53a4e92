"""How well the torque of a snap can be reconstructed at all: by a reader who knows its form, from rates alone."""

from __future__ import annotations

from functools import cache

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._math.arrays import Floats

__all__ = ["snap_limit"]

TIME = np.arange(0.0, 150.5, 0.5)
"""Time stamps of each recording [s]."""

DECAY, RECORDINGS = 4.0, 3
"""Time in which the torque falls to 1/e [s], and number of recordings."""

ONSETS = (50.0, 80.0)
"""Instants between which the torque sets in [s]."""

SCALES = 10.0 ** np.linspace(-2.0, 1.0, 10)
"""Standard deviations of the torque in the reader's prior, relative to the true one; all are equally probable."""


@threadpool_limits.wrap(limits=1)  # threads only get in each other's way where another process keeps a core busy
def snap_limit(signal_to_noise: float, rng: np.random.Generator) -> float:
    """Draw the correlation of the posterior mean of a torque that dies away with the true one.

    Each recording holds one such torque along the same axis, at one instant, on a body that is free to turn. The reader
    measures the rates with white noise and knows all that but the instant, the decay, the axis and the size; the
    initial rate is free.

    Parameters
    ----------
    signal_to_noise : float
        Root of the noncentrality of all recordings together, beside the initial rates.
    rng : numpy.random.Generator
    """
    rates, torques = _responses()
    information = (rates**2).sum(axis=1)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    begin = rng.uniform(*ONSETS)
    seen = _centred(-np.expm1(-np.maximum(TIME - begin, 0.0) / DECAY))
    size = signal_to_noise / np.sqrt(RECORDINGS) / np.linalg.norm(seen)
    true = np.outer(size / DECAY * axis, begin <= TIME) * np.exp(-(TIME - begin) / DECAY)
    variance = ((size / DECAY) * SCALES[:, None]) ** 2
    found = []
    for _ in range(RECORDINGS):
        measured = np.outer(size * axis, seen) + _centred(rng.normal(size=(3, len(TIME))))
        score = measured @ rates.T
        visible = variance * information
        log_evidence = 0.5 * variance * (score**2).sum(axis=0) / (1.0 + visible) - 1.5 * np.log1p(visible)
        weight = np.exp(log_evidence - log_evidence.max())
        shrunk = (weight / weight.sum() * variance / (1.0 + visible)).sum(axis=0)
        found.append((score * shrunk) @ torques)
    return float(np.corrcoef(np.ravel(found), np.ravel([true] * RECORDINGS))[0, 1])


@cache
def _responses() -> tuple[Floats, Floats]:
    """Return rates and torques, (k, T), of all instants and decays between which the reader does not decide."""
    each = [(start, DECAY * 2.0**octaves) for start in TIME[:-1] for octaves in np.arange(-4.0, 4.5, 0.5)]
    start, decay = np.array(each).T[:, :, None]
    after = np.maximum(TIME - start, 0.0)
    return _centred(-decay * np.expm1(-after / decay)), np.where(start <= TIME, np.exp(-after / decay), 0.0)


def _centred(series: Floats) -> Floats:
    """Return series without what a free initial rate takes of them."""
    return series - series.mean(axis=-1, keepdims=True)
