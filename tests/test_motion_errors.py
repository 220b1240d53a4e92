"""Errors and torques that nobody listed and that follow the motion: encoders, sensors and a drag."""

import numpy as np
import pytest

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import Status, diagnose
from bayesid.diagnosis.candidates import motion_errors
from bayesid.diagnosis.candidates.motion_errors import HARMONIC, JOINT, RATE_TORQUE, Series, motion_signatures
from bayesid.diagnosis.outcome.joint_error import JointError
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.inference.posterior import Posterior
from bayesid.report import figures
from studies.truth import hidden_causes
from studies.truth.hidden_causes.further import FURTHER_CASES

OUTSIDE = {case.name: case for case in (*hidden_causes.CASES, *FURTHER_CASES) if case.status == "unknown"}
SEED = 301275


def posteriors(folder, name, strength):
    """The posterior of recordings without an effect, and of the same with it: motion of the joints and noise agree."""
    found = []
    for hidden in (0.0, strength):
        study = Study.load(OUTSIDE[name].make(folder / str(hidden), SEED, hidden))
        model = load_model(study)
        found.append(Posterior.of(model, load_manoeuvres(study, model.robot)))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "group", "strength", "share"),
    [
        ("eccentric-encoder", f"{JOINT}, joint2", 0.2, 0.004),
        ("curved-gyro", "motion-dependent error of rate by its reading", 1.0, 0.02),
        ("curved-accelerometer", "motion-dependent error of accel by its reading", 1.0, 0.02),
        ("g-sensitive-gyro", "motion-dependent error of rate by accel", 1.0, 0.02),
        ("quadratic-drag", RATE_TORQUE, 0.01, 0.02),
    ],
)
def test_the_bank_holds_what_mujoco_and_its_sensors_change(name, group, strength, share, tmp_path):
    """Of the change of the whole residual, nothing but so small a share is left."""
    right, wrong = posteriors(tmp_path, name, strength)
    perturbed = PerturbedModel(right)
    fit = perturbed.fit()
    bank = motion_signatures(perturbed, fit, 1000.0, 1.0)
    columns = next(item.columns for item in bank.signatures if item.name == group)
    change = np.ravel(wrong.residuals(fit.z) - right.residuals(fit.z))
    amplitudes, *_ = np.linalg.lstsq(columns / np.abs(columns).max(axis=0), change)
    left = change - columns / np.abs(columns).max(axis=0) @ amplitudes
    assert np.linalg.norm(left) < share * np.linalg.norm(change)


@pytest.mark.slow
def test_the_error_of_an_encoder_is_found_as_it_is(tmp_path):
    """The smoothed records of the joint differ by what the amplitudes say."""
    right, wrong = posteriors(tmp_path, "eccentric-encoder", 0.2)
    perturbed = PerturbedModel(right)
    fit = perturbed.fit()
    columns = next(item.columns for item in motion_errors._joints(perturbed, fit).signatures if "joint2" in item.name)
    amplitudes, *_ = np.linalg.lstsq(columns, np.ravel(wrong.residuals(fit.z) - right.residuals(fit.z)))

    def positions(of, seconds, count):
        times = np.linspace(0.0, seconds, count)
        return np.concatenate([item.motion.evaluate(times).position[:, 1] for item in of.manoeuvres])

    before, after = (positions(of, 100.0, 50) for of in (right, wrong))
    found = Series.over(positions(right, 150.0, 4000), HARMONIC).derivatives(before)[0] @ amplitudes
    np.testing.assert_allclose(found, after - before, atol=0.01 * np.abs(after - before).max())


def test_a_series_holds_the_harmonics_of_a_turn():
    """Sine and cosine of the fourth harmonic over half a turn, and their derivatives."""
    angles = np.linspace(0.2, 0.2 + np.pi, 200)
    value, first, second = Series.over(angles, HARMONIC).derivatives(angles)
    for phase in (0.0, 0.5 * np.pi):
        amplitudes, *_ = np.linalg.lstsq(value, np.sin(HARMONIC * angles + phase))
        for columns, order in ((value, 0), (first, 1), (second, 2)):
            true = HARMONIC**order * np.sin(HARMONIC * angles + phase + 0.5 * np.pi * order)
            np.testing.assert_allclose(columns @ amplitudes, true, atol=0.1 * HARMONIC**order)


def test_the_error_of_a_joint_is_drawn_over_its_position():
    positions = np.linspace(-0.5, 1.0, 20)
    error = JointError("joint2", "rad", positions, 2e-3 * np.sin(2.0 * positions), np.full(20, 1e-4))
    (axes,) = figures.joint_error_curve(error).axes
    assert axes.get_xlabel() == "recorded position of joint2 [rad]"
    assert axes.get_ylabel() == "error [$10^{-3}$ rad]"
    np.testing.assert_allclose(axes.lines[-1].get_ydata(), 2.0 * np.sin(2.0 * positions))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed", "strength", "candidate"),
    [
        ("eccentric-encoder", 301205, 0.384, JOINT),
        ("g-sensitive-gyro", 301046, 0.548, "motion-dependent error of rate"),
        ("curved-accelerometer", 301327, 0.454, "motion-dependent error of accel"),
        ("quadratic-drag", 301026, 0.609, RATE_TORQUE),
    ],
)
def test_what_follows_the_motion_is_unknown_and_not_misnamed(name, seed, strength, candidate, tmp_path):
    study = Study.load(OUTSIDE[name].make(tmp_path, seed, strength))
    model = load_model(study)
    result = diagnose(model, load_manoeuvres(study, model.robot), seed)
    assert result.verdict.status is Status.UNKNOWN
    assert result.probabilities.inclusion[candidate] > 0.9
    if candidate != JOINT:
        assert result.joint_error is None
        return
    phase = np.random.default_rng([seed, 2]).uniform(0.0, 2.0 * np.pi)
    error = result.joint_error
    true = 2e-3 * strength * np.sin(2.0 * error.positions + phase)
    assert error.joint == "joint2"
    assert (np.abs(error.errors - true) < 4.0 * error.deviations).all()
    assert error.deviations.max() < 0.2 * np.abs(true).max()
