"""The study of the excitation: what it predicts is realised; the whole of it, small, with ``pytest --slow``."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.design import Paper26, Search
from studies.base_body import paper
from studies.common.ets7 import LIMITS
from studies.excitation import run
from studies.excitation.cloud import Cloud
from studies.excitation.contest import shrunk
from studies.excitation.realised import Realised
from studies.excitation.report import write_report
from studies.excitation.world import paper_family, problem


def test_the_printed_optimum_is_made_smaller_until_it_keeps_the_rule():
    own = problem(paper_family(), LIMITS, (Paper26(),))
    parameters, part = shrunk(own, paper.EXCITATION)
    assert 0.01 < part < 0.5  # it is far faster
    reached = {item.name: item for item in own.reached(parameters)}
    assert 0.999 * 0.05 < reached["tip_speed"].largest <= 0.05
    larger = own.plan.family.centre + 1.01 * (parameters - own.plan.family.centre)
    assert not all(item.kept for item in own.reached(larger))


def test_realised_errors_are_counted_in_predicted_deviations():
    rng = np.random.default_rng(1)
    predicted = np.geomspace(1e-3, 1e3, 10)
    errors = predicted * rng.normal(size=(4000, 10))
    own = Realised(errors, predicted, 0.0 * predicted, predicted, (errors**2 / predicted**2).sum(axis=1))
    np.testing.assert_allclose(own.rms, 1.0, atol=5.0 * own.rms_error)
    assert own.rms_error == pytest.approx(1.0 / np.sqrt(8000.0))


def test_rank_correlation_of_a_cloud():
    information = np.random.default_rng(2).normal(size=400)
    cloud = Cloud(np.exp(information), -information, np.zeros(400), -2.0 * information)
    assert cloud.correlation(cloud.printed)[0] == pytest.approx(1.0)
    assert cloud.correlation(cloud.intended)[0] == pytest.approx(-1.0)


@pytest.mark.usefixtures("slow")
def test_the_whole_study_small(tmp_path):
    rule = "within the flight's rule"
    result = run(seed=2, search=Search(starts=1, iterations=4), repeats=6, random=12, points=2, sets=(rule,))
    (contest,) = result.contests.values()
    for name, item in contest.designs.items():
        assert all(reached.kept for reached in item.reached), name
    assert contest.relative("paper-26") == pytest.approx((0.0, 1.0, 1.0))
    # squared distances of the truth: chi-square of ten, over six recordings
    (own,) = result.realised.values()
    assert own.distances.mean() == pytest.approx(10.0, abs=4.0 * np.sqrt(20.0 / 6.0))
    for cloud in result.clouds.values():
        assert np.all(cloud.intended <= cloud.motion + 1e-12)  # differences only take away
    write_report(result, tmp_path / "report.pdf")
    assert (tmp_path / "report.pdf").stat().st_size > 20_000
