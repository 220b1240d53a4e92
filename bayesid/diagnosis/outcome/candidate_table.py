"""What the data say of each candidate by itself: probability, p-values, Bayes factor, amplitude, limit, power."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.catalogue_signatures import group_names
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.outcome.cause_power import cause_power
from bayesid.diagnosis.search.cause_weighing import WeighedCauses
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity

__all__ = ["Candidate", "candidate_table"]

POWER_DRAWS = 400
"""Simulated studies for the power of a candidate, good to 0.025."""


@dataclass(frozen=True)
class Candidate:
    """One candidate cause alone, on top of the present model.

    Attributes
    ----------
    name : str
    probability : float
        That it is at work, whatever accompanies it.
    signal_to_noise : float
        Root of the improvement of chi-square by its best form, less its degrees of freedom.
    p_value, p_value_adjusted : float
        Local and family-wise.
    log_bayes_factor : float or None
        Against the present model; None where not evaluated.
    quantities : tuple of Quantity
        Amplitudes that vanish with it.
    mean, sd, upper_limit : arrays
        Of the amplitudes, given that it alone is at work; the limit holds their magnitudes with 95 %.
    power : float or None
        Probability that it would have raised the alarm, its size drawn from its prior; None for faults of the noise.
    generic : bool
        Whether it names no cause.
    """

    name: str
    probability: float
    signal_to_noise: float
    p_value: float
    p_value_adjusted: float
    log_bayes_factor: float | None
    quantities: tuple[Quantity, ...]
    mean: Floats
    sd: Floats
    upper_limit: Floats
    power: float | None
    generic: bool = False


def candidate_table(weighed: WeighedCauses, effects: Sequence[Effect], rng: np.random.Generator) -> list[Candidate]:
    """Return every candidate, the most probable first, then by Bayes factor.

    Parameters
    ----------
    weighed : WeighedCauses
    effects : sequence of Effect
        Candidates of the catalogue.
    rng : Generator
        For the power.
    """
    evidence, alarm = weighed.base.evidence, weighed.alarm
    inclusion, p_values = weighed.probabilities.inclusion, alarm.log_p_values()
    quantities = _quantities(effects)
    rows = []
    for name, cause in evidence.causes.items():
        forms = evidence.forms([name])
        groups = cause.variants[forms[name]].groups
        sized = name in quantities and not cause.fixed
        amplitude = _Amplitude.of(name, evidence, quantities) if sized else NO_AMPLITUDE
        local, adjusted = p_values[name]
        rows.append(
            Candidate(
                name,
                inclusion[name],
                evidence.gram.signal_to_noise(*(group.name for group in groups)),
                float(np.exp(local)),
                float(np.exp(adjusted)),
                alarm.candidates.log_evidence[name],
                amplitude.quantities,
                amplitude.mean,
                amplitude.sd,
                amplitude.limit,
                cause_power(name, evidence, alarm.candidates, rng, alarm.candidates_level, POWER_DRAWS),
                cause.generic,
            )
        )
    rows += [_noise(name, weighed) for name in alarm.noise if name in inclusion]
    return sorted(rows, key=lambda row: (-round(row.probability, 6), -_factor(row), row.name))


def _factor(row: Candidate) -> float:
    return -np.inf if row.log_bayes_factor is None else row.log_bayes_factor


@dataclass(frozen=True)
class _Amplitude:
    """Amplitudes of one candidate."""

    quantities: tuple[Quantity, ...]
    mean: Floats
    sd: Floats
    limit: Floats

    @staticmethod
    def of(name: str, evidence: SetEvidence, quantities: Mapping[str, tuple[Quantity, ...]]) -> _Amplitude:
        posterior = AmplitudePosterior.of(evidence, [name])
        forms = evidence.forms([name])
        groups = evidence.causes[name].variants[forms[name]].groups
        places = np.concatenate([posterior.amplitudes[name, group.name] for group in groups])
        own = places[: len(quantities[name])]  # of a cause per recording, those of the first
        return _Amplitude(
            quantities[name],
            posterior.mean[own],
            np.sqrt(np.diag(posterior.covariance)[own]),
            posterior.upper_limits()[own],
        )


NO_AMPLITUDE = _Amplitude((), np.zeros(0), np.zeros(0), np.zeros(0))


def _quantities(effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
    """Return the amplitudes of each candidate in the order of its columns."""
    found: dict[str, tuple[Quantity, ...]] = {INITIAL_RATE: tuple(Quantity(axis, "rad/s") for axis in "xyz")}
    for effect in effects:
        if not effect.modes_count:
            units = list(dict.fromkeys(group_names(effect)))
            found[effect.label] = tuple(sorted(effect.amplitude_quantities, key=lambda item: units.index(item.unit)))
    return found


def _noise(name: str, weighed: WeighedCauses) -> Candidate:
    """Return a fault of the noise, with its size where it was weighed."""
    local, adjusted = weighed.alarm.log_p_values()[name]
    state = next((state for state in weighed.states if name in state.names), None)
    fault = None if state is None else next(fault for fault in state.faults if fault.label == name)
    mean, sd = (np.zeros(0), np.zeros(0)) if fault is None else (fault.mean, fault.sd)
    return Candidate(
        name,
        weighed.probabilities.inclusion[name],
        float(max(stats.norm.isf(np.exp(max(local, -700.0))), 0.0)),
        float(np.exp(local)),
        float(np.exp(adjusted)),
        None if state is None else state.log_nothing - weighed.states[0].log_nothing,
        () if fault is None else fault.quantities,
        mean,
        sd,
        np.abs(mean) + 1.645 * sd,
        None,
    )
