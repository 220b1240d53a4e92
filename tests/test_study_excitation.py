"""The study of the excitation: what it predicts is realised; the whole of it, small, with ``pytest --slow``."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from bayesid import Robot
from bayesid.design import Search, SearchResult, Store
from studies.base_body import paper
from studies.common import mission
from studies.common.repeated_fits import Realised, Reference, ratio_interval
from studies.common.study import Verdict
from studies.excitation import STUDY, run
from studies.excitation.report import goals, near, realised_goal, scale_error
from studies.excitation.search import Cloud, Crowd, Rivals, Searches, other_robots, paper_problem, shrunk
from tests.report_rules import broken_rules

FACTOR = np.tril(np.random.default_rng(8).normal(size=(10, 10)), -1) + np.diag(np.geomspace(0.1, 1.0, 10))
SCALES = np.geomspace(1e-3, 1e3, 10)
COVARIANCE = np.outer(SCALES, SCALES) * (FACTOR @ FACTOR.T)


@pytest.mark.slow
def test_the_printed_optimum_is_made_smaller_until_it_keeps_the_rule():
    own = paper_problem()
    parameters, part = shrunk(own, paper.EXCITATION)
    assert 0.01 < part < 0.5  # it is far faster
    reached = {item.name: item for item in own.reached(parameters)}
    assert 0.999 * 0.05 < reached["tip_speed"].largest <= 0.05
    larger = own.plan.family.centre + 1.01 * (parameters - own.plan.family.centre)
    assert not all(item.kept for item in own.reached(larger))


def test_realised_errors_are_counted_in_predicted_deviations():
    rng = np.random.default_rng(1)
    predicted = np.geomspace(1e-3, 1e3, 10)
    own = Realised(predicted * rng.normal(size=(4000, 10)), np.diag(predicted**2), np.zeros(4000))
    np.testing.assert_allclose(own.rms, 1.0, atol=5.0 * own.rms_error)
    assert own.rms_error == pytest.approx(1.0 / np.sqrt(8000.0))
    assert own.ratio == pytest.approx(1.0, abs=0.02)


def flights(count: int, seed: int, covariance: np.ndarray = COVARIANCE) -> Realised:
    """Return flights with errors of a covariance that need not be the predicted one."""
    errors = np.random.default_rng(seed).normal(size=(count, 10)) @ np.linalg.cholesky(covariance).T
    return Realised(errors, COVARIANCE, np.zeros(count))


def test_correlated_errors_are_counted_in_independent_directions():
    own = flights(20000, 1)
    assert np.abs(np.corrcoef(own.errors.T) - np.eye(10)).max() > 0.9
    np.testing.assert_allclose(own.whitened.T @ own.whitened / 20000, np.eye(10), atol=0.05)
    np.testing.assert_allclose(own.directions, 1.0, atol=5.0 * own.rms_error)
    assert own.scale == pytest.approx(1.0, abs=5.0 * scale_error(own))
    assert scale_error(own) == pytest.approx(own.rms_error / np.sqrt(10.0))
    p_values = [flights(400, seed).p_value for seed in range(200)]
    assert stats.kstest(p_values, "uniform").pvalue > 0.01
    wrong = [flights(400, seed, COVARIANCE + np.diag(0.2 * np.diag(COVARIANCE))).p_value for seed in range(20)]
    assert max(wrong) < 1e-4
    assert np.isnan(flights(10, 1).p_value)


def test_intervals_of_a_ratio_contain_it_as_often_as_stated():
    rng = np.random.default_rng(3)
    ratios = np.sqrt((rng.normal(size=(4000, 20)) ** 2).mean(axis=1))
    inside = sum(low <= 1.0 <= high for low, high in (ratio_interval(float(ratio), 20, 0.9) for ratio in ratios))
    assert stats.binomtest(inside, 4000, 0.9).pvalue > 0.01


def test_realised_errors_are_judged_by_intervals():
    """A share of 400 flights decides all directions together, and not each; one that is far away is seen."""
    names = ("paper-26", "paper-26-intended", "condition-number", "d-optimal")
    right = {name: flights(400, seed) for seed, name in enumerate(names)}
    goal = realised_goal(right)
    assert goal.verdict is Verdict.PASS
    assert "400 flights of each" in goal.reached
    wider = flights(400, 9, 1.2 * COVARIANCE)  # of 1.095 times the sd
    assert realised_goal({**right, "d-optimal": wider}).verdict is Verdict.FAIL
    assert "(d-optimal)" in realised_goal({**right, "d-optimal": wider}).reached
    for ratio, verdict in ((1.3, Verdict.FAIL), (1.12, Verdict.OPEN)):  # in one direction of one manoeuvre
        own = right["d-optimal"]
        sd = own.predicted
        variances, axes = np.linalg.eigh(COVARIANCE / np.outer(sd, sd))
        white = own.whitened / own.directions
        white[:, 0] *= ratio
        errors = (white * np.sqrt(variances)) @ axes.T * sd
        assert realised_goal({**right, "d-optimal": replace(own, errors=errors)}).verdict is verdict
    many = {name: flights(40000, seed, 1.04 * COVARIANCE) for seed, name in enumerate(names)}  # 1.02 times the sd
    assert max(each.p_value for each in many.values()) < 1e-6
    assert realised_goal(many).verdict is Verdict.PASS
    few = {name: flights(20, seed) for seed, name in enumerate(names)}
    assert realised_goal(few).verdict is Verdict.OPEN
    assert realised_goal({}).verdict is Verdict.NOT_TESTED


def test_rank_correlation_of_a_cloud():
    information = np.random.default_rng(2).normal(size=400)
    cloud = Cloud(np.exp(information), -information, np.zeros(400), information)
    assert cloud.correlation(cloud.printed)[0] == pytest.approx(1.0)
    assert cloud.correlation(cloud.intended)[0] == pytest.approx(-1.0)


def test_the_best_of_some_descents_is_that_of_all_their_choices():
    costs = np.array([0.3, -1.0, 0.1, 2.0, 0.1])
    crowd = Crowd(np.zeros(2), -1.1, costs)
    for count in (1, 2, 4, 5):
        best = [min(choice) for choice in combinations(costs, count)]
        assert crowd.expected(count) == pytest.approx(np.mean(best))


def test_the_flight_s_manoeuvre_lies_in_the_middle_of_the_mission():
    state = mission.flight_manoeuvre().evaluate(np.array([0.0, 0.5 * mission.DURATION, mission.DURATION]))
    np.testing.assert_allclose(state.position[[0, 2]], np.tile(mission.start(), (2, 1)), atol=1e-9)
    np.testing.assert_allclose(state.position[1] - mission.start(), [0.0, 0.264, -0.321, 0.057, 0.0, 0.0], atol=1e-9)


@pytest.mark.usefixtures("slow")
def test_a_recording_without_noise_is_fitted_at_the_truth():
    reference = Reference.of(mission.base_unknown(0.0), mission.flight_manoeuvre())
    plan = reference.posterior
    np.testing.assert_allclose(plan.residuals(reference.z), 0.0, atol=1e-6)
    again = reference.given(plan.manoeuvres[0])
    np.testing.assert_array_equal(again.residuals(reference.z), plan.residuals(reference.z))
    np.testing.assert_allclose(reference.inverse @ reference.jacobian, np.eye(plan.size), atol=1e-6)


@pytest.mark.usefixtures("slow")
def test_the_whole_study_small(tmp_path):
    result = run(seed=2, search=Search(starts=1, iterations=4), starts=4, repeats=4, random=8, points=2)
    for name, item in result.contest.designs.items():
        assert all(reached.kept for reached in item.reached), name
    for row in mission.ROWS:
        assert result.contest.factor("paper-26", "paper-26", row) == pytest.approx(1.0)
    (own,) = result.realised.values()
    assert 0.3 < own.ratio < 2.0
    assert own.last_step.max() < 0.5
    assert np.all(result.cloud.intended <= result.cloud.motion + 1e-12)  # differences only take away
    STUDY.write(result, tmp_path / "report.pdf")
    assert broken_rules(tmp_path / "report.pdf", full=False) == []
    for errors, verdict in ((3.0 * own.errors, Verdict.FAIL), (own.errors / own.rms, Verdict.OPEN)):
        realised = {"d-optimal": replace(own, errors=errors)}
        assert goals(replace(result, realised=realised))[3].text.startswith("Realised")
        assert goals(replace(result, realised=realised))[3].verdict is verdict  # four flights do not decide
    cost = result.contest.designs["d-optimal"].optimum.cost
    crowds = {name: replace(crowd, costs=np.full(100, cost), cost=cost) for name, crowd in result.crowds.items()}
    for away, words in ((0.0, "0 % above"), (0.3, "1.5 % above"), (0.5, "2.6 % above")):
        searches = Searches(np.zeros(1), np.array([cost, cost + away]))
        assert words in near(replace(result, crowds=crowds, searches=searches))
    for away, verdict in ((0.1, Verdict.PASS), (0.3, Verdict.FAIL)):  # 1 and 3 % of each of ten deviations
        rivals = {"one": Rivals(cost, cost + away), "two": Rivals(cost, cost - 1.0)}
        searched = replace(result, crowds=crowds, searches=Searches(np.zeros(1), np.array([cost])), rivals=rivals)
        (robots,) = (goal for goal in goals(searched) if goal.text.startswith("On each of 3 robots"))
        assert robots.verdict is verdict
    for count, verdict in ((1, Verdict.OPEN), (3, Verdict.PASS)):
        searches = Searches(np.zeros(1), np.full(count, cost))
        (largest,) = (
            goal
            for goal in goals(replace(result, crowds=crowds, searches=searches))
            if goal.text.startswith("At least 3 searches")
        )
        assert largest.verdict is verdict  # with the crowd's own, two and four followed searches agree


def drawn(problem, criterion, rng, search, *, known, keep, progress):
    """A search whose descents end where they begin."""
    names = [f"0.{start}" for start in range(search.starts)]
    for name in names:
        if known(name) is None:
            keep(name, rng.normal(size=problem.plan.family.centre.shape), rng.normal(), 1)
    parameters, cost, _ = min(map(known, names), key=lambda descent: descent[1])
    return SearchResult(parameters, cost, (cost,), 1)


def test_searches_on_other_robots_are_resumed_from_the_store(monkeypatch, tmp_path):
    monkeypatch.setattr("studies.excitation.search.ROBOTS", {"a table": lambda: Robot.shipped("planar")})
    monkeypatch.setattr("studies.excitation.search.optimise", drawn)
    efforts = Search(200), Search(1)
    rivals = other_robots(1, *efforts, Store.open(tmp_path / "store.json", "small"), print)
    assert list(rivals) == ["a table"]
    assert rivals["a table"].crowd < rivals["a table"].search
    assert other_robots(1, *efforts, Store.open(tmp_path / "store.json", "small"), print) == rivals
    assert other_robots(1, *efforts, Store.forgetful(), print) == rivals
    assert other_robots(2, *efforts, Store.open(tmp_path / "store.json", "other"), print) != rivals
