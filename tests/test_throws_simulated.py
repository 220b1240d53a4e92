"""Simulated throws through the reader of the measured ones: noise as declared, and causes that are known."""

import json
from fractions import Fraction

import numpy as np
import pytest

from bayesid import Posterior
from bayesid.diagnosis import Status, diagnose
from studies.throws.data import SMOOTH, quiet_noise, raw_throws, read_throws, read_truth, regress
from studies.throws.diagnosis import SPREAD, device_candidates
from studies.throws.joint import Throw, losses, maximise_jointly
from studies.throws.model import STEP, extended, is_fitted, manoeuvres, rigid
from studies.throws.raw import Timing
from studies.throws.rotor import ORDERS, lines_of, loudest_orders, near, pole_pairs, speed_ratio
from tests.simulated_throws import ACCEL_NOISE, COM, INERTIA, MASS, RATE_NOISE, write_throws

RATES = np.array([[11.0, -9.0, 4.0], [-7.0, 12.0, 8.0], [15.0, 5.0, -9.0], [6.0, -14.0, 7.0]])


def diagnosed(folder, seed, count=2, **hidden):
    rng = np.random.default_rng(seed)
    rates = np.concatenate([RATES[:count], rng.normal(scale=10.0, size=(40, 3))])  # further ones tell the noise
    write_throws(folder, "body", rates, rng, **hidden)
    recordings = read_throws(folder, "body", Timing())
    model = rigid(regress(recordings, MASS), SPREAD, recordings)
    return diagnose(
        model, manoeuvres(model, recordings[:count]), 1, effects=device_candidates(model, records_wheels=True)
    )


@pytest.mark.slow
def test_samples_are_independent_and_their_noise_is_measured(tmp_path):
    write_throws(tmp_path, "body", np.zeros((32, 3)), np.random.default_rng(3))
    recordings = read_throws(tmp_path, "body", Timing(fast=1e9))
    # the body is at rest about x until the wheel runs up, so that all that is read there is noise
    noise = np.array([recording.vector("rate")[1][:8, 0] for recording in recordings])
    noise = noise - noise.mean(axis=1, keepdims=True)
    correlation = (noise[:, 1:] * noise[:, :-1]).mean() / (noise**2).mean()
    assert abs(correlation) < 0.25  # 0.78 before samples were independent
    for sensor, raw in (("rate", RATE_NOISE), ("accel", ACCEL_NOISE)):
        expected = raw * np.sqrt(27.0 / (16.0 * 2.0 * np.sqrt(np.pi)) / (4030.0 * SMOOTH))
        np.testing.assert_allclose(quiet_noise(recordings, sensor), expected, rtol=0.2)


def test_a_new_body_needs_its_mass_and_its_files(tmp_path):
    moments = np.diag([2e-4, 4e-4, 5e-4]).tolist()
    content = {
        "device": {"mass": 0.1},
        "proof_body": {"mass": 0.3, "I_com": moments},
        "bodies": {"new": {"mass": 0.2, "I_com_grid": moments}},
    }
    (tmp_path / "truth.json").write_text(json.dumps(content), encoding="utf-8")
    write_throws(tmp_path, "new", RATES[:1], np.random.default_rng(5))
    truth = read_truth(tmp_path)
    assert truth.objects == ("new",)
    recordings = read_throws(tmp_path, "new", Timing())
    model = extended(regress(recordings, truth.thrown_mass("new")), recordings, Timing().duration)
    assert model.priors[0].centre.mass == pytest.approx(0.3)


def test_the_regression_needs_the_mass_alone(tmp_path):
    write_throws(tmp_path, "body", RATES[:2], np.random.default_rng(4))
    found = regress(read_throws(tmp_path, "body", Timing()), MASS)
    np.testing.assert_allclose(np.linalg.eigvalsh(found.inertia), np.linalg.eigvalsh(INERTIA), rtol=0.03)
    np.testing.assert_allclose(found.com, COM, atol=0.001)


@pytest.mark.parametrize(("pairs", "ratio"), [(7, Fraction(1)), (6, Fraction(6, 7)), (8, Fraction(8, 7))])
def test_a_wrong_number_of_pole_pairs_is_found_from_the_line_of_the_imbalance(tmp_path, pairs, ratio):
    write_throws(tmp_path, "body", RATES[:3], np.random.default_rng(6), shake=0.5)
    timing = Timing(pole_pairs=pairs)
    amplitudes = np.abs(np.stack([lines_of(raw, timing, ORDERS) for raw in raw_throws(tmp_path, "body")]))
    orders = loudest_orders(amplitudes)
    assert near(orders, float(ratio)) == 3
    assert speed_ratio(orders, timing) == ratio
    assert pole_pairs(orders, timing) == 7


def test_a_balanced_wheel_has_no_line(tmp_path):
    write_throws(tmp_path, "body", RATES[:1], np.random.default_rng(6))
    (raw,) = raw_throws(tmp_path, "body")
    amplitudes = np.abs(lines_of(raw, Timing(), ORDERS)[:, 3])
    assert amplitudes.max() < 10.0 * np.median(amplitudes)


def evidence(joint):
    """Log evidence of a joint fit by Laplace's approximation, its noise's constant apart."""
    return joint.evidence.sum() - 0.5 * joint.value @ joint.value + 0.5 * np.linalg.slogdet(joint.covariance)[1]


@pytest.mark.slow
def test_throws_left_out_confirm_drag_and_contradict_a_delay(tmp_path):
    write_throws(tmp_path, "body", RATES, np.random.default_rng(7), drag=(4e-5, 4e-5, 4e-5))
    recordings = read_throws(tmp_path, "body", Timing())
    model = extended(regress(recordings, MASS), recordings, Timing().duration)
    posteriors = [Posterior.of(model, manoeuvres(model, [recording]), step=STEP) for recording in recordings]
    throws = [Throw("body", one, one.starting_point(), np.ones(one.size), np.ones(6)) for one in posteriors]
    joint = maximise_jointly(throws)
    scores = joint.left_out_scores()
    for index, score in enumerate(scores):
        others = maximise_jointly([throw for i, throw in enumerate(joint.throws) if i != index])
        assert score == pytest.approx(evidence(joint) - evidence(others), abs=0.5)
    assert losses(joint, "air-drag", is_fitted).sum() > 5.0
    assert losses(joint, "wheel-delay", is_fitted).sum() < 2.0


@pytest.mark.slow
def test_nothing_is_named_in_perfect_throws(tmp_path):
    """The alarm may sound: quiet intervals give the noise of a sample every 10 ms to some 10 to 20 % only."""
    found = diagnosed(tmp_path, 0)
    assert found.verdict.causes == ()
    assert found.probabilities.sets[0].names == ()
    assert 0.85 < found.gain.before.chi2_per_sample < 1.15


@pytest.mark.slow
def test_a_known_error_of_the_wheel_is_named(tmp_path):
    found = diagnosed(tmp_path, 0, tilt=(0.03, -0.02))
    assert found.verdict.status is Status.EXPLAINED
    assert found.verdict.causes == ("wheel-tilt",)
