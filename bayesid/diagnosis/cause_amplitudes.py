"""Amplitudes of the causes of a hypothesis, all of them fitted together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid.diagnosis.candidate_table import effect_amplitude
from bayesid.diagnosis.cause_search import Hypothesis
from bayesid.simulation.effects.effect import Quantity

__all__ = ["CauseAmplitude", "amplitudes_of"]


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
        if effect.label == label:
            mean, sd = effect_amplitude(hypothesis, index)
            return list(map(CauseAmplitude, effect.quantities, mean.tolist(), sd.tolist()))
    fault = next(fault for fault in hypothesis.faults if fault.label == label)
    if label == "initial-rate":
        return _initial_rates(hypothesis)
    return list(map(CauseAmplitude, fault.quantities, fault.mean.tolist(), fault.sd.tolist()))


def _initial_rates(hypothesis: Hypothesis) -> list[CauseAmplitude]:
    fit = hypothesis.fit
    posterior, sigma = fit.posterior, fit.posterior.unknowns.rate_sigma
    free = hypothesis.engine.free.tolist()
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
