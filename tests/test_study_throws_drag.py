"""What the throws lack, on few real throws and few candidates."""

import os

import numpy as np
import pytest

from bayesid import InputError
from studies.throws.data import DEFAULT_FOLDER
from studies.throws_drag import run
from studies.throws_drag.report import write_report

PRESENT = (DEFAULT_FOLDER / "truth.json").is_file()
NAMES = ("rate-scale",)


@pytest.fixture(scope="module")
def result(slow):
    if not PRESENT:
        reason = f"the measured throws are not at {DEFAULT_FOLDER}"
        (pytest.fail if os.environ.get("CI") else pytest.skip)(reason)
    return run(names=NAMES, reverse=False)


def test_the_rigid_model_is_not_adequate(result):
    found = result.studies[0].diagnosis
    assert not found.alarm.silent
    assert found.gain.before.chi2_per_sample > 1.2
    assert result.studies[0].taken.labels


def test_throws_left_out_are_predicted_better(result):
    held = result.studies[0].held_out
    assert (held.score["extended"] - held.score["rigid"]).sum() > 0.0
    assert np.isfinite(held.chi2["extended"]).all()


def test_the_rigid_bodies_stay_near_their_geometry(result):
    for errors in result.comparison.errors["rigid"].values():
        assert np.abs(errors).max() < 15.0


def test_nothing_is_named_that_leaves_a_torque_unexplained(result):
    """The most probable set of known causes takes the bodies off their geometry: it must not be a verdict."""
    found = result.studies[0].diagnosis
    errors = [np.abs(np.concatenate(list(result.comparison.errors[name].values()))) for name in ("rigid", "extended")]
    assert errors[1].mean() < errors[0].mean() or not found.verdict.causes
    assert found.probabilities.unknown > 0.9


def test_the_report_is_written(result, tmp_path):
    write_report(result, tmp_path / "throws_drag.pdf")
    assert (tmp_path / "throws_drag.pdf").read_bytes().startswith(b"%PDF")


def test_absent_measurements_are_named(tmp_path):
    with pytest.raises(InputError, match=r"the throws are not here: no truth.json. Give the folder"):
        run(tmp_path)
