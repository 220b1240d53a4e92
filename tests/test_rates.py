"""One flight recorded at 10 and at 1,000 Hz with noise per root hertz alike."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from bayesid._math.least_squares import levenberg_marquardt
from bayesid.diagnosis import Diagnosis, Status, diagnose
from bayesid.inference.encoder_noise import first_rate_sd
from bayesid.inference.posterior import Posterior
from bayesid.recording.blocks import BLOCKS_PER_SECOND
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth.hidden_causes import causes as hide
from studies.truth.hidden_causes.catalogue import Build, Case, hidden_case
from tests.conftest import PLANAR, POINT
from tests.hidden import diagnosed

pytestmark = pytest.mark.slow

END = 30.0
FINE = 1000.0  # rate of the fast recording; the noise of the slow one is the mean of its noise over 0.1 s [Hz]
DENSITY = 1e-5  # noise of the sensors per sample at 2 Hz
ENCODERS = 1e-6  # and of the encoders
BODIES = slice(0, 10)
FIRST_RATE = (0.01, -0.02, 0.015)


def flown(**hidden: Any) -> dict[str, np.ndarray]:
    """Return what sensors and encoders read without noise at the fine rate, by MuJoCo with something hidden."""
    motion = mj.smooth_motion(2, END, seed=11, amplitude=0.3, frequencies=(0.05, 0.08), ramp=8.0)
    time = np.arange(0.0, END + 0.001, 0.02)
    truth = mj.TruthModel(PLANAR, accel_position=POINT, **hidden).run(motion, time, rate0=FIRST_RATE, step=0.02)
    fine = np.arange(0.0, END, 1.0 / FINE)
    curves = {f"position.joint{index + 1}": truth.position[:, index] for index in range(2)}
    curves |= {f"rate.{axis}": truth.rate[:, index] for index, axis in enumerate("xyz")}
    curves |= {f"accel.{axis}": truth.accel[:, index] for index, axis in enumerate("xyz")}
    return {name: CubicSpline(time, values)(fine) for name, values in curves.items()}


class Fitted(NamedTuple):
    """Mode, Laplace's deviations (n,), rate of the base at time 0 and what the encoders leave open of it (3,)."""

    mode: np.ndarray
    sd: np.ndarray
    rate: np.ndarray
    rate_sd: np.ndarray


def study_at(
    readings: dict[str, np.ndarray], rate: float, blocks: float = BLOCKS_PER_SECOND
) -> tuple[Model, list[Manoeuvre]]:
    """Return the model and the recording at a rate, reduced to so many blocks a second."""
    rng, fine, noise = np.random.default_rng(3), np.arange(0.0, END, 1.0 / FINE), float(np.sqrt(rate / 2.0))
    count = round(FINE / rate)
    time, channels = fine.reshape(-1, count).mean(axis=1), {}
    for name, values in readings.items():
        level = np.sqrt(FINE / 2.0) * (ENCODERS if name.startswith("position") else DENSITY)
        error = (level * rng.normal(size=len(fine))).reshape(-1, count).mean(axis=1)
        channels[name] = np.interp(time, fine, values) + error
    recording = Recording("flight", None, time, channels)
    robot = Robot.from_urdf(PLANAR).perturbed("base_link", 0.1, np.random.default_rng(1))
    white = White(DENSITY * noise)
    sensors = (Sensor(SensorKind.RATE, white), Sensor(SensorKind.ACCEL, white, position=POINT))
    prior = BodyPrior("base_link", robot.link("base_link").inertial, 0.3)
    moved = MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODERS * noise}, blocks_per_second=blocks)
    return Model(robot, sensors, (prior,)), [Manoeuvre(recording, moved, blocks_per_second=blocks)]


def fitted(model: Model, manoeuvres: list[Manoeuvre]) -> Fitted:
    """Return what is learnt, by Laplace's approximation."""
    posterior = Posterior.of(model, manoeuvres)
    start = posterior.starting_point()
    mode = levenberg_marquardt(posterior.least_squares, posterior.jacobian, start, 1e-9, 200).x
    slopes = posterior.jacobian(mode)
    sd = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    first = np.asarray(posterior.unknowns.values_at(mode).rate)[0]
    unseen = first_rate_sd(model.robot, manoeuvres[0].motion)
    return Fitted(mode, sd, first, np.hypot(posterior.model.rate_sigma * sd[-3:], unseen))


def test_bodies_are_as_well_known_at_any_rate():
    readings = flown()
    slow, fast = (fitted(*study_at(readings, rate)) for rate in (10.0, FINE))
    assert (np.abs(fast.mode - slow.mode) / slow.sd)[BODIES].max() < 0.1
    np.testing.assert_allclose(fast.sd[BODIES], slow.sd[BODIES], rtol=0.005)
    # the rate at time 0 is no better known than the joints' speeds there, which fits take for true
    assert (np.abs(fast.rate - slow.rate) / slow.rate_sd).max() < 0.1
    for learnt in (slow, fast):
        assert (np.abs(learnt.rate - FIRST_RATE) / learnt.rate_sd).max() < 4.0


def test_blocks_know_what_all_samples_know():
    """Means over 0.1 s beside the likelihood of all 40 samples a second."""
    readings = flown()
    reduced, whole = (fitted(*study_at(readings, 40.0, blocks)) for blocks in (BLOCKS_PER_SECOND, 0.0))
    assert (np.abs(reduced.mode - whole.mode) / whole.sd)[BODIES].max() < 0.1
    np.testing.assert_allclose(reduced.sd[BODIES], whole.sd[BODIES], rtol=0.01)


