"""A sensor that the package lacks is one class and its registration: it simulates, identifies and is stored."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_model, load_posterior
from bayesid.diagnosis import diagnose
from bayesid.inference.mode import maximise
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import (
    blank_channels,
    noise_of,
    noisy,
    predicted_readings,
    simulate_recordings,
)
from bayesid.inference.recording_check import check_recording
from bayesid.recording.joint_motion import Excitation, MeasuredMotion, sample_joints
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient, SensorBias, create, known_effects
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Coloured, Instrument, Sensor, SensorKind, White
from tests.conftest import PLANAR

SUN = (0.6, 0.64, 0.48)
TIME = np.arange(0.0, 60.1, 0.5)

STEP = 0.25
"""Step of the integration [s]: where the ramps end, the jerk jumps, and longer steps cost accuracy."""


class SunDirection(SensorKind):
    """Direction of the Sun in the axes of a Sun sensor: a unit vector."""

    value, unit = "sun", "1"
    rest = (1.0, 0.0, 0.0)
    frame = "direction of the Sun, sensor axes"

    def read(self, sensed):
        return sensed.instant.to_base(sensed.instant.environment.sun)


class SecondGyro(SensorKind):
    """A gyro about two axes, recorded at times of its own."""

    value, unit = "gyro2", "rad/s"
    instrument = Instrument("second gyro", bias_sigma=2e-4)
    axes: ClassVar[tuple[str, ...]] = ("a", "b")
    rest: ClassVar[tuple[float, ...]] = (0.0, 0.0)
    size, mounted = 2, False
    frame = "angular velocity about base x and z"

    def read(self, sensed):
        return sensed.instant.rate[jnp.array([0, 2])]


@pytest.fixture(autouse=True, scope="module")
def _registered() -> Iterator[None]:
    """The kinds are known to this file alone."""
    before = dict(SensorKind._known)
    for kind in (SunDirection, SecondGyro):
        SensorKind.register(kind)
    yield
    SensorKind._known.clear()
    SensorKind._known.update(before)


@dataclass(frozen=True)
class TwoAxes:
    """White noise of two axes."""

    value: float

    def sigma(self, interval: float) -> np.ndarray:
        return np.full(2, self.value)


@pytest.fixture(scope="module")
def flown() -> tuple[Model, Posterior, np.ndarray]:
    """The planar robot with a Sun sensor, turned against the base, and the second gyro; recorded with noise."""
    robot = Robot.shipped("planar")
    sensors = (
        Sensor(SensorKind.of("sun"), White(1e-5), mounting=(0.0, 0.0, 0.6, 0.8)),
        Sensor(SensorKind.RATE, White(1e-5)),
        Sensor(SensorKind.of("gyro2"), TwoAxes(1e-6)),
    )
    prior = BodyPrior("base_link", robot.link("base_link").inertial, 0.3)
    model = Model(robot, sensors, (prior,), Orbit(6.9e6, sun=SUN), (GravityGradient(),))
    motion = Excitation(offset=[0.4, -0.3], amplitude=[0.3, 0.4], frequency=0.3, periods=1, ramp=15.0)
    channels = {**sample_joints(motion, robot, TIME), **blank_channels(sensors, len(TIME))}
    for name in ("gyro2.a", "gyro2.b"):
        channels[name] = np.where(np.arange(len(TIME)) % 3 == 1, channels[name], np.nan)
    blank = Posterior.of(model, [Manoeuvre(Recording("sunny", None, TIME, channels), motion)], step=STEP)
    z = np.random.default_rng(5).normal(size=blank.size) * 0.3
    z[blank.unknowns.layout.all_rates] = 0.05
    recording = simulate_recordings(blank, np.random.default_rng(6), z)[0]
    noise = np.random.default_rng(7)
    positions = [name for name in recording.channels if name.startswith("position.")]
    joints = {name: recording.channels[name] + 1e-6 * noise.normal(size=len(TIME)) for name in positions}
    recording = Recording("sunny", None, TIME, {**recording.channels, **joints})
    measured = MeasuredMotion.from_recording(recording, robot, sigma={0: 1e-6})
    return model, Posterior.of(model, [Manoeuvre(recording, measured)], step=STEP), z


@pytest.mark.slow
def test_it_reads_what_it_should(flown):
    """Against the geometry itself: the Sun turned into the base by the attitude, then into the sensor."""
    model, posterior, z = flown
    star = Sensor(SensorKind.ATTITUDE, White(1e-5))
    seen = Model(model.robot, (star, *model.sensors), model.priors, model.orbit, model.effects)
    channels = {**posterior.manoeuvres[0].recording.channels, **blank_channels((star,), len(TIME))}
    manoeuvre = Manoeuvre(Recording("sunny", None, TIME, channels), posterior.manoeuvres[0].motion)
    both = predicted_readings(Posterior.of(seen, [manoeuvre], step=STEP), z)[0]
    x, y, zz, w = both.attitude.T
    rows = [
        [1.0 - 2.0 * (y * y + zz * zz), 2.0 * (x * y - zz * w), 2.0 * (x * zz + y * w)],
        [2.0 * (x * y + zz * w), 1.0 - 2.0 * (x * x + zz * zz), 2.0 * (y * zz - x * w)],
        [2.0 * (x * zz - y * w), 2.0 * (y * zz + x * w), 1.0 - 2.0 * (x * x + y * y)],
    ]
    attitude = np.moveaxis(np.array(rows), -1, 0)
    sun = np.asarray(posterior.data.arrays.grid.sample.environment.sun)[0, : len(both.time)]
    in_base = np.einsum("tji,tj->ti", attitude, sun)
    np.testing.assert_allclose(both.sun, in_base @ model.sensors[0].rotation, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(both.sun, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(both.gyro2, both.rate[:, [0, 2]], atol=1e-15)
    assert np.ptp(both.sun, axis=0).max() > 0.1  # the base does turn


@pytest.mark.slow
def test_it_identifies(flown):
    _, posterior, z = flown
    assert posterior.model.channels.names == (
        "sun.x",
        "sun.y",
        "sun.z",
        "rate.x",
        "rate.y",
        "rate.z",
        "gyro2.a",
        "gyro2.b",
    )
    assert posterior.samples == 6 * len(TIME) + 2 * len(TIME[1::3])
    refined, optimum = maximise(posterior, np.random.default_rng(0))
    assert abs(optimum.chi2 - posterior.samples) < 5.0 * np.sqrt(2.0 * posterior.samples)
    own = posterior.unknowns.layout.all_bodies  # the rate is the one that goes with the smoothed joint speed at time 0
    miss = (optimum.z - z)[own]
    distance = float(miss @ np.linalg.solve(optimum.covariance[own, own], miss))
    assert distance < 10.0 + 5.0 * np.sqrt(20.0)
    assert refined.whitenings[0].outputs.shape[1] == 8


def test_its_encoder_noise_is_carried(flown):
    """A direction does not move with the joints' speed at an instant, but with their position, as the attitude does."""
    _, posterior, _ = flown
    assert relinearised(posterior, np.zeros(posterior.size)).samples == posterior.samples
    check = check_recording(posterior, 0)
    assert [sensor.kind.value for sensor in check.sensors] == ["sun", "rate", "gyro2"]


