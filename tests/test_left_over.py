"""Causes that do not follow the data once they are simulated in full leave room for something else."""

import numpy as np
import pytest
from scipy import stats

from bayesid.diagnosis import Status
from bayesid.diagnosis.left_over import LEFT_OVER, log_odds_of_anything, log_p_left, with_left_over
from bayesid.diagnosis.perturbed_fit import Engine
from studies.truth import hidden_causes
from tests.test_diagnosis import run


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
def backlash(tmp_path_factory):
    case = next(case for case in hidden_causes.CASES if case.name == "backlash")
    return run(case.make(tmp_path_factory.mktemp("backlash"), 31))


def test_a_gear_with_backlash_is_called_unknown(backlash) -> None:
    """It looks like a soft joint, which does not follow the data where the joint changes its sense."""
    assert backlash.verdict.status is Status.UNKNOWN
    assert backlash.probabilities.inclusion["joint-flexibility:joint2"] > 0.5
    assert backlash.probabilities.inclusion[LEFT_OVER] > 0.9


def test_the_set_is_fitted_in_full(backlash) -> None:
    weighed, fitted = with_left_over(backlash.weighed, backlash.effects)
    assert fitted
    for hypothesis in fitted.values():
        assert isinstance(hypothesis.engine, Engine)
        assert log_p_left(hypothesis) < -20.0
        fit = hypothesis.fit
        assert stats.chi2.logsf(fit.chi2, fit.posterior.samples) < -20.0
    assert sum(item.probability for item in weighed.probabilities.sets) == pytest.approx(1.0)