LATE = 0.005  # delay of the gyro [s]
WHEEL = mj.Rotor((0.0, 0.006, 0.003), (0.1, 0.0, 0.0))
PANEL = mj.panel(0.5, (1.0, 0.4), (0.0, 0.5, 0.1), (1.0, 0.0, 0.2), 0.9)


def late_by(readings: dict[str, np.ndarray], delay: float) -> dict[str, np.ndarray]:
    """Return the readings with a gyro that shows the past [s]."""
    shift = np.maximum(np.arange(round(END * FINE)) - round(delay * FINE), 0)
    return {name: values[shift] if name.startswith("rate") else values for name, values in readings.items()}


def toned(readings: dict[str, np.ndarray], frequency: float) -> dict[str, np.ndarray]:
    """Return the readings with a vibration of the gyro's mount about x, ten times its noise at 10 Hz."""
    tone = 10.0 * DENSITY * np.sqrt(5.0) * np.sin(2.0 * np.pi * frequency * np.arange(round(END * FINE)) / FINE)
    return {**readings, "rate.x": readings["rate.x"] + tone}


def assert_same(one: Diagnosis, other: Diagnosis) -> None:
    assert (one.verdict.status, one.verdict.causes) == (other.verdict.status, other.verdict.causes)
    for name, probability in one.probabilities.inclusion.items():
        assert other.probabilities.inclusion[name] == pytest.approx(probability, abs=0.02), name


@pytest.mark.parametrize(
    ("hidden", "late", "tone"),
    [
        ({}, 0.0, 0.0),
        ({}, 0.0, 40.0),
        ({"rotor": WHEEL}, 0.0, 0.0),
        ({}, LATE, 0.0),
        ({"appendages": [PANEL]}, 0.0, 0.0),
        ({"flexible": [mj.Flexibility("joint2", 2.0)]}, 0.0, 0.0),
    ],
    ids=["nothing", "tone", "wheel", "late gyro", "panel at 0.9 Hz", "flexible joint"],
)
def test_a_verdict_is_the_same_at_any_rate(hidden, late, tone):
    readings = toned(late_by(flown(**hidden), late), tone)
    slow, fast = (diagnose(*study_at(readings, rate), 1) for rate in (10.0, FINE))
    assert bool(slow.verdict.causes) == bool(hidden or late)
    assert_same(slow, fast)


def test_a_verdict_on_blocks_is_that_on_all_samples():
    readings = flown(rotor=WHEEL)
    whole, reduced = (diagnose(*study_at(readings, 40.0, blocks), 1) for blocks in (0.0, BLOCKS_PER_SECOND))
    assert whole.verdict.causes
    assert_same(whole, reduced)


FAST_RATE = 60.0
LOUDER = float(np.sqrt(FAST_RATE / 2.0))  # noise per root hertz is that at 2 Hz
JITTERED = {
    **{f"{sensor}_period": 1.0 / FAST_RATE for sensor in ("rate", "accel", "encoder")},
    "rate_sigma": 1e-5 * LOUDER,
    "accel_sigma": 1e-5 * LOUDER,
    "encoder_sigma": 1e-6 * LOUDER,
    "jitter": 0.3,
}
TWO = {"count": 2, "duration": 70.0}


def jumping(draw: np.random.Generator, strength: float) -> hide.Options:
    """Mass that moves within the base by 0.3 m in a tenth of a second, once in each recording."""
    body = mj.Body(6.0, hide.direction(draw, 0.4), 0.01 * np.eye(3))
    starts = tuple((0.5 * draw.integers(40, 100, 2) + draw.uniform(0.05, 0.35, 2)).tolist())
    mover = mj.Mover(body, hide.triple(hide.direction(draw)), 0.3 * strength, starts[0], hide.JUMP, starts)
    return {"hidden": mj.Hidden(movers=[mover])}


def fast_case(name: str, *builds: Build, **options: Any) -> Case:
    """A case in jittered telemetry of 60 Hz."""
    return hidden_case(name, *builds, sensors=JITTERED, manoeuvres=TWO, latitudes=[0.4, 2.9], **options)


def test_a_mass_that_moves_is_named_in_fast_telemetry(tmp_path):
    """Gyro and accelerometer read thousands of standard deviations while it moves: the verdict was unknown."""
    result = diagnosed(fast_case("mass-shift", jumping).make(tmp_path, 2))
    assert result.verdict.status is Status.EXPLAINED
    assert result.verdict.causes == ("mass-shift",)


def test_play_is_named_in_fast_telemetry(tmp_path):
    """The encoder leaps in less than a tenth of a second; its leap was sought 0.1 s too early and five times too short.

    At both ends the joint of the truth creeps to the middle of its gap, which no mechanism of the effect does: whether
    something is left beside the play is open.
    """
    case = fast_case("joint-backlash:joint2", partial(hide.backlash, "joint2"), flown=0.05)
    result = diagnosed(case.make(tmp_path, 1))
    assert result.verdict.causes == ("joint-backlash:joint2",)
    assert result.cause_probability("joint-backlash:joint2") > 0.99
    (row,) = [row for row in result.to_dict()["candidates"] if row["name"] == "joint-backlash:joint2"]
    assert row["amplitude"]["gap"]["mean"] == pytest.approx(6e-4, rel=0.2)


def test_fast_telemetry_without_a_cause_is_adequate(tmp_path):
    assert (
        diagnosed(fast_case("null", status="adequate", flown=0.05).make(tmp_path, 1)).verdict.status is Status.ADEQUATE
    )