def test_other_recordings_and_noise_draws(flown):
    _, posterior, z = flown
    again = with_manoeuvres(posterior, posterior.manoeuvres)
    np.testing.assert_array_equal(again.residuals(z), posterior.residuals(z))
    predicted = predicted_readings(posterior, z)[0]
    drawn = noisy(posterior, 0, predicted, np.random.default_rng(1))
    off = drawn.gyro2 - predicted.gyro2
    assert 0.7e-6 < off.std() < 1.3e-6


def test_it_has_the_faults_of_all_sensors(flown):
    """Units follow from the sensor's, priors from its instruments; only a vector can be mounted wrongly."""
    expected = {
        "sun-bias": (("x", "y", "z"), "1", 0.03),
        "sun-drift": (("x", "y", "z"), "1/s", 0.03 / 60.0),
        "sun-scale": (("x", "y", "z"), "1", 0.03),
        "sun-misalignment": (("x", "y", "z"), "rad", 0.03),
        "sun-latency": (("delay",), "s", 0.2),
        "sun-clock": (("rate",), "1", 1e-3),
        "gyro2-bias": (("a", "b"), "rad/s", 2e-4),
        "gyro2-drift": (("a", "b"), "rad/s2", 2e-4 / 60.0),
        "gyro2-scale": (("a", "b"), "1", 0.03),
        "gyro2-latency": (("delay",), "s", 0.2),
        "gyro2-clock": (("rate",), "1", 1e-3),
    }
    faults = {name: kind for name, kind in known_effects().items() if name.partition("-")[0] in ("sun", "gyro2")}
    for name, fault in faults.items():
        (effect,) = fault.instances(flown[0])
        names, units, sigmas = zip(*((p.name, p.unit, p.sigma) for p in effect.parameters), strict=True)
        assert (names, set(units), set(sigmas)) == (names, {expected[name][1]}, {expected[name][2]})
        assert effect.parameters == create(name).parameters
    assert set(faults) == set(expected)
    assert faults["gyro2-bias"].summary == "The second gyro reads a constant value in addition to what it measures."
    assert "sun sensor" in faults["sun-clock"].summary


def test_its_faults_go_to_another_process_and_back():
    effect = SensorBias.of(SensorKind.of("gyro2"))((1e-3, 2e-3))
    again = pickle.loads(pickle.dumps(effect))
    assert (type(again), again.parameters) == (type(effect), effect.parameters)


