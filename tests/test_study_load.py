"""The study of section 4.2 in its small version: MuJoCo flies two manoeuvres, each planned from the one before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies import load
from studies.load import paper
from studies.load.report import write_report
from studies.load.setting import LIMITS, RANGE

GOAL = 1e-6


@pytest.fixture(scope="module")
def result() -> load.Result:
    return load.run()


@pytest.mark.usefixtures("slow")
def test_the_load_is_found_from_a_guess_of_a_thirtieth(result):
    assert len(result.iterations) == 2
    for iteration, printed in zip(result.iterations, paper.RESULTS, strict=True):
        assert iteration.worst < GOAL
        assert np.abs(paper.errors(printed)).max() > 1e3 * iteration.worst


@pytest.mark.usefixtures("slow")
def test_the_second_manoeuvre_is_another_and_both_keep_the_limits(result):
    first, second = (iteration.parameters for iteration in result.iterations)
    assert np.abs(first - second).max() > 0.01
    for iteration in result.iterations:
        recording = iteration.recording
        position = np.stack([recording.channels[f"position.joint{index + 1}"] for index in range(3)])
        assert np.abs(position).max() <= RANGE
        speed = np.abs(np.diff(position) / np.diff(recording.time))
        assert speed.max() <= LIMITS.joint_speed


def test_only_one_reading_of_the_printed_inertia_is_a_body():
    centre, link = paper.readings(paper.TRUTH)
    np.testing.assert_allclose(centre.moments, 700.0)
    # 370 kg at 1.20 m
    np.testing.assert_allclose(link.moments, [700.0 - 370.0 * 1.4405, 700.0 - 370.0 * 1.4405, 700.0])
    assert centre.physical
    assert not link.physical
    for printed in paper.RESULTS:
        assert [reading.physical for reading in paper.readings(printed)] == [True, False]


@pytest.mark.usefixtures("slow")
def test_the_report_is_written(result, tmp_path: Path):
    write_report(result, tmp_path / "load.pdf")
    assert (tmp_path / "load.pdf").read_bytes().startswith(b"%PDF")
