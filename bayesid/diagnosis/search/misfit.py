"""What the most probable causes leave once they are fitted in full: evidence for something else beside them.

A p-value bounds that evidence (Sellke, Bayarri & Berger 2001, Calibration of p values for testing precise null
hypotheses, The American Statistician 55).
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import replace

import numpy as np

from bayesid._io.errors import InputError
from bayesid.diagnosis.candidates.cause_kind import kind_of
from bayesid.diagnosis.evidence.cause_sets import CauseSet, SetProbabilities
from bayesid.diagnosis.noise.family_alarm import noise_tests, structure_tests
from bayesid.diagnosis.noise.noise_fault import FitResidual
from bayesid.diagnosis.search.fitted_set import Hypothesis, exactly_fitted, gain_beyond_linear
from bayesid.diagnosis.search.model_search import ModelSearch
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.simulation.effects.effect import Effect

__all__ = ["UNNAMED", "log_odds_of_anything", "log_p_of_misfit", "with_misfit"]

UNNAMED = "something in addition to the fitted causes"
"""Generic candidate that has no form: whatever the fitted causes leave."""


def with_misfit(
    search: ModelSearch, effects: Sequence[Effect], settings: DiagnosisSettings = DEFAULT_SETTINGS
) -> tuple[ModelSearch, dict[frozenset[str], Hypothesis]]:
    """Fit the most probable sets of causes in full, and weigh that they do not suffice.

    The probabilities come from linear signatures. What the full fit of a set loses against them counts in its evidence;
    what it gains does not, since its rivals are not all fitted, and vibrations have had theirs from fits. A set that
    does not follow the data once its effects are simulated gets a companion: the same causes beside something else,
    with as much more evidence as the p-value of what is left allows at most (`log_odds_of_anything`). One with which no
    motion can be simulated is no explanation: its evidence goes to something else alone.

    Parameters
    ----------
    search : ModelSearch
    effects : sequence of Effect
        Candidates of the catalogue.
    settings : DiagnosisSettings, optional

    Returns
    -------
    search : ModelSearch
        With such companions among the sets.
    fitted : dict of frozenset of str to Hypothesis
        Fits by the names of their causes.
    """
    fitted: dict[frozenset[str], Hypothesis] = {}
    if search.alarm.silent:
        return search, fitted
    probabilities = search.probabilities
    generics = (*probabilities.generics, UNNAMED)
    probabilities = SetProbabilities.of(probabilities.sets, probabilities.causes, generics, probabilities.prior)
    comparable = {effect.label for effect in effects if not kind_of(effect).weighed_by_fits}
    comparable |= {name for faults in search.searches for name in faults.noise.names}
    for _ in range(settings.most_full_fits):
        # what stands beside something generic is to be possible as well
        likeliest = (one for one in probabilities.sets if one.causes and frozenset(one.causes) not in fitted)
        best = next(likeliest, None)
        if best is None or best.probability < settings.fitted_in_full_from:
            break
        causes = best.causes
        best = next((one for one in probabilities.sets if one.causes == causes and one.generic is None), None)
        if best is None:
            break
        under = search.under(causes)
        try:
            hypothesis = under.fit(causes, effects)
        except InputError:
            probabilities = _without_motion(probabilities, best)
            continue
        if under.point.far:
            hypothesis = exactly_fitted(hypothesis)
        if set(causes) <= comparable and not under.point.far:
            loss = -min(gain_beyond_linear(under.point, hypothesis, settings.agrees), 0.0)
            probabilities = _with_loss(probabilities, best, loss, fitted)
        fitted[frozenset(causes)] = hypothesis
    companions = [
        replace(one, generic=UNNAMED, log_evidence=one.log_evidence + more)
        for one in probabilities.sets
        if one.generic is None and one.probability >= settings.fitted_in_full_from and frozenset(one.causes) in fitted
        for more in [log_odds_of_anything(log_p_of_misfit(fitted[frozenset(one.causes)]))]
    ]
    probabilities = probabilities.with_sets([*probabilities.sets, *companions])
    return replace(search, probabilities=probabilities), fitted


def _with_loss(
    probabilities: SetProbabilities, fitted: CauseSet, loss: float, known: Container[frozenset[str]]
) -> SetProbabilities:
    """Return the probabilities where one set has less evidence.

    What the linear model allows and the simulation does not, it allows beside anything else as well: sets that hold the
    fitted one lose as large a share of what its causes gain in them. Those of other causes that are known are kept.
    """
    if loss == 0.0:
        return probabilities
    evidence = {one.names: one.log_evidence for one in probabilities.sets}
    share = loss / max(fitted.log_evidence, 1.0)

    def lost(one: CauseSet) -> float:
        if one is fitted:
            return loss
        if not set(fitted.causes) <= set(one.causes) or frozenset(one.causes) in known:
            return 0.0
        others = tuple(name for name in one.names if name not in fitted.causes)
        return max(share * (one.log_evidence - evidence.get(others, 0.0)), loss)

    return probabilities.with_sets(
        replace(one, log_evidence=one.log_evidence - lost(one)) for one in probabilities.sets
    )


def _without_motion(probabilities: SetProbabilities, refuted: CauseSet) -> SetProbabilities:
    """Return the probabilities where the evidence of one set speaks for something else alone."""
    alone = [cause_set for cause_set in probabilities.sets if cause_set.names == (UNNAMED,)]
    others = [cause_set for cause_set in probabilities.sets if cause_set is not refuted and cause_set not in alone]
    most = max(cause_set.log_evidence for cause_set in (refuted, *alone))
    return probabilities.with_sets([*others, CauseSet((), UNNAMED, most)])


def log_p_of_misfit(hypothesis: Hypothesis) -> float:
    """Return the logarithm of the p-value of the loudest test of the residual, for the number of tests."""
    tests = noise_tests(FitResidual(hypothesis.fit)) | structure_tests(hypothesis.fit)
    return min(0.0, min(tests.values()) + float(np.log(len(tests))))


def log_odds_of_anything(log_p: float) -> float:
    """Return the largest log Bayes factor of any alternative that a p-value allows, ``-log(-e p log p)``.

    It holds for every alternative under which the p-value's density decreases, and is zero from ``1 / e`` on.
    """
    return float(-1.0 - log_p - np.log(-log_p)) if log_p < -1.0 else 0.0