@pytest.mark.slow
def test_its_hidden_fault_is_named(flown):
    model, posterior, _ = flown
    (manoeuvre,) = posterior.manoeuvres
    faults = [name for name in known_effects() if name.startswith("sun-")]
    effects = [create(name) for name in (*faults, "wheel-momentum")]
    scaled = {f"sun.{axis}": 1.02 * manoeuvre.recording.channels[f"sun.{axis}"] for axis in "xyz"}
    wrong = replace(manoeuvre.recording, channels={**manoeuvre.recording.channels, **scaled})
    diagnosis = diagnose(model, [replace(manoeuvre, recording=wrong)], effects=effects)
    assert diagnosis.verdict.causes == ("sun-scale",)


PLUGIN = """
from bayesid import SensorKind

@SensorKind.register
class MagneticField(SensorKind):
    value, unit = "field", "1"
    axes, rest, size, mounted = ("a", "b"), (0.0, 0.0), 2, False
    frame = "angular velocity about base x and z, in place of a field"

    def read(self, sensed):
        return sensed.instant.rate[::2]
"""

STUDY = """
title = "A sensor of one's own"
[robot]
urdf = "{urdf}"
[sensors.other.field]
sigma = {sigma}
decimate = 2
[sensors.encoder]
sigma = 1e-6
[[recordings]]
file = "one.csv"
attitude = [0.0, 0.0, 0.0, 1.0]
[unknowns]
bodies = ["base_link"]
[model]
effects = []
plugins = [{plugin}]
"""


def study_of(folder: Path, sigma: str = "[1e-5, 2e-5]", plugin: str = '"field.py"') -> Study:
    (folder / "field.py").write_text(PLUGIN)
    (folder / "study.toml").write_text(STUDY.format(urdf=PLANAR, sigma=sigma, plugin=plugin))
    return Study.load(folder / "study.toml")


def test_a_study_file_names_it_by_its_plugin(tmp_path, monkeypatch):
    monkeypatch.setattr(SensorKind, "_known", dict(SensorKind._known))
    with pytest.raises(InputError, match="unknown sensor 'field'") as unknown:
        load_posterior(study_of(tmp_path, plugin=""))
    assert unknown.value.place == "sensors.other.field"
    study = study_of(tmp_path)
    load_model(study)  # runs the plugin, which makes the columns known
    motion = Excitation(offset=[0.4, -0.3], amplitude=[0.3, 0.4], frequency=0.3, periods=1, ramp=15.0)
    channels = {**sample_joints(motion, Robot.shipped("planar"), TIME)}
    rng = np.random.default_rng(8)
    Recording("one", None, TIME, {**channels, **{f"field.{k}": 1e-5 * rng.normal(size=len(TIME)) for k in "ab"}}).write(
        tmp_path / "one.csv"
    )
    posterior = load_posterior(study)
    (sensor,) = posterior.model.sensors
    assert (sensor.kind.value, sensor.filter.decimate) == ("field", 2)
    np.testing.assert_array_equal(sensor.noise.sigma(0.5), [1e-5, 2e-5])
    assert posterior.samples == 2 * len(TIME[::2])


def test_the_noise_of_every_column_is_given(tmp_path, monkeypatch):
    monkeypatch.setattr(SensorKind, "_known", dict(SensorKind._known))
    with pytest.raises(InputError, match="got 3 numbers for 2 columns") as wrong:
        load_posterior(study_of(tmp_path, sigma="[1e-5, 1e-5, 1e-5]"))
    assert wrong.value.place == "sensors.other.field.sigma"


def test_two_kinds_of_one_name_are_an_error():
    class Impostor(SensorKind):
        value = "sun"

    with pytest.raises(InputError, match="two kinds of sensor are named 'sun'"):
        SensorKind.register(Impostor)


def test_coloured_noise_is_drawn_with_its_correlation():
    sensor = Sensor(SensorKind.RATE, White(1.0), coloured=Coloured((3.0, 0.0, 1.0), 4.0))
    time = np.arange(0.0, 20000.0, 1.0)
    noise = noise_of(sensor, time, np.zeros(3), np.random.default_rng(2))
    assert noise[:, 0].std() == pytest.approx(3.0, rel=0.05)
    assert not noise[:, 1].any()
    lag = (noise[4:, 0] * noise[:-4, 0]).mean() / noise[:, 0].var()
    assert lag == pytest.approx(np.exp(-1.0), abs=0.05)


def test_the_noise_of_an_attitude_is_a_small_rotation():
    kind, rng = SensorKind.ATTITUDE, np.random.default_rng(3)
    quaternion = rng.normal(size=(4000, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1)[:, None]
    noise = 1e-4 * rng.normal(size=(4000, 3))
    turned = kind.noisy(quaternion, noise)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1.0, atol=1e-14)
    pairs = zip(jnp.asarray(turned[:50]), jnp.asarray(quaternion[:50]), strict=True)
    back = np.array([kind.residual(new, old) for new, old in pairs])
    np.testing.assert_allclose(back, noise[:50], atol=1e-10)
