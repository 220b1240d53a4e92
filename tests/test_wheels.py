"""Wheels as parts of the robot: their momentum against MuJoCo, what recordings hold of them, and bad input."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bayesid
from bayesid import BodyPrior, InertialParameters, InputError, Manoeuvre, Model, Recording, Robot, Wheel
from bayesid.app.demo_command import _copy_demonstration
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.recording.sampled_curve import SampledCurve
from bayesid.recording.wheel_motion import check_wheels
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth import wheels
from studies.truth.bodies import moving_joints

ARM = Path(__file__).resolve().parents[1] / "studies" / "truth" / "robots" / "servicer4.urdf"
POINT = (0.2, 0.3, -0.4)
RATE = np.array([0.004, -0.003, 0.005])


@pytest.mark.parametrize("arm", [pytest.param(True, marks=pytest.mark.slow), False], ids=["arm", "wheels alone"])
def test_the_momentum_of_recorded_wheels_agrees_with_rotors_in_mujoco(arm, tmp_path, formula_motion):
    """Rotors are bodies of MuJoCo; what is left is the interpolation of speeds that are sampled at 5 Hz."""
    urdf, mounted = ARM, wheels.pyramid(inertia=0.02)[:2]
    if not arm:
        urdf, mounted = tmp_path / "satellite.urdf", wheels.pyramid()[:3]
        urdf.write_text(wheels.URDF, encoding="utf-8")
    motion = mj.smooth_motion(len(moving_joints(urdf)), 60.0, seed=3, amplitude=0.6)
    courses = [wheels.Slews(size=30.0).course(np.random.default_rng(seed)) for seed in (1, 2, 3)[: len(mounted)]]
    true = [wheels.driven(wheel, wheels.Fault(), course) for wheel, course in zip(mounted, courses, strict=True)]
    model = mj.TruthModel(urdf, wheels=true, accel_position=POINT)
    truth = model.run(motion, np.arange(0.0, 30.01, 1.0), rate0=RATE, step=0.05)
    robot = Robot.from_urdf(urdf)
    robot = robot.with_inertial(robot.base, InertialParameters(*model.base))
    for wheel in mounted:
        robot = robot.with_wheel(Wheel(*wheel))
    sensors = Sensor(SensorKind.RATE, White(1e-9)), Sensor(SensorKind.ACCEL, White(1e-9), position=POINT)
    fine = np.arange(0.0, 30.01, 0.2)
    speeds = [np.array([course(time)[1] for time in fine]) for course in courses]
    channels = {f"wheel_speed.{wheel.name}": speed for wheel, speed in zip(mounted, speeds, strict=True)}
    for family, values in (("rate", truth.rate), ("accel", truth.accel)):
        for axis, column in zip("xyz", values.T, strict=True):
            channels[f"{family}.{axis}"] = np.full(len(fine), np.nan)
            channels[f"{family}.{axis}"][::5] = column
    recording = Recording("slew", None, fine, channels)
    described = Model(robot, sensors, (BodyPrior(robot.base, robot.link(robot.base).inertial, 0.1),))
    posterior = Posterior.of(described, [Manoeuvre(recording, formula_motion(motion, urdf, robot))], step=0.1)
    z = posterior.unknowns.coordinates([robot.link(robot.base).inertial], RATE[None])
    found = predicted_readings(posterior, z)[0]
    assert np.abs(found.channels[SensorKind.RATE] - truth.rate).max() < 1e-8
    accel = np.abs(found.channels[SensorKind.ACCEL] - truth.accel)
    assert accel[1:-1].max() < 1e-8
    assert accel.max() < 1e-6  # where the smoothed speeds begin and end
    # not because nothing happens
    assert np.abs(truth.rate - RATE).max() > 0.02
    assert np.abs(truth.accel).max() > 0.005


def test_wheels_are_recorded_by_speed_or_by_momentum_and_all_of_them():
    time = np.arange(10.0)
    speeds = {"wheel_speed.a": 0.0 * time, "wheel_speed.b": time}
    momentum = {f"wheel_momentum.{axis}": time for axis in "xyz"}
    with pytest.raises(InputError, match="recorded twice, by their speeds and by their momentum"):
        Recording("both", None, time, {**speeds, **momentum})
    wheel = Wheel("a", (0.0, 0.0, 1.0), 1e-3)
    with pytest.raises(InputError, match=r"no column wheel_speed.c; wheel 'b' is not one of \[\[robot.wheels\]\]"):
        check_wheels(Recording("other", None, time, speeds), [wheel, replace(wheel, name="c")])
    with pytest.raises(InputError, match="is 2, not 1"):
        Wheel("long", (0.0, 0.0, 2.0), 1e-3)


def test_a_sampled_curve_integrates_and_differentiates():
    curve = SampledCurve(np.array([1.0, 3.0]), np.array([[2.0], [6.0]]))
    at = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(curve.at(at)[:, 0], [2.0, 2.0, 4.0, 6.0, 6.0])
    np.testing.assert_allclose(curve.at(at, -1)[:, 0], [-2.0, 0.0, 3.0, 8.0, 14.0])
    np.testing.assert_allclose(curve.at(at, 1)[:, 0], [0.0, 2.0, 2.0, 2.0, 0.0])


def test_the_example_of_a_satellite_of_wheels_is_a_study(tmp_path):
    hidden = _copy_demonstration("wheels", tmp_path)
    study = Study.load(tmp_path / "study.toml")
    model = load_model(study)
    assert not model.robot.joints
    assert [wheel.name for wheel in model.robot.wheels] == ["wheel1", "wheel2", "wheel3", "wheel4"]
    assert list(hidden) == ["wheel-tilt:wheel2"]
    (recording, _) = (manoeuvre.recording for manoeuvre in load_manoeuvres(study, model.robot))
    assert recording.wheels == tuple(wheel.name for wheel in model.robot.wheels)
    with pytest.raises(InputError, match="no example 'legs'"):
        _copy_demonstration("legs", tmp_path)


@pytest.mark.slow
def test_slews_by_wheels_do_not_determine_the_mass(tmp_path):
    """Differential evolution of the whole posterior in log mass, centre of mass and inertia gives 1.63 +- 1.00."""
    _copy_demonstration("wheels", tmp_path)
    file = tmp_path / "study.toml"
    file.write_text(file.read_text() + '\n[model]\neffects = ["wheel-tilt:wheel2"]\n')
    result = bayesid.identify(file, 1, effective_samples=1000.0)
    assert result.evidence.trusted
    log_mass = np.log(result.posterior.unknowns.values_of(result.chains.flat).inertial[:, 0])
    assert log_mass.mean() == pytest.approx(1.63, abs=0.2)
    assert log_mass.std() == pytest.approx(1.00, rel=0.12)
