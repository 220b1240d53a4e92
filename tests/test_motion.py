"""Joint motion: the excitation of (27), and recorded joints in the robot's order."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.recording.joint_motion import Excitation, MeasuredMotion, sample_joints
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from studies.truth.urdf import BRANCHED

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
        (("slide",), (), r"no position or velocity of joint slide"),
        ((), ("finger",), r"joint finger is not one of the robot's"),
        (("wrist", "hinge"), ("finger",), r"joint (wrist, hinge|hinge, wrist); joint finger is not"),
    ],
)
def test_joints_that_do_not_match_the_robot(drop, add, message):
    channels = {f"position.{name}": values for name, values in angles().items() if name not in drop}
    channels |= {f"position.{name}": np.zeros_like(TIME) for name in add}
    with pytest.raises(InputError, match=message) as caught:
        MeasuredMotion.from_recording(recording(channels), Robot.from_urdf(BRANCHED), sigma={0: 1e-6})
    assert "Record every moving joint of the robot" in str(caught.value)


def test_sample_joints_is_what_a_recording_holds():
    robot = Robot.shipped("planar")
    columns = sample_joints(EXCITATION, robot, TIME)
    assert list(columns) == ["position.joint1", "position.joint2"]
    np.testing.assert_array_equal(columns["position.joint2"], EXCITATION.evaluate(TIME).position[:, 1])
