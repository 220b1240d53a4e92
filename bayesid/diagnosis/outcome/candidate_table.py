"""What the data say of each candidate by itself, and the amplitudes of those that are fitted together.

The power of a candidate is averaged over the prior of its size (A. O'Hagan, J. W. Stevens and M. J. Campbell, Assurance
in clinical trial design, Pharmaceutical Statistics 4, 2005).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.cause_kind import CauseAmplitude, cause_kinds
from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior
from bayesid.diagnosis.evidence.evidence_alarm import EvidenceAlarm
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.response.perturbation import report_of, report_slopes
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.diagnosis.search.model_search import ModelSearch
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from bayesid.simulation.effects.effect import Effect, Quantity

__all__ = [
    "Candidate",
    "CauseAmplitude",
    "amplitudes_of",
    "amplitudes_of_others",
    "candidate_table",
    "cause_power",
    "effect_amplitude",
    "instants_of",
    "reported_normal",
]

POWER_DRAWS = 400  # simulated studies for the power of a candidate, good to 0.025


@dataclass(frozen=True)
class Candidate:
    """One candidate cause, added alone to the present model.

    Attributes
    ----------
    name : str
    probability : float
        Probability that it is at work, whatever accompanies it.
    signal_to_noise : float
        Square root of the decrease of chi-square by its best form minus its degrees of freedom.
    p_value, p_value_adjusted : float
        Local and family-wise.
    log_bayes_factor : float or None
        Against the present model; None if not evaluated.
    quantities : tuple of Quantity
        Amplitudes, which are zero if it is absent.
    mean, sd, upper_limit : arrays
        Of the amplitudes, given that it alone is at work; their magnitudes lie below the limit with 95 % probability.
    power : float or None
        Probability that it would have raised the alarm, with a size drawn from its prior; None for noise faults.
    generic : bool
        Whether it is outside the catalogue.
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


def candidate_table(search: ModelSearch, effects: Sequence[Effect], rng: np.random.Generator) -> list[Candidate]:
    """Return every candidate, the most probable first, then by Bayes factor.

    Parameters
    ----------
    search : ModelSearch
    effects : sequence of Effect
        Candidates of the catalogue.
    rng : Generator
        For the power.
    """
    evidence, alarm = search.base.evidence, search.alarm
    inclusion, p_values = search.probabilities.inclusion, alarm.log_p_values()
    quantities = _quantities(effects)
    rows = []
    for name, cause in evidence.causes.items():
        groups = [group.name for group in cause.variants[evidence.forms([name])[name]].groups]
        amplitude: _Amplitudes = ((), np.zeros(0), np.zeros(0), np.zeros(0))
        if name in quantities and not cause.fixed:
            amplitude = listed_amplitudes(name, groups, evidence, quantities[name])
        local, adjusted = np.exp(p_values[name]).tolist()
        rows.append(
            Candidate(
                name,
                inclusion[name],
                evidence.gram.signal_to_noise(*groups),
                local,
                adjusted,
                alarm.candidates.log_evidence[name],
                *amplitude,
                cause_power(name, evidence, alarm.candidates, rng, alarm.candidates_level, POWER_DRAWS),
                cause.generic,
            )
        )
    rows += [_noise(name, search) for name in alarm.noise if name in inclusion]
    return sorted(rows, key=lambda row: (-round(row.probability, 6), -_factor(row), row.name))


def _factor(row: Candidate) -> float:
    return -np.inf if row.log_bayes_factor is None else row.log_bayes_factor


_Amplitudes = tuple[tuple[Quantity, ...], Floats, Floats, Floats]
"""Quantities of one candidate, with their means, standard deviations and upper limits."""


