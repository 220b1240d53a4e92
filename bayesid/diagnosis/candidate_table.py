"""What the data say of each candidate by itself: signal-to-noise, p-values, Bayes factor, amplitude, limit, power."""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats
from scipy.optimize import brentq

from bayesid._math.arrays import Floats
from bayesid.diagnosis.amplitude_scale import effect_mixture
from bayesid.diagnosis.cause_search import CauseSearch, Hypothesis, significance
from bayesid.diagnosis.detection_power import average_power, vibration_power
from bayesid.diagnosis.fit_starts import start_coordinates
from bayesid.diagnosis.perturbation import physical
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity

__all__ = ["Candidate", "candidate_table", "effect_amplitude", "magnitude_limit"]

LIMIT = 0.95
"""Probability with which a magnitude stays below its upper limit."""


@dataclass(frozen=True)
class Candidate:
    """One candidate cause alone, on top of the present model.

    Attributes
    ----------
    name : str
    signal_to_noise : float
    p_value, p_value_adjusted : float
        Local and family-wise.
    log_bayes_factor : float or None
        Against the present model; None where not evaluated.
    quantities : tuple of Quantity
    mean, sd : arrays
        Amplitude.
    power : float or None
        Probability that an effect drawn from its prior would have raised the alarm.
    refitted : bool
        Whether the figures come from a fit rather than from the linear response.
    """

    name: str
    signal_to_noise: float
    p_value: float
    p_value_adjusted: float
    log_bayes_factor: float | None
    quantities: tuple[Quantity, ...]
    mean: Floats
    sd: Floats
    power: float | None
    refitted: bool

    @property
    def upper_limit(self) -> Floats:
        """Size that the quantities' magnitudes stay below with 95 %, their posterior being normal."""
        return np.array([magnitude_limit(mean, sd) for mean, sd in zip(self.mean, self.sd, strict=True)])


def magnitude_limit(mean: float, sd: float, probability: float = LIMIT) -> float:
    """Return the quantile of the magnitude of a normal variable (folded normal distribution)."""
    if not sd > 0.0:
        return abs(mean)
    centre = abs(mean) / sd

    def missing(over: float) -> float:
        return float(stats.norm.cdf(over) - stats.norm.cdf(-over - 2.0 * centre)) - probability

    # far from zero one tail counts, at zero both
    over = brentq(missing, stats.norm.ppf(probability) - 1e-6, stats.norm.ppf(0.5 + 0.5 * probability) + 1e-6)
    return sd * (centre + float(over))


def candidate_table(search: CauseSearch) -> list[Candidate]:
    """Every candidate, the most probable first."""
    alone = {h.labels[0]: h for h in search.tried if len(h.labels) == 1}
    rows = []
    for label, effect in search.candidates.items():
        if label in alone:
            rows.append(_fitted(alone[label], search, effect))
        elif label in search.suite.effects:
            rows.append(_linear(effect, search))
        elif effect.modes_count:
            rows.append(_vibrating(effect, search))
    for label, log_p in search.base.outcome.log_p.items():
        if label in search.base.outcome.scores or label == "variance by axis":
            continue
        rows.append(_noise(label, log_p, alone.get(label), search))
    if "initial-rate" in alone:
        hypothesis = alone["initial-rate"]
        rows.append(_noise("initial-rate", significance(hypothesis, search.base)[1], hypothesis, search))
    return sorted(rows, key=lambda row: (row.log_bayes_factor is None, -(row.log_bayes_factor or 0.0)))


def effect_amplitude(hypothesis: Hypothesis, index: int) -> tuple[Floats, Floats]:
    """Mean and standard deviation of what is reported of one effect of a fit; per recording where it has its own."""
    fit = hypothesis.fit
    effect = fit.effects[index]
    first = fit.own.shape[1] + sum(columns.shape[1] for columns in fit.added[:index])
    count = fit.added[index].shape[1]
    return _reported(effect, fit.coordinates[index], fit.covariance[first : first + count, first : first + count])


