"""The study of the excitation, small: what it says must follow from what it found."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.design import Search
from studies.excitation import Result, run
from studies.excitation.report import write_report


@pytest.fixture(scope="module")
def result() -> Result:
    sets = ("within the flight's rule",)
    return run(seed=2, search=Search(starts=1, iterations=4), repeats=6, random=12, points=2, sets=sets)


def test_every_manoeuvre_keeps_the_limits(result):
    (contest,) = result.contests.values()
    for name, item in contest.designs.items():
        assert all(reached.kept for reached in item.reached), name
        assert np.max(item.trajectory.tip_speed) <= 0.05
    assert 0.0 < contest.shrink["printed"] < 1.0
    assert contest.relative("paper-26") == pytest.approx((0.0, 1.0, 1.0))


def test_what_is_predicted_is_realised(result):
    (own,) = result.realised.values()
    # squared distances of the truth: chi-square of ten, over six recordings
    assert own.distances.mean() == pytest.approx(10.0, abs=4.0 * np.sqrt(20.0 / 6.0))
    assert own.errors.shape == (6, 10)
    np.testing.assert_array_less(np.abs(own.offset), 5.0 * own.sampled)


def test_the_cloud_and_the_report(result, tmp_path):
    for cloud in result.clouds.values():
        assert np.all(cloud.intended <= cloud.motion + 1e-12)  # differences only take away
        assert np.isfinite(cloud.log_det).all()
    write_report(result, tmp_path / "report.pdf")
    assert (tmp_path / "report.pdf").stat().st_size > 20_000
