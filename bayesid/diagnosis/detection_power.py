"""Probability that an effect would have raised the alarm, averaged over its prior."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats
from scipy.stats import qmc

from bayesid._math.arrays import Floats
from bayesid.diagnosis.omnibus_tests import MODAL, PAIRS
from bayesid.diagnosis.perturbation import physical
from bayesid.diagnosis.score_tests import DRAWS, Score
from bayesid.diagnosis.test_suite import FALSE_ALARM
from bayesid.simulation.effects.effect import Effect

if TYPE_CHECKING:
    from bayesid.diagnosis.cause_search import CauseSearch

__all__ = ["average_power", "detection_power", "vibration_power"]

POINTS = 8
"""Base-two logarithm of the number of quasi-random effects that the prior is averaged over: good to some 0.01."""

SURE = 12.0
"""Signal beyond the alarm's threshold, in standard deviations, from which detection is certain."""


def detection_power(degrees: int, noncentrality: float, search: CauseSearch) -> float:
    """Return the probability of an alarm by an effect with this noncentrality and so many degrees of freedom."""
    return float(_powers(degrees, np.array([noncentrality]), search)[0])


def average_power(effect: Effect, item: Score, search: CauseSearch) -> float:
    """Return the probability of an alarm by an effect drawn from its prior; of its full size if it has no parameters.

    Of an effect whose values belong to one recording each, all are drawn.
    """
    if not effect.parameters:
        return detection_power(item.degrees, float((item.response**2).sum()), search)
    count = len(effect.parameters)
    times = item.response.shape[1] // len(effect.in_amplitudes().parameters)
    draws = _draws(times * count, search.seed).reshape(-1, count)
    linear = effect.in_amplitudes()
    amplitudes = np.asarray(jax.vmap(effect.amplitudes)(physical(effect, jnp.asarray(draws))))
    centre, sigma = np.array([(p.mean, p.sigma) for p in linear.parameters]).T if linear is not effect else (0.0, 1.0)
    scaled = (amplitudes - centre) / sigma if linear is not effect else draws
    response = scaled.reshape(-1, times * len(linear.parameters)) @ item.response.T
    return float(_powers(item.degrees, (response**2).sum(axis=1), search).mean())


def vibration_power(effect: Effect, search: CauseSearch) -> float:
    """Return the probability of an alarm by a vibration drawn from its prior, in the test nearest in frequency."""
    scores = search.base.outcome.scores
    items = {f: scores[f"vibration at {f:g} Hz"] for f in search.suite.vibrations}
    tested = np.array(list(items))
    modes = jax.vmap(effect.modes)(physical(effect, jnp.asarray(_draws(len(effect.parameters), search.seed))))
    momentum = np.concatenate([np.asarray(modes.linear), np.asarray(modes.angular)], axis=-1) / MODAL
    coupling = np.einsum("nmi,nmj->nij", momentum, momentum)[:, *np.transpose(PAIRS)]
    frequency = np.asarray(modes.omega)[:, 0] / (2.0 * np.pi)
    nearest = tested[np.abs(np.log(frequency[:, None] / tested)).argmin(axis=1)]
    total = 0.0
    for tone, item in items.items():
        response = coupling[nearest == tone] @ item.response.T
        total += float(_powers(item.degrees, (response**2).sum(axis=1), search).sum())
    return total / len(frequency)


def _draws(size: int, seed: int) -> Floats:
    """Return quasi-random standard-normal points, shape (n, size)."""
    return np.asarray(qmc.MultivariateNormalQMC(np.zeros(size), rng=np.random.default_rng(seed)).random(2**POINTS))


def _powers(degrees: int, noncentrality: Floats, search: CauseSearch) -> Floats:
    """Return the probabilities of an alarm of effects with some noncentralities, shape (n,)."""
    if degrees == 0:
        return np.full(len(noncentrality), FALSE_ALARM)
    threshold = stats.chi2.isf(np.exp(search.suite.calibration.smallest[DRAWS // 100]), degrees)
    power = np.ones(len(noncentrality))
    near = np.sqrt(noncentrality) < np.sqrt(threshold) + SURE
    power[near] = stats.ncx2.sf(threshold, degrees, np.maximum(noncentrality[near], 1e-9))
    return power
