"""What a check sees in recordings: late sensors, wrong noise, still joints, gaps, a rate that is no second sensor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bayesid import (
    BodyPrior,
    Excitation,
    Manoeuvre,
    MeasuredMotion,
    Model,
    Posterior,
    Recording,
    Robot,
    Sensor,
    SensorKind,
    White,
)
from bayesid.inference.predicted_readings import simulate_manoeuvre
from bayesid.inference.recording_check import check_recording
from bayesid.report.figures import channel_spectra

SIGMA = 1e-5
TIME = np.arange(0.0, 140.01, 0.5)  # at rest from 100 s


@pytest.fixture(scope="module")
def model() -> Model:
    robot = Robot.shipped("planar")
    sensors = (
        Sensor(SensorKind.RATE, White(SIGMA)),
        Sensor(SensorKind.ACCEL, White(SIGMA), position=(0.1, -0.2, 0.3)),
        Sensor(SensorKind.ATTITUDE, White(SIGMA)),
    )
    return Model(robot, sensors, (BodyPrior("base_link", robot.link("base_link").inertial, 1.0),))


@pytest.fixture(scope="module")
def recording(model: Model) -> Recording:
    motion = Excitation([0.3, -0.5], [0.2, 0.3], 2.0 * np.pi / 25.0, periods=2, ramp=25.0)
    return simulate_manoeuvre(model, motion, TIME, rng=np.random.default_rng(1), encoder_sigma=1e-6)


def check(model: Model, recording: Recording):
    motion = MeasuredMotion.from_recording(recording, model.robot, sigma={0: 1e-6})
    return check_recording(Posterior.of(model, [Manoeuvre(recording, motion)], step=0.5), 0)


def changed(recording: Recording, **channels: np.ndarray) -> Recording:
    names = {key.replace("__", "."): value for key, value in channels.items()}
    return Recording(recording.name, None, recording.time, {**recording.channels, **names})


@pytest.mark.slow
def test_a_clean_recording_gives_no_warning(model: Model, recording: Recording) -> None:
    found = check(model, recording)
    assert found.warnings == ()
    rate = found.sensors[0]
    np.testing.assert_allclose(rate.measured_sigma, SIGMA, rtol=0.3)
    assert abs(rate.delay[0]) < 4.0 * rate.delay[1]


@pytest.mark.slow
def test_a_late_rate_sensor_is_noticed(model: Model, recording: Recording) -> None:
    late = {f"rate__{axis}": np.interp(TIME - 0.3, TIME, recording.channels[f"rate.{axis}"]) for axis in "xyz"}
    rate = check(model, changed(recording, **late)).sensors[0]
    assert rate.delay[0] == pytest.approx(0.3, abs=0.06)


def test_an_understated_noise_is_noticed(model: Model, recording: Recording) -> None:
    quiet = replace(model, sensors=(Sensor(SensorKind.RATE, White(0.3 * SIGMA)), *model.sensors[1:]))
    assert any("noise of rate" in warning for warning in check(quiet, recording).warnings)


def test_a_still_joint_and_a_gap_are_noticed(model: Model, recording: Recording) -> None:
    still = np.full(len(TIME), 0.2) + 1e-6 * np.random.default_rng(2).normal(size=len(TIME))
    hole = {
        f"accel__{axis}": np.where((TIME > 40.0) & (TIME < 50.0), np.nan, recording.channels[f"accel.{axis}"])
        for axis in "xyz"
    }
    warnings = check(model, changed(recording, position__joint2=still, **hole)).warnings
    assert any("joint2 moves" in warning for warning in warnings)
    assert any("accel has a gap" in warning for warning in warnings)


def test_a_rate_differenced_from_the_attitude_is_noticed(model: Model, recording: Recording) -> None:
    quaternion = np.stack([recording.channels[f"attitude.{axis}"] for axis in "xyzw"], axis=1)
    turned = Rotation.from_quat(quaternion)
    rate = (turned[:-1].inv() * turned[1:]).as_rotvec() / 0.5
    rate = np.concatenate([rate[:1], rate])
    copied = {f"rate__{axis}": rate[:, index] for index, axis in enumerate("xyz")}
    assert check(model, changed(recording, **copied)).rate_is_differenced
    assert not check(model, recording).rate_is_differenced


def test_a_stuck_axis_and_a_sensor_that_is_not_declared_are_noticed(model: Model, recording: Recording) -> None:
    alone = replace(model, sensors=model.sensors[:1])
    warnings = check(alone, changed(recording, rate__z=np.full(len(TIME), 2e-4))).warnings
    assert "Column rate.z never changes: it is stuck." in warnings
    assert "accel is recorded, but not declared under [sensors]: it is not used." in warnings
    assert "attitude is recorded, but not declared under [sensors]: it is not used." in warnings
    assert not any("position" in warning or "time" in warning.split(".")[0] for warning in warnings)


def test_paths_of_the_repository_hold_no_measurements() -> None:
    """The measured throws may not be redistributed."""
    root = Path(__file__).parents[1]
    names = {
        item.name for folder in ("bayesid", "studies", "tests", "reports") for item in (root / folder).rglob("*.csv")
    }
    assert not {name for name in names if "LOG" in name}


def test_the_frequencies_of_a_wheel_are_shaded_where_spectra_have_them(model: Model, recording: Recording) -> None:
    spectra = check(model, recording).spectra
    last = float(spectra[0].frequency[-1])
    for rotation, shaded in (((0.3 * last, 2.0 * last), 1), ((3.0 * last, 4.0 * last), 0)):
        for axes in channel_spectra(spectra, [rotation]).axes:
            assert len(axes.patches) == shaded
