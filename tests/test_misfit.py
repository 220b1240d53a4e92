"""Causes that do not follow the data once they are simulated in full leave room for something else."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import CauseSet, Status, diagnose
from bayesid.diagnosis.candidates.cause_kind import candidates
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.search.misfit import UNNAMED, log_odds_of_anything, log_p_of_misfit, with_misfit
from bayesid.diagnosis.search.relinearise import SetSearch
from studies.truth import hidden_causes


@pytest.mark.parametrize("p", [0.3, 0.05, 1e-3, 1e-8])
def test_no_decreasing_alternative_has_larger_odds(p: float) -> None:
    """The bound of Sellke, Bayarri and Berger: the best density ``a p^(a - 1)`` of p-values over all a in (0, 1)."""
    shapes = np.linspace(1e-4, 1.0, 20001)
    best = np.log(shapes * p ** (shapes - 1.0)).max()
    assert log_odds_of_anything(np.log(p)) == pytest.approx(best, abs=1e-4)


def test_likely_residuals_say_nothing() -> None:
    assert log_odds_of_anything(np.log(0.5)) == 0.0
    assert log_odds_of_anything(0.0) == 0.0


@pytest.fixture(scope="module")
def backlash(tmp_path_factory, slow):
    """A gear with backlash, among few candidates."""
    case = next(case for case in hidden_causes.CASES if case.name == "backlash")
    study = Study.load(case.make(tmp_path_factory.mktemp("backlash"), 31, 1.6))
    model = load_model(study)
    effects = [effect for effect in candidates(model) if effect.label in ("joint-flexibility:joint2", "accel-bias")]
    return diagnose(model, load_manoeuvres(study, model.robot), effects=effects)


def test_a_gear_with_backlash_is_called_unknown(backlash) -> None:
    """It looks like a soft joint, which does not follow the data where the joint changes its sense."""
    assert backlash.verdict.status is Status.UNKNOWN


def test_a_set_is_fitted_in_full_and_what_it_leaves_is_weighed(backlash) -> None:
    """A soft joint alone is made certain, and is then seen not to follow the data."""
    search = backlash.search
    found = search.probabilities
    sure = next(item for item in found.sets if item.causes == ("joint-flexibility:joint2",) and item.generic is None)
    only = SetProbabilities.of([sure, CauseSet((), None, -1e3)], found.causes, found.generics, found.prior)
    assert only.unknown == 0.0
    search, fitted = with_misfit(replace(search, probabilities=only), backlash.effects)
    (hypothesis,) = fitted.values()
    assert log_p_of_misfit(hypothesis) < -20.0
    fit = hypothesis.fit
    assert stats.chi2.logsf(fit.chi2, fit.posterior.samples) < -20.0
    assert search.probabilities.inclusion[UNNAMED] > 0.9
    assert sum(item.probability for item in search.probabilities.sets) == pytest.approx(1.0)


def test_a_set_with_which_nothing_moves_is_no_explanation(backlash, monkeypatch) -> None:
    def without_motion(*_: object) -> None:
        raise InputError("the simulation diverges")

    monkeypatch.setattr(SetSearch, "fit", without_motion)
    found = backlash.search.probabilities
    sure = [item for item in found.sets if len(item.causes) == 1 and item.generic is None]
    nothing = CauseSet((), None, min(item.log_evidence for item in sure) - 20.0)
    only = SetProbabilities.of([*sure, nothing], found.causes, found.generics, found.prior)
    search, fitted = with_misfit(replace(backlash.search, probabilities=only), backlash.effects)
    assert not fitted
    assert search.probabilities.unknown > 0.9
    most = max(item.log_evidence for item in sure)
    assert [item.log_evidence for item in search.probabilities.sets if item.generic == UNNAMED] == [most]
    assert sum(item.probability for item in search.probabilities.sets) == pytest.approx(1.0)
