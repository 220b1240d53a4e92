"""The planning study: a plan with the true ship hits in MuJoCo, and how its regions are judged."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.report.verdict_record import Share
from bayesid.robot.body_prior import coordinates_of
from studies.common import mission
from studies.common.study import Verdict
from studies.planning import run
from studies.planning.analysis import Planner, Swing, fitted, fly, miss_of, planners_model, true_ship
from studies.planning.report import STUDY, _verdict, goals
from tests.report_rules import broken_rules


def test_a_path_ends_where_its_quintics_do():
    swing = Swing(mission.start(), mission.start() + 0.5)
    state = swing.evaluate(np.array([0.0, 0.5 * swing.duration, swing.duration]))
    np.testing.assert_allclose(state.position - mission.start(), np.outer([0.0, 0.25, 0.5], np.ones(6)), atol=1e-12)
    np.testing.assert_allclose(state.velocity[[0, 2]], 0.0, atol=1e-12)
    np.testing.assert_allclose(state.velocity[1], 1.875 * 0.5 / swing.duration)


def test_counts_are_judged_together_and_few_decide_nothing():
    right, wrong, few = Share(190, 200), Share(170, 200), Share(19, 20)
    assert _verdict([right] * 3) is Verdict.PASS
    assert _verdict([right, wrong, right]) is Verdict.FAIL
    assert _verdict([few] * 3) is Verdict.OPEN
    # one of three may lie beyond its own 95 % interval
    assert _verdict([Share(183, 200), right, right]) is Verdict.PASS


def test_a_linear_posterior_is_fitted_as_by_hand():
    rng = np.random.default_rng(0)
    jacobian, data = rng.normal(size=(8, 3)), rng.normal(size=8)
    posterior = SimpleNamespace(size=3, jacobian=lambda z: jacobian, least_squares=lambda z: jacobian @ z - data)
    z, covariance = fitted(posterior)
    np.testing.assert_allclose(z, np.linalg.lstsq(jacobian, data, rcond=None)[0], atol=1e-10)
    np.testing.assert_allclose(covariance, np.linalg.inv(jacobian.T @ jacobian), atol=1e-10)


@pytest.mark.usefixtures("slow")
def test_a_plan_hits_with_the_true_ship_and_misses_with_the_published_one():
    planner = Planner(planners_model(0.0))
    robot = true_ship(np.random.default_rng(1), 0.0)
    (prior,) = planner.model.priors
    right = planner.plan(coordinates_of(prior, robot.link(prior.name).inertial))
    assert miss_of(fly(robot, right)["tip"], planner.target)[0] < 1e-3
    assert miss_of(fly(robot, planner.first)["tip"], planner.target)[0] > 1.0
    assert miss_of(fly(mission.published_robot(), planner.first)["tip"], planner.target)[0] < 1e-3


@pytest.mark.usefixtures("slow")
def test_the_whole_study_small(tmp_path):
    parameters = mission.splines(2).centre + 0.3 * np.random.default_rng(3).normal(size=12)
    result = run(parameters, seed=2, ships=4)
    for own in result.rows.values():
        assert np.all(own.miss[:, 1, 0] < own.miss[:, 0, 0])
    STUDY.write(result, tmp_path / "report.pdf")
    assert broken_rules(tmp_path / "report.pdf", full=False) == []
    assert goals(result)[0].verdict is Verdict.OPEN  # four ships decide nothing
    for row, own in result.rows.items():  # one wrong arm is enough
        absent = replace(own, inside=np.repeat(np.zeros_like(own.inside), 10, axis=0))
        assert goals(replace(result, rows={**result.rows, row: absent}))[0].verdict is Verdict.FAIL
