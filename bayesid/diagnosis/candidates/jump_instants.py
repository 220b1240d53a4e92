"""When the mass of a named jump moved: mean and standard deviation of its instant in each recording."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.mass_shift_signatures import jump_signatures, sample_intervals
from bayesid.diagnosis.response.effect_functions import CauseAmplitude
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.residual_view import rows_of
from bayesid.simulation.effects.effect import Quantity
from bayesid.simulation.effects.mass_shift import MassShift

__all__ = ["jump_instants"]

POINTS = 8
"""Instants weighed on either side of the fitted one."""

FINER = 0.25
"""First interval of those instants, relative to that of the samples."""

EDGE = 1e-4
"""Largest weight of the outermost instants, relative to all; where they have more, the intervals are widened."""

WIDENED = 4.0
"""By this factor."""


def jump_instants(hypothesis: Hypothesis) -> list[CauseAmplitude]:
    """Return the instant [s] of a jump in each recording in which it is, as ``RECORDING.time``; of other causes, none.

    The prior of an instant is uniform. Beside it the moments and all unknowns are fitted anew, to first order about the
    fit; the other recordings keep their instants.

    Parameters
    ----------
    hypothesis : Hypothesis
    """
    fit = hypothesis.fit
    index = next((index for index, effect in enumerate(fit.effects) if isinstance(effect, MassShift)), None)
    if index is None:
        return []
    jump = fit.effects[index]
    assert isinstance(jump, MassShift)
    count = len(fit.posterior.manoeuvres)
    fitted = np.broadcast_to(jump.instants, count)
    times = np.asarray(fit.operating.sample.environment.time)
    reach = FINER * POINTS * np.array([np.median(steps) for steps in sample_intervals(fit)])
    found: dict[int, tuple[float, float]] = {}
    open_ones = [r for r in range(count) if 0.0 <= fitted[r] <= times[r].max()]
    while open_ones:
        tried = fitted[:, None] + reach[:, None] * np.arange(-POINTS, POINTS + 1) / POINTS
        weights = _weights(hypothesis, fit.values(index), np.where(np.isfinite(tried), tried, np.inf), open_ones)
        for r, weight in zip(list(open_ones), weights, strict=True):
            inside = (tried[r] >= 0.0) & (tried[r] <= times[r].max())
            weight = np.where(inside, weight, 0.0) / weight[inside].sum()
            if max(weight[0], weight[-1]) > EDGE and reach[r] < times[r].max():
                reach[r] *= WIDENED
                continue
            mean = float(weight @ tried[r])
            interval = reach[r] / POINTS
            found[r] = mean, float(np.sqrt(weight @ (tried[r] - mean) ** 2 + interval**2 / 12.0))
            open_ones.remove(r)
    names = [item.recording.name for item in fit.posterior.manoeuvres]
    return [CauseAmplitude(Quantity(f"{names[r]}.time", "s"), *found[r]) for r in sorted(found)]


def _weights(hypothesis: Hypothesis, moments: Floats, tried: Floats, recordings: Sequence[int]) -> list[Floats]:
    """Return the likelihood of each instant of some recordings relative to the best, shapes (K,)."""
    fit = hypothesis.fit
    responses = jump_signatures(hypothesis.perturbed, fit, tried) @ moments  # (R, K, rows)
    weights = []
    for r in recordings:
        change = np.zeros((len(fit.residual), tried.shape[1]))
        change[rows_of(fit.posterior, r)] = (responses[r] - responses[r, POINTS]).T
        cost = fit.residual @ change + 0.5 * np.diag(fit.project(change))
        weights.append(np.exp(cost.min() - cost))
    return weights
