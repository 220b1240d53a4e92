"""The study of thrown bodies, on real measurements that lie beside the checkout."""

import os
from fractions import Fraction

import numpy as np
import pytest

from bayesid import InputError
from studies.common.study import Verdict
from studies.throws import run
from studies.throws.analysis import BodyResult
from studies.throws.data import CALIBRATION, DEFAULT_FOLDER, read_throws, read_truth
from studies.throws.raw import Timing
from studies.throws.report import STUDY, _quick_fit, covered_in_all, goals_of, miscounted_orders
from studies.throws.rotor import near, pole_pairs, speed_ratio
from tests.report_rules import broken_rules

PRESENT = (DEFAULT_FOLDER / "truth.json").is_file()


@pytest.fixture(scope="module")
def folder():
    if not PRESENT:
        reason = f"the measured throws are not at {DEFAULT_FOLDER}"
        (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)
    return DEFAULT_FOLDER


@pytest.fixture(scope="module")
def result(folder):
    return run(folder, throws=3)


def test_a_wrong_number_of_poles_is_found_in_every_throw_and_its_ratio_is_named(folder):
    orders, stated = miscounted_orders(folder, read_truth(folder).bodies), Timing(pole_pairs=6)
    assert len(orders) == 31
    assert near(orders, 6.0 / 7.0) == 31
    assert speed_ratio(orders, stated) == Fraction(6, 7)
    assert pole_pairs(orders, stated) == 7


@pytest.mark.slow
def test_the_wheel_and_the_bodies_jointly(result):
    analysis = result.extended
    assert analysis.converged
    assert 1.66e-6 < analysis.wheel < 1.72e-6
    for body in analysis.bodies.values():
        assert np.abs(body.joint_errors).max() < 3.0
        assert np.abs(body.joint_distance).max() < 3.0


@pytest.mark.slow
@pytest.mark.parametrize(("body", "mean", "largest"), [("Empty", 1.9, 6.0), ("A", 1.0, 3.0)])
def test_single_throws(result, body, mean, largest):
    found = result.extended.bodies[body]
    assert found.moments.shape == (3, 3)
    assert found.mean_error <= mean
    assert found.largest_error <= largest


@pytest.mark.slow
def test_the_rigid_model_is_overconfident_and_the_extended_one_is_not(result):
    for body in ("Empty", "A"):
        plain, extended = result.plain.bodies[body], result.extended.bodies[body]
        assert plain.inflation > 5.0
        assert extended.inflation < 2.0
        assert plain.covered(0.95)[0] < extended.covered(0.95)[0]
    held, total = covered_in_all(result, with_truth=True)
    assert held >= 0.9 * total


@pytest.mark.slow
def test_the_unexplained_torque_has_the_width_that_its_prior_says(result):
    for body in (*CALIBRATION, "Empty", "A"):
        torque = result.extended.widths[body]["smooth-torque"]
        assert 0.9 < torque.factor < 1.1
        assert not torque.doubtful


@pytest.mark.slow
def test_throws_left_out_confirm_all_effects_but_a_delay(result):
    total = {effect: sum(loss.sum() for loss in by_body.values()) for effect, by_body in result.extended.losses.items()}
    assert total.pop("wheel-delay") < 1.0
    assert min(total.values()) > 20.0


@pytest.mark.slow
def test_goals_without_a_diagnosis_are_not_tested(result):
    verdicts = {goal.text: goal.verdict for goal in goals_of(result)}
    assert verdicts["a cause named on every body"] is Verdict.NOT_TESTED


@pytest.mark.slow
def test_the_report_is_written(result, tmp_path):
    STUDY.write(result, tmp_path / "throws.pdf")
    assert broken_rules(tmp_path / "throws.pdf", full=False) == []


@pytest.mark.parametrize(
    ("error", "scatter", "verdict"), [(1.0, 0.1, Verdict.PASS), (1.8, 0.4, Verdict.OPEN), (3.0, 0.1, Verdict.FAIL)]
)
def test_differences_from_the_stated_moments_are_decided_by_their_scatter(error, scatter, verdict):
    sizes = error + scatter * np.array([-1.0, 1.0, 0.0])
    moments = 1.0 + 0.01 * np.tile(sizes[:, None], 3)
    body = BodyResult("Empty", ("1", "2", "3"), moments, *[np.ones(3)] * 6)
    assert body.mean_error == pytest.approx(error)
    assert body.mean_error_sd == pytest.approx(scatter / np.sqrt(3.0))
    assert _quick_fit([body]).verdict is verdict
    precise = BodyResult("A", ("1", "2"), np.full((2, 3), 1.02), *[np.ones(3)] * 6)
    assert _quick_fit([body, precise]).verdict is Verdict.FAIL


def test_absent_measurements_are_named(tmp_path):
    with pytest.raises(InputError, match=r"the measured throws are missing: no truth.json. Give the folder"):
        run(tmp_path)
    with pytest.raises(InputError, match="no throws of 'A'"):
        read_throws(tmp_path, "A", Timing())
