"""Errors of wheels: their effects against rotors in MuJoCo, and hidden ones that a diagnosis names."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bayesid import BodyPrior, InertialParameters, Manoeuvre, MeasuredMotion, Model, Recording, Robot, Wheel
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import diagnose
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.simulation.effects import WheelImbalance, WheelInertia, WheelLatency, WheelTilt
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth import wheels

POINT = (0.1, -0.05, 0.08)
RATE = np.array([0.01, -0.02, 0.015])
NAME = "wheel1"
STATIC, DYNAMIC = 1e-4, 2e-5


def flown(folder, fault: wheels.Fault, period: float, duration: float) -> SimpleNamespace:
    """A satellite with one faulty wheel of two in MuJoCo, the recording of it, and the robot as it is declared."""
    urdf = folder / "satellite.urdf"
    urdf.write_text(wheels.URDF, encoding="utf-8")
    mounted, rng = wheels.pyramid()[:2], np.random.default_rng(3)
    courses = [wheels.Slews().course(rng) for _ in mounted]

    def truth_of(faults: list[wheels.Fault]) -> mj.TruthModel:
        parts = zip(mounted, faults, courses, strict=True)
        return mj.TruthModel(urdf, wheels=[wheels.driven(*part) for part in parts], accel_position=POINT)

    times = np.arange(0.0, duration + 1e-9, period)
    truth = truth_of([fault, wheels.Fault()]).run(wheels.still, times, rate0=RATE, step=min(0.05, 0.1 * period))
    base = truth_of([wheels.Fault(), wheels.Fault()]).base
    robot = Robot.from_urdf(urdf).with_inertial("base_link", InertialParameters(*base))
    channels = {}
    for wheel, course, late in zip(mounted, courses, (fault.delay, 0.0), strict=True):
        robot = robot.with_wheel(Wheel(*wheel))
        channels[f"wheel_speed.{wheel.name}"] = np.array([course(time - late)[1] for time in times])
    for family, values in (("rate", truth.rate), ("accel", truth.accel)):
        channels |= {f"{family}.{axis}": column for axis, column in zip("xyz", values.T, strict=True)}
    return SimpleNamespace(robot=robot, truth=truth, recording=Recording("slew", None, times, channels), course=courses)


def errors(given: SimpleNamespace, effect=None, values=()) -> np.ndarray:
    """Largest errors of rate and accelerometer with an effect, a constant rate apart: the start knows no ripple."""
    sensors = Sensor(SensorKind.RATE, White(1e-7)), Sensor(SensorKind.ACCEL, White(1e-7), position=POINT)
    inertial = given.robot.link("base_link").inertial
    model = Model(given.robot, sensors, (BodyPrior("base_link", inertial, 0.1),))
    model = model if effect is None else model.extend(effect)
    motion = MeasuredMotion.from_recording(given.recording, given.robot)
    posterior = Posterior.of(model, [Manoeuvre(given.recording, motion, blocks_per_second=0.0)], step=0.05)
    z = np.array(posterior.unknowns.coordinates([inertial], RATE[None]))
    for parameters, value in [(model.effects[0].parameters, values)] if model.effects else []:
        z[-len(parameters) :] = [(x - p.mean) / p.sigma for x, p in zip(value, parameters, strict=True)]
    readings = predicted_readings(posterior, z)[0].channels
    rate, accel = readings[SensorKind.RATE] - given.truth.rate, readings[SensorKind.ACCEL] - given.truth.accel
    return np.array([np.abs(rate - rate.mean(axis=0))[2:-2].max(), np.abs(accel)[2:-2].max()])


@pytest.mark.slow
def test_factor_tilt_and_delay_of_a_wheel_agree_with_mujoco(tmp_path):
    """What is left of the first two is the error of the rotor at rest, which in truth is a part of the base."""
    factor = flown(tmp_path, wheels.Fault(inertia=1.1), 0.25, 20.0)
    assert (errors(factor, WheelInertia(NAME), [1.1]) < 5e-3 * errors(factor)).all()
    tilt = flown(tmp_path, wheels.Fault(tilt=(0.01, -0.02)), 0.25, 20.0)
    axis, *across = WheelTilt(NAME).attach(tilt.robot).frame
    true = Rotation.from_rotvec([0.01, -0.02, 0.0]).apply(axis)
    assert (errors(tilt, WheelTilt(NAME), [true @ across[0], true @ across[1]]) < 0.02 * errors(tilt)).all()
    late = flown(tmp_path, wheels.Fault(delay=0.1), 0.25, 20.0)
    assert (errors(late, WheelLatency(NAME), [0.1]) < 1e-3 * errors(late)).all()


@pytest.mark.slow
def test_the_force_of_an_imbalance_and_its_torque_agree_with_mujoco(tmp_path):
    """At 100 Hz with a wheel of 60 rad/s and more: what the base's own rotation changes of the line is left out."""
    given = flown(tmp_path, wheels.Fault(static=STATIC, dynamic=DYNAMIC), 0.01, 2.0)
    axis, *frame = np.array(WheelImbalance(NAME).attach(given.robot).frame)
    direction = wheels.off_axis(axis)
    angle = given.course[0](0.0)[0]  # of the wheel when its recorded speed begins
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    pairs = [turn @ (frame @ vector) for vector in (STATIC * direction, DYNAMIC * np.cross(axis, direction))]
    rate, accel = errors(given, WheelImbalance(NAME), np.concatenate(pairs)) / errors(given)
    assert accel < 2e-3
    assert rate < 0.2


FAST = wheels.Slews(count=1, duration=6.0, period=0.02, step=0.004, frequencies=(0.15, 0.4))
"""At 50 Hz, with speeds that change enough for the lines of the wheels to be different."""


def diagnosed(folder, slews: wheels.Slews, **faults: wheels.Fault):
    """The diagnosis of a satellite without an arm, some of whose wheels are not as declared."""
    made = wheels.write_slews(folder, np.random.default_rng(7), slews=slews, faults=faults, guess_spread=0.02)
    study = Study.load(made.file)
    model = load_model(study)
    return diagnose(model, load_manoeuvres(study, model.robot), 1)


@pytest.mark.slow
def test_an_imbalance_is_named_at_its_order(tmp_path):
    found = diagnosed(tmp_path, FAST, wheel1=wheels.Fault(static=1e-6, dynamic=5e-8))
    assert found.verdict.causes == ("wheel-imbalance:wheel1",)


@pytest.mark.slow
def test_a_speed_of_a_wrong_number_of_poles_is_named_with_its_ratio(tmp_path):
    """The recorded speed is 7/6 too large: the wheel has 6/7 of the momentum."""
    slews = replace(FAST, mean=40.0, size=25.0)
    found = diagnosed(tmp_path, slews, wheel1=wheels.Fault(static=2e-6, dynamic=1e-7, scale=7.0 / 6.0))
    assert {"wheel-inertia:wheel1", "wheel-imbalance:wheel1"} <= set(found.verdict.causes)
    rows = {row["name"]: row["amplitude"] for row in found.to_dict()["candidates"]}
    assert rows["wheel-inertia:wheel1"]["factor"]["mean"] == pytest.approx(6.0 / 7.0, abs=1e-3)
    (imbalance,) = (effect for effect in found.after.fit.effects if effect.label == "wheel-imbalance:wheel1")
    assert imbalance.order == pytest.approx(6.0 / 7.0, abs=1e-3)
