"""What the most probable causes leave once they are fitted in full: evidence for something else beside them.

A p-value bounds that evidence (Sellke, Bayarri & Berger 2001, Calibration of p values for testing precise null
hypotheses, The American Statistician 55).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesid._io.errors import InputError
from bayesid.diagnosis.evidence.cause_sets import CauseSet, SetProbabilities
from bayesid.diagnosis.noise.family_alarm import noise_tests, structure_tests
from bayesid.diagnosis.noise.noise_fault import FitResidual
from bayesid.diagnosis.search.fitted_set import Hypothesis, exactly_fitted
from bayesid.diagnosis.search.model_search import ModelSearch
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.simulation.effects.effect import Effect

__all__ = ["UNNAMED", "log_odds_of_anything", "log_p_of_misfit", "with_misfit"]

UNNAMED = "something beside the fitted causes"
"""Generic candidate that has no form: whatever the fitted causes leave."""


def with_misfit(
    search: ModelSearch, effects: Sequence[Effect], settings: DiagnosisSettings = DEFAULT_SETTINGS
) -> tuple[ModelSearch, dict[frozenset[str], Hypothesis]]:
    """Fit the most probable sets of causes in full, and weigh that they do not suffice.

    The probabilities come from linear signatures. A set that does not follow the data once its effects are simulated
    gets a companion: the same causes beside something else, with as much more evidence as the p-value of what is left
    allows at most (`log_odds_of_anything`). One with which no motion can be simulated is no explanation: its evidence
    goes to something else alone.

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
    for _ in range(settings.most_full_fits):
        known = (cause_set for cause_set in probabilities.sets if cause_set.causes and cause_set.generic is None)
        best = next((cause_set for cause_set in known if frozenset(cause_set.causes) not in fitted), None)
        if best is None or best.probability < settings.fitted_in_full_from:
            break
        under = search.under(best.causes)
        try:
            hypothesis = under.fit(best.causes, effects)
        except InputError:
            probabilities = _without_motion(probabilities, best)
            continue
        if under.point.far:
            hypothesis = exactly_fitted(hypothesis)
        fitted[frozenset(best.causes)] = hypothesis
        more = log_odds_of_anything(log_p_of_misfit(hypothesis))
        companion = CauseSet(best.causes, UNNAMED, best.log_evidence + more)
        probabilities = probabilities.with_sets([*probabilities.sets, companion])
    return replace(search, probabilities=probabilities), fitted


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
