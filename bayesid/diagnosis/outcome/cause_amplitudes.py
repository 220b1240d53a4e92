"""Amplitudes of the causes of a hypothesis, all of them fitted together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.response.effect_functions import report_of, report_slopes
from bayesid.diagnosis.search.hypothesis import Hypothesis
from bayesid.simulation.effects.effect import Quantity

__all__ = ["CauseAmplitude", "amplitudes_of", "amplitudes_of_others", "effect_amplitude"]


class CauseAmplitude(NamedTuple):
    """One quantity of a cause, with its mean and standard deviation in the quantity's unit."""

    quantity: Quantity
    mean: float
    sd: float

    @property
    def distance(self) -> float:
        """Distance from zero in standard deviations, infinite for an exact value."""
        return abs(self.mean) / self.sd if self.sd > 0.0 else float("inf")


def amplitudes_of(hypothesis: Hypothesis, label: str) -> list[CauseAmplitude]:
    """Return the amplitudes of one cause of a hypothesis; of initial rates, one per axis and recording."""
    for index, effect in enumerate(hypothesis.fit.effects):
        if label == effect.candidate:
            mean, sd = effect_amplitude(hypothesis, index)
            return list(map(CauseAmplitude, effect.quantities, mean.tolist(), sd.tolist()))
    if label == INITIAL_RATE:
        return _initial_rates(hypothesis)
    fault = next(fault for fault in hypothesis.faults if fault.label == label)
    return list(map(CauseAmplitude, fault.quantities, fault.mean.tolist(), fault.sd.tolist()))


def _initial_rates(hypothesis: Hypothesis) -> list[CauseAmplitude]:
    fit = hypothesis.fit
    posterior, sigma = fit.posterior, fit.posterior.unknowns.rate_sigma
    free = hypothesis.perturbed.free.tolist()
    spread = np.sqrt(np.diag(fit.covariance))
    rates = posterior.unknowns.layout.all_rates
    amplitudes = []
    for index, place in enumerate(range(rates.start, rates.stop)):
        if place in free:
            recording, axis = divmod(index, 3)
            key = f"{posterior.manoeuvres[recording].recording.name}.{'xyz'[axis]}"
            mean, sd = sigma * fit.z[place], sigma * spread[free.index(place)]
            amplitudes.append(CauseAmplitude(Quantity(key, "rad/s"), float(mean), float(sd)))
    return amplitudes


def amplitudes_of_others(hypothesis: Hypothesis, label: str) -> list[CauseAmplitude]:
    """Return the amplitudes in all recordings but the first, as ``RECORDING.key``, of a cause that has some in each."""
    names = [item.recording.name for item in hypothesis.fit.posterior.manoeuvres]
    index = next((i for i, effect in enumerate(hypothesis.fit.effects) if label == effect.candidate), None)
    if index is None or not hypothesis.fit.effects[index].per_recording:
        return []
    found = []
    for recording, name in enumerate(names[1:], start=1):
        mean, sd = effect_amplitude(hypothesis, index, recording)
        for (key, unit), own_mean, own_sd in zip(hypothesis.fit.effects[index].quantities, mean, sd, strict=True):
            found.append(CauseAmplitude(Quantity(f"{name}.{key}", unit), float(own_mean), float(own_sd)))
    return found


def effect_amplitude(hypothesis: Hypothesis, index: int, recording: int = 0) -> tuple[Floats, Floats]:
    """Return mean and standard deviation of what is reported of one effect of a fit, in one recording."""
    fit = hypothesis.fit
    effect = fit.effects[index]
    if not effect.parameters:
        return np.zeros(0), np.zeros(0)
    count = len(effect.parameters)
    before = recording * count if effect.per_recording else 0
    first = fit.own.shape[1] + sum(columns.shape[1] for columns in fit.added[:index]) + before
    coordinates = np.ravel(fit.coordinates[index])[before : before + count]
    covariance = fit.covariance[first : first + count, first : first + count]
    slope = report_slopes(effect, coordinates)
    sd = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slope, covariance, slope), 0.0))
    return report_of(effect, coordinates), sd
