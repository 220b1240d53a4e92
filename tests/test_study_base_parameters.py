"""The study of base parameters: what its report says, and the comparison with FIGAROH where that is installed."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from bayesid.identifiability import base_parameters
from bayesid.robot.robot import Robot
from studies.base_parameters import Result, run
from studies.base_parameters.report import STUDY, goals_of, regrouping_rows, symbol, unchanged
from studies.base_parameters.structure import compare
from studies.common.study import Verdict
from tests.report_rules import broken_rules


@pytest.fixture(scope="module")
def result() -> Result:
    return run()


def test_the_papers_counts_stand_out_of_rounding(result):
    for one, count in ((result.planar, 24), (result.arm, 52)):
        assert one.base.count == count
        assert one.singular[count - 1] > 0.05
        assert one.singular[count] < 1e-14
    np.testing.assert_allclose(result.equations.regressor, result.equations.pinocchio, atol=1e-12)
    np.testing.assert_allclose(result.equations.regressor[:6], 0.0, atol=1e-12)
    assert np.abs(result.equations.regressor[6:]).min() > 0.1


def test_only_known_things_that_nothing_else_explains_tell_the_scale(result):
    """As the report says of them in words."""
    cases = {case.data: case for case in result.scale}
    left_open = {
        "motion, tumbling",
        "motion, from rest",
        "motion in the gravity gradient, tumbling",
        "motion in the gravity gradient, from rest",
        "motion, mass of base_link known",
        "motion, link6 with a load fixed on it, load known",
    }
    assert {name for name, case in cases.items() if case.open_scale} == left_open
    assert "motion, mass of the whole robot known" in cases
    for name, case in cases.items():
        assert case.determined.rank == (51 if name in left_open else 52), name
        assert case.determined.gap[1] < 1e-13 < 1e-7 < case.determined.gap[0], name
    links = [cases[f"motion, link{index} known"].determined.gap[0] for index in range(1, 7)]
    assert max(links) < 1e-3 * cases["motion, base_link known"].determined.gap[0]


def test_the_standard_parameters_follow_from_the_dependent_ones(result):
    recovery = result.recovery
    assert recovery.base_error < 1e-11
    assert recovery.standard_error < 1e-11
    assert recovery.torque_error < 1e-11
    assert recovery.untouched == len(unchanged(result.arm.base)) == 21
    _, old, new = recovery.shifted[0]
    assert abs(new - old) > 10.0


def test_formulas():
    base = base_parameters(Robot.shipped("ets7"))
    rows = dict(regrouping_rows(base))
    assert rows["base_link.mass"] == "m₀ + m₁₋₆"
    assert rows["link2.inertia.xx"] == "Ixx₂ + 0.7569 m₃₋₆ − Iyy₂"
    assert rows["link5.first.x"] == "hx₅ − hz₆"
    assert len(rows) + len(unchanged(base)) == base.count
    assert symbol("link3.first.z", ["base_link", "link1", "link2", "link3"]) == "hz₃"


def test_pinocchios_rank_agrees_without_the_other_tool(result):
    assert [(case.count, case.rank) for case in (*result.peers, result.tilted)] == [(4, 4), (36, 36), (38, 38)]


def test_the_report_is_written(result, tmp_path):
    STUDY.write(result, tmp_path / "report.pdf")
    assert broken_rules(tmp_path / "report.pdf") == []
    assert {goal.verdict for goal in goals_of(result)[:-1]} == {Verdict.PASS}


@pytest.mark.skipif(importlib.util.find_spec("figaroh") is None, reason="FIGAROH is in the extra peers only")
def test_figaroh_gives_the_same_space():
    comparison = compare(Robot.shipped("ets7"), np.random.default_rng(4), gravity=(3.0, 2.0, -9.0))
    assert comparison.peer == comparison.count == comparison.rank
    assert comparison.angle is not None
    assert comparison.angle < 1e-8