def _reported(effect: Effect, coordinates: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    if not effect.parameters:
        return np.zeros(0), np.zeros(0)
    if effect.per_recording:  # the first recording's stand for all in tables
        count = len(effect.parameters)
        coordinates, covariance = coordinates[:count], covariance[:count, :count]

    def report(c: jax.Array) -> jax.Array:
        return effect.report(physical(effect, c))

    point = jnp.asarray(coordinates)
    slope = np.asarray(jax.jacfwd(report)(point))
    return np.asarray(report(point)), np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, covariance, slope), 0.0))


def _fitted(hypothesis: Hypothesis, search: CauseSearch, effect: Effect) -> Candidate:
    snr, log_p = significance(hypothesis, search.base)
    mean, sd = effect_amplitude(hypothesis, 0)
    item = search.base.outcome.scores.get(effect.label)
    return Candidate(
        effect.label,
        snr,
        float(np.exp(log_p)),
        search.suite.calibration.adjusted(log_p),
        hypothesis.log_evidence - search.base.log_evidence,
        tuple(effect.quantities),
        mean,
        sd,
        None if item is None else average_power(effect, item, search),
        True,
    )


def _linear(effect: Effect, search: CauseSearch) -> Candidate:
    fit = search.base.fit
    columns = search.suite.effects[effect.label]
    item = search.base.outcome.scores[effect.label]
    linear = effect.in_amplitudes()
    information = fit.project(columns)
    gradient = columns.T @ fit.residual
    if linear.parameters:
        hessian = information + np.eye(len(information))
        covariance = np.linalg.inv(hessian)
        point = start_coordinates(linear, len(fit.posterior.manoeuvres)) - covariance @ gradient
        mean, sd = _reported(linear, point, covariance)
        gain = 0.5 * float(gradient @ covariance @ gradient) - 0.5 * float(np.linalg.slogdet(hessian)[1])
        gain += effect_mixture(linear, point, covariance)
    else:
        mean = sd = np.zeros(0)
        gain = float(-gradient[0] - 0.5 * information[0, 0])  # there at full size, or not
    return Candidate(
        effect.label,
        item.signal_to_noise,
        float(np.exp(item.log_p)),
        search.suite.calibration.adjusted(item.log_p),
        gain,
        tuple(linear.quantities),
        mean,
        sd,
        average_power(effect, item, search),
        False,
    )


def _vibrating(effect: Effect, search: CauseSearch) -> Candidate:
    items = [item for name, item in search.base.outcome.scores.items() if name.startswith("vibration")]
    best = min(items, key=lambda item: item.log_p)
    log_p = min(0.0, best.log_p + float(np.log(len(items))))
    power = vibration_power(effect, search)
    nothing = np.zeros(0)
    return Candidate(
        effect.label,
        best.signal_to_noise,
        float(np.exp(log_p)),
        search.suite.calibration.adjusted(best.log_p),
        None,
        (),
        nothing,
        nothing,
        power,
        False,
    )


def _noise(label: str, log_p: float, hypothesis: Hypothesis | None, search: CauseSearch) -> Candidate:
    fault = hypothesis.faults[0] if hypothesis is not None and hypothesis.faults else None
    snr = float(max(stats.norm.isf(np.exp(max(log_p, -700.0))), 0.0))
    return Candidate(
        label,
        significance(hypothesis, search.base)[0] if hypothesis is not None and label == "initial-rate" else snr,
        float(np.exp(log_p)),
        search.suite.calibration.adjusted(log_p),
        None if hypothesis is None else hypothesis.log_evidence - search.base.log_evidence,
        () if fault is None else fault.quantities,
        np.zeros(0) if fault is None else fault.mean,
        np.zeros(0) if fault is None else fault.sd,
        None,
        hypothesis is not None,
    )
