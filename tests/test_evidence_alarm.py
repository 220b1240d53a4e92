"""The alarm and the power of its tests against simulated studies."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from bayesid.diagnosis.evidence.evidence_alarm import EvidenceAlarm, NullTail
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.noise.family_alarm import FamilyAlarm
from bayesid.diagnosis.outcome.candidate_table import cause_power
from tests.gram_problem import LinearProblem

SIZES = {"a": 1, "b": 3, "c": 2, "d": 1, "e": 6}


def candidates(high: float = 3.0, low: float | None = None) -> list[CandidateCause]:
    """A cause with two groups, two with one, and a generic one."""
    pair = CandidateCause("pair", (AmplitudeGroup("a", high, low), AmplitudeGroup("c", high, low)))
    single = [CandidateCause(name, (AmplitudeGroup(name, high, low),), generic=name == "e") for name in "bde"]
    return [pair, *single]


def test_p_values_of_studies_that_lack_nothing_are_uniform():
    rng = np.random.default_rng(1)
    problem = LinearProblem.random(rng, SIZES, samples=40)
    evidence = SetEvidence(problem.observed(rng).gram(), candidates())
    alarm = EvidenceAlarm.of(evidence, rng)
    scores = np.array([problem.observed(rng).gram().score for _ in range(1000)])
    each = {name: evidence.log_evidences([name], scores) for name in evidence.causes}
    largest = np.max(list(each.values()), axis=0)
    found = [np.exp([alarm.largest.log_p(x) for x in largest])]
    found += [np.exp([alarm.each[name].log_p(x) for x in own]) for name, own in each.items()]
    for p_values in found:
        assert stats.kstest(p_values, "uniform").pvalue > 1e-3
    assert (found[0] < 0.01).sum() <= stats.binom.isf(1e-3, 1000, 0.01)
    assert (largest > alarm.largest.threshold(0.01)).sum() == (found[0] <= 0.01).sum()


def test_alarm_is_that_of_the_study_itself():
    rng = np.random.default_rng(2)
    problem = LinearProblem.random(rng, SIZES, samples=40)
    loud = SetEvidence(problem.observed(rng, {"b": np.array([2.0, -1.0, 1.0])}).gram(), candidates())
    alarm = EvidenceAlarm.of(loud, rng)
    assert not alarm.silent()
    assert alarm.loudest == "b"
    assert alarm.log_evidence == pytest.approx({name: loud.log_evidence([name]) for name in loud.causes}, abs=1e-9)
    local, family = alarm.log_p_values()["b"]
    assert local <= family == alarm.log_p_value
    gram = loud.gram
    quiet = EvidenceAlarm.of(SetEvidence(Gram(gram.matrix, 0.0 * gram.score, gram.groups), candidates()), rng)
    assert quiet.silent()


def test_tail_beyond_the_draws_is_that_of_many_more_draws():
    rng = np.random.default_rng(3)
    gram = LinearProblem.random(rng, SIZES, samples=40).observed(rng).gram()
    evidence = SetEvidence(gram, [item for item in candidates() if item.name != "pair"])
    alarm = EvidenceAlarm.of(evidence, rng, 2000)
    scores = gram.null_scores(rng, 300_000)
    largest = np.max([evidence.log_evidences([name], scores) for name in evidence.causes], axis=0)
    for p in (3e-3, 1e-3, 3e-4, 1e-4):
        value = float(np.quantile(largest, 1.0 - p))
        assert alarm.largest.extrapolated(value)
        assert 0.4 * p < np.exp(alarm.largest.log_p(value)) < 4.0 * p
        assert alarm.largest.log_p(alarm.largest.threshold(p)) == pytest.approx(np.log(p))
    assert not alarm.largest.extrapolated(float(np.quantile(largest, 0.9)))


def test_scores_are_drawn_where_rounding_leaves_the_matrix_indefinite():
    columns = np.random.default_rng(7).normal(size=(50, 4))
    matrix = np.zeros((5, 5))
    matrix[:4, :4] = columns.T @ columns
    matrix[4], matrix[:, 4], matrix[4, 4] = matrix[0], matrix[:, 0], matrix[0, 0]
    matrix[4, 0] = matrix[0, 4] = matrix[0, 0] * (1.0 + 1e-7)  # two equal columns that correlate by more than one
    assert np.linalg.eigvalsh(matrix)[0] < 0.0
    scores = Gram(matrix, np.zeros(5), {"a": np.arange(5)}).null_scores(np.random.default_rng(8), 200_000)
    np.testing.assert_allclose(scores.T @ scores / len(scores), matrix, atol=0.02 * matrix.max())


def test_no_p_value_is_larger_than_the_evidence_allows():
    tail = NullTail(np.sort(np.random.default_rng(4).exponential(size=1000)), 10)
    steps = [tail.log_p(x) for x in np.linspace(-1.0, 60.0, 600)]
    assert (np.diff(steps) <= 0.0).all()
    assert steps[-1] <= np.log(10.0) - 60.0
    assert np.isfinite(tail.log_p(1e6))
    assert tail.log_p(-1.0) == 0.0


def test_p_values_are_the_same_for_the_same_generator():
    rng = np.random.default_rng(5)
    gram = LinearProblem.random(rng, SIZES, samples=40).observed(rng, {"d": np.array([0.4])}).gram()
    evidence = SetEvidence(gram, candidates())
    one, same, other = (EvidenceAlarm.of(evidence, np.random.default_rng(seed)).log_p_value for seed in (0, 0, 1))
    assert one == same != other
    with pytest.raises(ValueError, match="received 10"):
        EvidenceAlarm.of(evidence, rng, 10)
    with pytest.raises(ValueError, match="at least one candidate"):
        EvidenceAlarm.of(SetEvidence(gram, []), rng)


@pytest.mark.parametrize("low", [None, 0.3])
@pytest.mark.parametrize("name", ["b", "d", "pair"])
def test_power_is_the_rate_of_detection_in_simulated_studies(name, low):
    rng = np.random.default_rng([6, len(name)])
    problem = LinearProblem.random(rng, SIZES, samples=40)
    evidence = SetEvidence(problem.observed(rng).gram(), candidates(30.0 if low is None else 0.6, low))
    alarm = EvidenceAlarm.of(evidence, rng)
    power = cause_power(name, evidence, alarm, rng, draws=4000)
    threshold = alarm.largest.threshold(0.01)
    groups = {own.name: evidence.spectra([name])[place] for own, place in _places(evidence, name)}
    scores = []
    for _ in range(1500):
        amplitudes = {}
        for group, spectrum in groups.items():
            scale = np.exp(rng.uniform(np.log(spectrum.range.low), np.log(spectrum.range.high)))
            amplitudes[group] = scale * rng.normal(size=SIZES[group])
        scores.append(problem.observed(rng, amplitudes).gram().score)
    rate = (evidence.log_evidences([name], np.array(scores)) > threshold).mean()
    assert 0.1 < rate < 0.95
    assert power == pytest.approx(rate, abs=3.5 * np.sqrt(rate * (1.0 - rate) * (1 / 1500 + 1 / 4000)))


def _places(evidence: SetEvidence, name: str) -> list[tuple[AmplitudeGroup, int]]:
    """Groups of a cause with their places in the order of integration."""
    order = [place for _, place in evidence.places([name])]
    return [(group, order.index(place)) for place, group in enumerate(evidence.causes[name].groups)]


def test_what_cannot_be_seen_has_no_power():
    rng = np.random.default_rng(7)
    gram = LinearProblem.random(rng, SIZES, samples=40).observed(rng).gram()
    evidence = SetEvidence(gram, [CandidateCause("b", (AmplitudeGroup("b", 1e-5),)), *candidates()[2:]])
    assert evidence.invisible == ("b",)
    assert cause_power("b", evidence, EvidenceAlarm.of(evidence, rng), rng) == 0.0


def test_candidates_and_noise_share_the_level_of_the_family():
    """A candidate whose p-value is at the level of the candidates is at that of the family."""
    alarm = FamilyAlarm(SimpleNamespace(log_p_value=0.0), {})
    at = replace(alarm, candidates=SimpleNamespace(log_p_value=np.log(alarm.candidates_level)))
    assert at.p_value == pytest.approx(alarm.level, rel=1e-12)
    assert alarm.candidates_level == pytest.approx(0.5 * alarm.level, rel=0.01)
