"""Angles of endless joints are unwrapped, single garbled readings named as such, and whole columns by their unit."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.recording.plausibility import refuse_impossible_motion, unwrapped, whirling_rate
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from studies.truth.bodies import SERVICER3

LIMITED = Robot.from_urdf(SERVICER3)
ENDLESS = Robot.from_string(SERVICER3.read_text(encoding="utf-8").replace('"revolute"', '"continuous"', 1))
TIME = np.arange(0.0, 60.0, 0.1)
ANGLE = 0.25 * TIME + 0.3 * np.sin(0.2 * TIME)


def flown(angle: np.ndarray) -> Recording:
    others = {f"position.joint{k}": 0.1 * np.sin(0.1 * TIME) for k in (2, 3)}
    return Recording("flight", None, TIME, {"position.joint1": angle, **others})


@pytest.mark.parametrize("origin", [-np.pi, 0.0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_angle_of_an_endless_joint_goes_on_where_its_reading_begins_anew(origin, direction):
    wrapped = np.mod(direction * ANGLE - origin, 2.0 * np.pi) + origin
    wrapped[5] = np.nan
    found = unwrapped(flown(wrapped), ENDLESS)
    turns = (found.channels["position.joint1"] - direction * ANGLE) / (2.0 * np.pi)
    kept = np.isfinite(wrapped)
    np.testing.assert_allclose(turns[kept], round(turns[0]), atol=1e-12)
    assert np.isnan(found.channels["position.joint1"][5])


def test_an_angle_that_is_not_wrapped_stays_as_it_is():
    recording = flown(ANGLE)
    assert unwrapped(recording, ENDLESS) is recording
    assert unwrapped(flown(0.2 * ANGLE), LIMITED).channels.keys() == recording.channels.keys()


def test_a_limited_joint_that_jumps_by_a_turn_is_refused():
    wrapped = np.mod(ANGLE + np.pi, 2.0 * np.pi) - np.pi
    with pytest.raises(InputError, match=r"column position.joint1: the angle jumps by a full turn at time .*unwrap"):
        unwrapped(flown(wrapped), LIMITED)


@pytest.mark.parametrize(
    ("count", "words"), [(1, "1 of 600 samples are corrupted"), (200, "in degrees, give them in radians")]
)
def test_a_garbled_reading_is_told_from_a_wrong_unit(count, words):
    angle = 0.1 * np.sin(0.1 * TIME)
    angle[100 : 100 + count] = 57.0
    with pytest.raises(InputError, match=words):
        refuse_impossible_motion(flown(angle), LIMITED)


@pytest.mark.parametrize(("interval", "refused"), [(0.005, False), (0.1, True)])
def test_a_fast_base_is_refused_only_where_its_readings_are_too_far_apart_to_follow_it(interval, refused):
    time = interval * np.arange(200)
    still = {"rate.y": np.zeros(200), "rate.z": np.zeros(200)}
    recording = Recording("thrown", None, time, {"rate.x": np.full(200, 24.2), **still})
    assert whirling_rate(recording) == ("rate.x", 24.2)
    if refused:
        with pytest.raises(InputError, match=r"exceed 24.2 rad/s, 2.4 rad between readings. Give rates in rad/s"):
            refuse_impossible_motion(recording, LIMITED)
    else:
        refuse_impossible_motion(recording, LIMITED)
