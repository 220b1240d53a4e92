"""Joint motion: the excitation of (27), and recorded joints in the robot's order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.inference.data import RecordedSamples
from bayesid.recording.joint_motion import Excitation, MeasuredMotion, sample_joints
from bayesid.recording.plausibility import refuse_impossible_motion
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre
from studies.truth.bodies import BRANCHED
from tests.conftest import PLANAR

EXCITATION = Excitation([0.3, -0.5], [0.6, 0.2], 0.25, periods=2, ramp=10.0, start=[0.1, 0.0])


# excitation -----------------------------------------------------------------------------------------------------------


def test_the_middle_is_equation_27():
    period = 2.0 * np.pi / 0.25
    assert EXCITATION.duration == pytest.approx(20.0 + 2.0 * period)
    time = np.linspace(10.0, 10.0 + 2.0 * period, 50)
    state = EXCITATION.evaluate(time)
    expected = np.array([0.3, -0.5]) + np.array([0.6, 0.2]) * np.cos(0.25 * (time - 10.0))[:, None]
    np.testing.assert_allclose(state.position, expected, atol=1e-13)


def test_it_starts_and_ends_at_rest_in_the_given_position():
    state = EXCITATION.evaluate([0.0, EXCITATION.duration])
    np.testing.assert_allclose(state.position, [[0.1, 0.0], [0.1, 0.0]], atol=1e-12)
    np.testing.assert_allclose(state.velocity, 0.0, atol=1e-12)
    np.testing.assert_allclose(state.acceleration, 0.0, atol=1e-12)
    beyond = EXCITATION.evaluate([-5.0, EXCITATION.duration + 5.0])
    np.testing.assert_allclose(beyond.position, state.position, atol=1e-12)


def test_position_velocity_and_acceleration_are_continuous_where_pieces_meet():
    """A jump of the third derivative j leaves j x 2e-6 between the sides; all j here are below 0.1 rad/s3."""
    for join in (10.0, EXCITATION.duration - 10.0):
        before, after = EXCITATION.evaluate([join - 1e-6]), EXCITATION.evaluate([join + 1e-6])
        for left, right in zip(before, after, strict=True):
            np.testing.assert_allclose(left, right, atol=1e-6)


def test_derivatives_are_those_of_the_position():
    """Central differences with h = 1e-3 s: error h^2 / 6 x third derivative, below 1e-7 here."""
    time, h = np.linspace(0.5, EXCITATION.duration - 0.5, 101), 1e-3
    time = time[np.abs(time - 10.0) > 2 * h]
    middle, late, early = (EXCITATION.evaluate(time + shift) for shift in (0.0, h, -h))
    np.testing.assert_allclose((late.position - early.position) / (2 * h), middle.velocity, atol=1e-7)
    np.testing.assert_allclose((late.velocity - early.velocity) / (2 * h), middle.acceleration, atol=1e-6)


def test_start_is_zero_where_left_out():
    assert not Excitation([0.3], [0.6], 0.25).evaluate([0.0]).position.any()


# measured motion ------------------------------------------------------------------------------------------------------

TIME = np.arange(0.0, 30.0, 0.5)


def recording(channels: dict[str, np.ndarray]) -> Recording:
    return Recording("test", None, TIME, channels)


def angles() -> dict[str, np.ndarray]:
    """A different sine for every joint of the branched robot."""
    robot = Robot.from_urdf(BRANCHED)
    return {joint.name: 0.3 * np.sin(0.3 * TIME + index) for index, joint in enumerate(robot.joints)}


def test_joints_are_in_the_robots_order_whatever_the_columns_are():
    robot = Robot.from_urdf(BRANCHED)
    channels = {f"position.{name}": values for name, values in reversed(angles().items())}
    motion = MeasuredMotion.from_recording(recording(channels), robot, sigma={0: 1e-6})
    assert motion.names == tuple(joint.name for joint in robot.joints)
    state = motion.evaluate(TIME[5:-5])
    for index in range(len(robot.joints)):
        # a spline through samples of 1e-6 rad every 0.5 s: positions to a few sigma, derivatives accordingly
        np.testing.assert_allclose(state.position[:, index], 0.3 * np.sin(0.3 * TIME + index)[5:-5], atol=5e-6)
        np.testing.assert_allclose(state.velocity[:, index], 0.09 * np.cos(0.3 * TIME + index)[5:-5], atol=2e-5)


def test_a_joint_known_by_its_speed_starts_where_the_study_says():
    robot = Robot.shipped("planar")
    channels = {"position.joint1": 0.3 * np.sin(0.3 * TIME), "velocity.joint2": 0.1 * np.cos(0.2 * TIME)}
    given = recording(channels)
    for start in (0.0, 0.8):
        motion = MeasuredMotion.from_recording(given, robot, sigma={0: 1e-6, 1: 1e-6}, start={"joint2": start})
        position = motion.evaluate(TIME).position
        np.testing.assert_allclose(position[:, 1], start + 0.5 * np.sin(0.2 * TIME), atol=2e-5)
        np.testing.assert_allclose(position[:, 0], 0.3 * np.sin(0.3 * TIME), atol=5e-6)
    left_out = MeasuredMotion.from_recording(given, robot, sigma={0: 1e-6, 1: 1e-6})
    assert left_out.evaluate(np.zeros(1)).position[0, 1] == pytest.approx(0.0, abs=1e-8)


def test_sigma_may_be_given_by_joint():
    robot = Robot.shipped("planar")
    channels = {f"position.joint{k}": 0.3 * np.sin(0.3 * TIME + k) for k in (1, 2)}
    motion = MeasuredMotion.from_recording(recording(channels), robot, sigma={0: {"joint1": 1e-6, "joint2": 1e-4}})
    assert [joint.sigmas for joint in motion.joints] == [(1e-6,), (1e-4,)]


def test_lag_covariance_stacks_the_joints():
    robot = Robot.shipped("planar")
    channels = {f"position.joint{k}": 0.3 * np.sin(0.3 * TIME + k) for k in (1, 2)}
    motion = MeasuredMotion.from_recording(recording(channels), robot, sigma={0: {"joint1": 1e-6, "joint2": 1e-4}})
    covariance = motion.lag_covariance(TIME, 3)
    assert covariance.shape == (2, 4, len(TIME), 3, 3)
    for index, joint in enumerate(motion.joints):
        np.testing.assert_array_equal(covariance[index], joint.lag_covariance(TIME, 3))
    # noisier samples, wider posterior
    assert (covariance[1, 0, :, 1, 1] > covariance[0, 0, :, 1, 1]).all()


@pytest.mark.parametrize(
    ("drop", "add", "message"),
    [
        (("slide",), (), r"no position or velocity for joint slide"),
        ((), ("finger",), r"joint finger is not a joint of the robot"),
        (("wrist", "hinge"), ("finger",), r"joint (wrist, hinge|hinge, wrist); joint finger is not"),
    ],
)
def test_joints_that_do_not_match_the_robot(drop, add, message):
    channels = {f"position.{name}": values for name, values in angles().items() if name not in drop}
    channels |= {f"position.{name}": np.zeros_like(TIME) for name in add}
    with pytest.raises(InputError, match=message) as caught:
        MeasuredMotion.from_recording(recording(channels), Robot.from_urdf(BRANCHED), sigma={0: 1e-6})
    assert "Record exactly the robot's moving joints" in str(caught.value)


# impossible motion ----------------------------------------------------------------------------------------------------

OFTEN = np.arange(0.0, 60.0, 0.01)
SLOW = 0.3 * np.sin(0.1 * OFTEN)


@pytest.fixture
def slow_arm(tmp_path) -> Robot:
    """The planar robot with joints of at most 0.05 rad/s."""
    text = PLANAR.read_text(encoding="utf-8")
    assert text.count('velocity="1"') == 2
    (tmp_path / "slow.urdf").write_text(text.replace('velocity="1"', 'velocity="0.05"'), encoding="utf-8")
    return Robot.from_urdf(tmp_path / "slow.urdf")


@pytest.mark.parametrize(
    "read",
    [
        lambda q: q + 1e-3 * np.random.default_rng(0).normal(size=q.shape),
        lambda q: 1e-3 * np.round(q / 1e-3),
    ],
    ids=["noise", "steps"],
)
def test_a_coarse_encoder_is_not_taken_for_an_impossible_speed(read, slow_arm):
    channels = {"position.joint1": read(SLOW), "position.joint2": read(0.5 * SLOW)}
    refuse_impossible_motion(Recording("coarse", None, OFTEN, channels), slow_arm)


@pytest.mark.parametrize(
    "spoilt", [np.degrees(0.03 * np.sin(0.3 * OFTEN)), SLOW + (OFTEN == 30.0)], ids=["degrees", "spike"]
)
def test_an_impossible_speed_is_seen_however_often_the_encoder_is_read(spoilt, slow_arm):
    channels = {"position.joint1": SLOW, "position.joint2": spoilt}
    with pytest.raises(InputError, match=r"column position.joint2: the joint moves at [\d.]+ rad/s .* radians"):
        refuse_impossible_motion(Recording("fast", None, OFTEN, channels), slow_arm)


def test_a_base_does_not_whirl_but_a_reading_may_be_garbled(slow_arm):
    rate = 2e-3 * np.sin(0.1 * OFTEN)
    rates = {"rate.x": rate, "rate.y": rate + 1e6 * (OFTEN == 30.0), "rate.z": rate}
    channels = {"position.joint1": SLOW, "position.joint2": SLOW, **rates}
    refuse_impossible_motion(Recording("garbled", None, OFTEN, channels), slow_arm)
    channels["rate.y"] = np.degrees(rate) * 3600.0
    with pytest.raises(InputError, match=r"column rate.y: half of the readings exceed \d+ rad/s.*arcseconds"):
        refuse_impossible_motion(Recording("arcseconds", None, OFTEN, channels), slow_arm)


# the extent of a motion ----------------------------------------------------------------------------------------------


def kept(values: np.ndarray, first: float, last: float) -> np.ndarray:
    """The samples from a time to another."""
    return np.where((first <= TIME) & (last >= TIME), values, np.nan)


EXTENTS = {
    "whole": (lambda q: q, 29.5, True),
    "three intervals short": (lambda q: kept(q, 1.5, 28.0), 29.5, True),
    "gap": (lambda q: np.where((TIME > 5.0) & (TIME < 20.0), np.nan, q), 29.5, True),
    "constant": (lambda q: kept(0.4 + 0.0 * q, 5.0, 15.0), 29.5, True),
    "ends early": (lambda q: kept(q, 0.0, 20.0), 22.0, False),
    "ends early, as the sensors do": (lambda q: kept(q, 0.0, 20.0), 21.5, True),
    "begins late": (lambda q: kept(q, 2.0, 29.5), 29.5, False),
}


@pytest.mark.parametrize(("change", "end", "allowed"), EXTENTS.values(), ids=EXTENTS)
def test_a_motion_is_extended_by_a_few_samples_at_most(change, end, allowed):
    channels = {"position.joint1": 0.3 * np.sin(0.3 * TIME), "position.joint2": change(0.3 * np.sin(0.3 * TIME))}
    motion = MeasuredMotion.from_recording(recording(channels), Robot.shipped("planar"), sigma={0: 1e-6})
    if allowed:
        motion.check_extent(end, "test")
        return
    with pytest.raises(InputError, match=r"test: joint 'joint2': its samples cover [02] s to [\d.]+ s") as caught:
        motion.check_extent(end, "test")
    assert f"needed from 0 s to {end:g} s" in caught.value.problem


def test_a_recording_whose_joints_end_long_before_its_sensors_is_refused(planar_case, noisy):
    given = noisy(np.random.default_rng(0))
    short = np.where(given.time > 30.0, np.nan, given.channels["position.joint2"])
    cut = replace(given, channels={**given.channels, "position.joint2": short})
    model = planar_case.posterior.model
    manoeuvre = Manoeuvre(cut, MeasuredMotion.from_recording(cut, model.robot, sigma={0: 1e-6}))
    with pytest.raises(InputError, match=r"planar: joint 'joint2': its samples cover 0 s to 30 s"):
        RecordedSamples.of(model, manoeuvre)


def test_sample_joints_is_what_a_recording_holds():
    robot = Robot.shipped("planar")
    columns = sample_joints(EXCITATION, robot, TIME)
    assert list(columns) == ["position.joint1", "position.joint2"]
    np.testing.assert_array_equal(columns["position.joint2"], EXCITATION.evaluate(TIME).position[:, 1])
