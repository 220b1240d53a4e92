"""The drift study in its small version: two recordings, and no candidates on links and joints."""

from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.diagnosis import Status
from studies.common.study import Verdict
from studies.ets7_drift import CAUSES, STUDY, run
from studies.ets7_drift.analysis import ATTITUDE_SIGMA
from studies.ets7_drift.report import goals_of
from tests.report_rules import broken_rules

slow = pytest.mark.usefixtures("slow")  # a hidden pair is named in the tests of the catalogue

NAMES = ("gravity-gradient", "wheel-momentum", "aerodynamic-drag", "thruster-leak", "rate-bias", "rate-drift")


@pytest.fixture(scope="module")
def result():
    return run(names=NAMES)["1 %"]


@slow
def test_the_three_causes_are_named(result):
    case = result
    assert case.diagnosis.verdict.status in (Status.EXPLAINED, Status.AMBIGUOUS)
    assert set(case.diagnosis.verdict.causes) == set(CAUSES)


@slow
def test_the_amplitudes_are_found_with_honest_widths(result):
    amplitudes = result.amplitudes
    assert len(amplitudes) == 3 + 3 * len(result.world.manoeuvres)
    assert max(abs(item.distance) for item in amplitudes) < 4.0


@slow
def test_the_attitude_is_predicted_only_after(result):
    noise = np.degrees(np.sqrt(3.0) * ATTITUDE_SIGMA)
    for attitude in result.attitudes:
        assert attitude.errors["plain"] > 1.0
        assert attitude.errors["extended"] < 3.0 * noise


@slow
def test_the_band_about_the_prediction_is_that_of_its_errors(result):
    assert np.abs(result.distances).max() < 4.0
    for attitude in result.attitudes:
        assert (attitude.sd >= np.degrees(ATTITUDE_SIGMA)).all()
        assert attitude.sd[-1].max() < 1.0


@slow
def test_the_present_model_cannot_follow_the_drift(result):
    """Every fit of it drives the base away, so that the base is held at its prior."""
    gain, truth = result.diagnosis.gain, result.world.base
    assert result.diagnosis.bodies_fixed
    assert gain.before.chi2_per_sample > 100.0
    assert np.abs((gain.after.bodies.mean - truth) / gain.after.bodies.sd).max() < 4.0


@slow
def test_the_report_is_written(result, tmp_path):
    STUDY.write({"1 %": result}, tmp_path / "ets7_drift.pdf")
    assert broken_rules(tmp_path / "ets7_drift.pdf", full=False) == []


def made_up(*, right: bool = True, after: float = 0.01, end: float = 1.0, far: float = 1.0) -> SimpleNamespace:
    """A case with an error of one degree before, and with errors in sd at the ends and of the amplitudes."""
    bodies = SimpleNamespace(mean=np.ones(10), sd=np.ones(10))
    diagnosis = SimpleNamespace(
        verdict=SimpleNamespace(causes=CAUSES if right else CAUSES[:1]),
        gain=SimpleNamespace(after=SimpleNamespace(bodies=bodies)),
        probabilities=SimpleNamespace(sets=[SimpleNamespace(probability=0.97, generic=None, causes=CAUSES)]),
    )
    return SimpleNamespace(
        right=right,
        diagnosis=diagnosis,
        attitudes=[SimpleNamespace(errors={"plain": 1.0, "extended": after})],
        distances=np.array([[end, 0.0, -end]]),
        amplitudes=[SimpleNamespace(distance=far)],
        world=SimpleNamespace(base=np.ones(10)),
    )


@pytest.mark.parametrize(
    ("wrong", "number"), [({"right": False}, 0), ({"after": 0.02}, 1), ({"end": 3.0}, 2), ({"far": -4.0}, 3)]
)
def test_the_worse_of_both_bases_decides_each_goal(wrong, number):
    good = {"5 %": made_up(), "1 %": made_up()}
    assert [goal.verdict for goal in goals_of(good)] == [Verdict.PASS] * 4
    verdicts = [goal.verdict for goal in goals_of({**good, "1 %": made_up(**wrong)})]
    assert verdicts == [Verdict.FAIL if place == number else Verdict.PASS for place in range(4)]
    assert {goal.verdict for goal in goals_of({"1 %": made_up()})} == {Verdict.OPEN}
    assert {goal.verdict for goal in goals_of({})} == {Verdict.NOT_TESTED}
