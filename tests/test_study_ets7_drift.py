"""The drift study in its small version: two recordings, and no candidates on links and joints."""

import numpy as np
import pytest

from bayesid.diagnosis import Status
from studies.ets7_drift import CAUSES, STUDY, run
from studies.ets7_drift.analysis import ATTITUDE_SIGMA
from tests.report_rules import broken_rules

pytestmark = pytest.mark.usefixtures("slow")  # a hidden pair is named in the tests of the catalogue

NAMES = ("gravity-gradient", "wheel-momentum", "aerodynamic-drag", "thruster-leak", "rate-bias", "rate-drift")


@pytest.fixture(scope="module")
def result():
    return run(names=NAMES)["1 %"]


def test_the_three_causes_are_named(result):
    case = result
    assert case.diagnosis.verdict.status in (Status.EXPLAINED, Status.AMBIGUOUS)
    assert set(case.diagnosis.verdict.causes) == set(CAUSES)


def test_the_amplitudes_are_found_with_honest_widths(result):
    amplitudes = result.amplitudes
    assert len(amplitudes) == 3 + 3 * len(result.world.manoeuvres)
    assert max(abs(item.distance) for item in amplitudes) < 4.0


def test_the_attitude_is_predicted_only_after(result):
    noise = np.degrees(np.sqrt(3.0) * ATTITUDE_SIGMA)
    for attitude in result.attitudes:
        assert attitude.errors["plain"] > 1.0
        assert attitude.errors["extended"] < 3.0 * noise


def test_the_band_about_the_prediction_is_that_of_its_errors(result):
    assert np.abs(result.distances).max() < 4.0
    for attitude in result.attitudes:
        assert (attitude.sd >= np.degrees(ATTITUDE_SIGMA)).all()
        assert attitude.sd[-1].max() < 1.0


def test_the_present_model_cannot_follow_the_drift(result):
    """Every fit of it drives the base away, so that the base is held at its prior."""
    gain, truth = result.diagnosis.gain, result.world.base
    assert result.diagnosis.bodies_fixed
    assert gain.before.chi2_per_sample > 100.0
    assert np.abs((gain.after.bodies.mean - truth) / gain.after.bodies.sd).max() < 4.0


def test_the_report_is_written(result, tmp_path):
    STUDY.write({"1 %": result}, tmp_path / "ets7_drift.pdf")
    assert broken_rules(tmp_path / "ets7_drift.pdf", full=False) == []