def listed_amplitudes(
    name: str, groups: Sequence[str], evidence: SetEvidence, quantities: tuple[Quantity, ...]
) -> _Amplitudes:
    """Return the amplitudes by which a candidate is listed, those of the first recording where each has its own.

    Parameters
    ----------
    name : str
    groups : sequence of str
        Its groups of columns, one for each unit, or one for all.
    evidence : SetEvidence
    quantities : tuple of Quantity
        What is listed, by unit.
    """
    posterior = AmplitudePosterior.of(evidence, [name])
    units = [quantity.unit for quantity in quantities]
    counts = [units.count(unit) for unit in dict.fromkeys(units)] if len(groups) > 1 else [len(units)]
    # within each group, the columns of the first recording come first
    first = np.concatenate([posterior.amplitudes[name, group][:n] for group, n in zip(groups, counts, strict=False)])
    sd = np.sqrt(np.diag(posterior.covariance)[first])
    return quantities, posterior.mean[first], sd, posterior.upper_limits()[first]


def _quantities(effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
    """Return the amplitudes of each candidate in the order of its columns."""
    quantities: dict[str, tuple[Quantity, ...]] = {}
    for kind in cause_kinds():
        quantities |= kind.quantities(kind.of(effects))
    return quantities


def _noise(name: str, search: ModelSearch) -> Candidate:
    """Return a fault of the noise, with its size where it was weighed."""
    local, adjusted = search.alarm.log_p_values()[name]
    under = next((each for each in search.searches if name in each.noise.names), None)
    fault = None if under is None else next(fault for fault in under.noise.faults if fault.label == name)
    mean, sd = (np.zeros(0), np.zeros(0)) if fault is None else (fault.mean, fault.sd)
    return Candidate(
        name,
        search.probabilities.inclusion[name],
        float(max(stats.norm.isf(np.exp(max(local, -700.0))), 0.0)),
        float(np.exp(local)),
        float(np.exp(adjusted)),
        None if under is None else under.log_nothing - search.searches[0].log_nothing,
        () if fault is None else fault.quantities,
        mean,
        sd,
        np.abs(mean) + 1.645 * sd,
        None,
    )


def cause_power(
    name: str,
    evidence: SetEvidence,
    alarm: EvidenceAlarm,
    rng: np.random.Generator,
    level: float = DEFAULT_SETTINGS.alarm_level,
    draws: int = 2000,
) -> float:
    """Return the probability that the evidence of a cause exceeds the family-wise threshold when it is at work alone.

    Scales and amplitudes are drawn from the cause's prior, the rest of the score as where nothing is lacking. Small
    scales count as much as their prior says: a cause of low power cannot be excluded by silence.

    Parameters
    ----------
    name : str
    evidence : SetEvidence
    alarm : EvidenceAlarm
        Of the same candidates.
    rng : Generator
    level : float
        Family-wise level of the alarm among candidates.
    draws : int
        Number of draws; 2,000 are good to 0.011.
    """
    gram, cause = evidence.gram, evidence.causes[name]
    columns = np.unique(gram.columns(group.name for variant in cause.variants for group in variant.groups))
    scores = np.zeros((draws, len(gram.score)))
    part = Gram(gram.matrix[np.ix_(columns, columns)], gram.score[columns], {})
    scores[:, columns] = part.null_scores(rng, draws)
    shares = np.exp([variant.log_weight for variant in cause.variants])
    counts = rng.multinomial(draws, shares / shares.sum())
    for form, drawn in enumerate(np.split(np.arange(draws), np.cumsum(counts)[:-1])):
        for spectrum in evidence.spectra([name], {name: form}):
            scales = np.exp(rng.uniform(np.log(spectrum.range.low), np.log(spectrum.range.high), size=(len(drawn), 1)))
            amplitudes = scales * spectrum.root * rng.normal(size=(len(drawn), len(spectrum.columns)))
            amplitudes = np.ones_like(amplitudes) if cause.fixed else amplitudes
            scores[np.ix_(drawn, columns)] -= amplitudes @ gram.matrix[np.ix_(spectrum.columns, columns)]
    return float(np.mean(evidence.log_evidences([name], scores) > alarm.largest.threshold(level)))


def amplitudes_of(hypothesis: Hypothesis, label: str) -> list[CauseAmplitude]:
    """Return the amplitudes of one cause of a hypothesis.

    Parameters
    ----------
    hypothesis : Hypothesis
    label : str
        Name of the cause, of those of a fault of the noise, too.
    """
    for index, effect in enumerate(hypothesis.fit.effects):
        if label == effect.candidate:
            mean, sd = effect_amplitude(hypothesis, index)
            return list(map(CauseAmplitude, effect.quantities, mean.tolist(), sd.tolist()))
    for kind in cause_kinds():
        if amplitudes := kind.amplitudes(hypothesis.perturbed, hypothesis.fit, label):
            return amplitudes
    fault = next(fault for fault in hypothesis.faults if fault.label == label)
    return list(map(CauseAmplitude, fault.quantities, fault.mean.tolist(), fault.sd.tolist()))


def instants_of(hypothesis: Hypothesis, label: str) -> list[CauseAmplitude]:
    """Return when a cause of a hypothesis set in, in each recording in which it did; of most causes nothing.

    Parameters
    ----------
    hypothesis : Hypothesis
    label : str
        Name of the cause.
    """
    return [instant for kind in cause_kinds() for instant in kind.instants(hypothesis.perturbed, hypothesis.fit, label)]


def amplitudes_of_others(hypothesis: Hypothesis, label: str) -> list[CauseAmplitude]:
    """Return the amplitudes in all recordings but the first, as ``RECORDING.key``, of a cause that has some in each.

    Parameters
    ----------
    hypothesis : Hypothesis
    label : str
        Name of the cause.
    """
    names = [manoeuvre.recording.name for manoeuvre in hypothesis.fit.posterior.manoeuvres]
    index = next((i for i, effect in enumerate(hypothesis.fit.effects) if label == effect.candidate), None)
    if index is None or not hypothesis.fit.effects[index].per_recording:
        return []
    return [
        CauseAmplitude(Quantity(f"{name}.{key}", unit), float(mean), float(sd))
        for recording, name in enumerate(names[1:], start=1)
        for (key, unit), mean, sd in zip(
            hypothesis.fit.effects[index].quantities, *effect_amplitude(hypothesis, index, recording), strict=True
        )
    ]


def effect_amplitude(hypothesis: Hypothesis, index: int, recording: int = 0) -> tuple[Floats, Floats]:
    """Return mean and standard deviation, (k,), of what is reported of one effect of a fit, in one recording.

    Parameters
    ----------
    hypothesis : Hypothesis
    index : int
        Index of the effect in the fit.
    recording : int
        Index of the recording; the first one's stands for all where the effect has the same values in each.
    """
    mean, covariance = reported_normal(hypothesis, index, recording)
    return mean, np.sqrt(np.maximum(np.diag(covariance), 0.0))


def reported_normal(hypothesis: Hypothesis, index: int, recording: int = 0) -> tuple[Floats, Floats]:
    """Return mean, (k,), and covariance, (k, k), of the same (`effect_amplitude`).

    Parameters
    ----------
    hypothesis : Hypothesis
    index, recording : int
        Indices of the effect in the fit and of the recording.
    """
    fit = hypothesis.fit
    effect = fit.effects[index]
    if not effect.parameters:
        return np.zeros(0), np.zeros((0, 0))
    count = len(effect.parameters)
    before = recording * count if effect.per_recording else 0
    first = fit.own.shape[1] + sum(columns.shape[1] for columns in fit.added[:index]) + before
    coordinates = np.ravel(fit.coordinates[index])[before : before + count]
    covariance = fit.covariance[first : first + count, first : first + count]
    slope = report_slopes(effect, coordinates)
    return report_of(effect, coordinates), slope @ covariance @ slope.T
