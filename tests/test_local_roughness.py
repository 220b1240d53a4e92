"""Roughness that changes along a motion: found where it is there, and errors of moves with rests are covered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bayesid.recording.jumps import roughened, smooth_joints
from bayesid.recording.smoothing import JointSamples, SmoothedJoint, smooth
from tests.profiled_motions import ProfiledManoeuvres, cycloid, septic
from tests.test_smoothing import TIME, wiener

SIGMA = 1e-5


def smoothed(motion: np.ndarray, seed: int, order: int = 3) -> SmoothedJoint:
    noise = SIGMA * np.random.default_rng([7, seed]).normal(size=len(TIME))
    return smooth([JointSamples(0, TIME, motion + noise, SIGMA)], orders=(order,))


def uneven(seed: int) -> np.ndarray:
    """A motion whose third derivative is a tenth as strong in the second half as in the first."""
    middle = len(TIME) // 2
    first, second = wiener(3, TIME, 1e-3, seed), wiener(3, TIME, 1e-4, 100 + seed)
    since = TIME[middle:] - TIME[middle]
    change = first[:, middle] - second[:, middle]  # the process is the same from any state
    later = second[0, middle:] + change[0] + change[1] * since + 0.5 * change[2] * since**2
    return np.concatenate([first[0, :middle], later])


def test_energies_of_increments_are_their_degrees_of_freedom_where_the_process_is_right() -> None:
    """Over 20 motions of some 60 degrees of freedom each the ratio varies by 0.04."""
    energy, freedom = np.zeros(2), np.zeros(2)
    half = len(TIME) // 2
    for seed in range(20):
        joint = smoothed(wiener(3, TIME, 1e-3, seed)[0], seed)
        right = replace(joint, intensity=1e-3).with_roughness(np.ones(len(TIME) - 1))
        own, own_freedom = right.increment_energies()
        energy += own[:half].sum(), own[half:].sum()
        freedom += own_freedom[:half].sum(), own_freedom[half:].sum()
    np.testing.assert_allclose(energy / freedom, 1.0, atol=0.15)


def test_a_motion_that_becomes_smoother_is_found_to() -> None:
    """The ratio of variances is 100. The prior of a factor holds it above 0.3, so that a part of that is found."""
    half = len(TIME) // 2
    for seed in range(12):
        joint = smoothed(uneven(seed), seed)
        found = roughened(joint)
        assert found.log_likelihood > joint.log_likelihood + 10.0
        assert found.roughness is not None
        factors = np.log(found.roughness)
        assert factors[5 : half - 5].mean() - factors[half + 5 : -5].mean() > np.log(2.0)


def test_what_moves_once_is_rough_there_alone() -> None:
    """A rest with one blow of the third derivative, which an even process spreads over all of the motion.

    The error of the speed at rest is stated smaller for it, and remains as stated.
    """
    even, own, errors = [], [], []
    rest = np.abs(TIME - 40.0) > 10.0
    for seed in range(12):
        motion = 0.02 * np.clip(TIME - 39.8, 0.0, 1.3) ** 3
        motion += 0.0507 * np.maximum(TIME - 41.1, 0.0) ** 1  # goes on with about the speed at the end of the blow
        joint = smoothed(motion, seed)
        found = roughened(joint)
        speed = np.where(TIME > 41.1, 0.0507, 0.0)
        errors.append((found.evaluate(TIME)[1] - speed)[rest] / found.standard_deviation(TIME)[1][rest])
        even.append(joint.standard_deviation(TIME)[1][rest].mean())
        own.append(found.standard_deviation(TIME)[1][rest].mean())
    assert np.mean(own) < 0.75 * np.mean(even)
    assert np.mean(np.square(errors)) < 1.15


def test_an_even_motion_keeps_its_roughness() -> None:
    """Of motions that the process is right about the factors scatter about one, and the errors stay as stated."""
    logs, squares = [], []
    for seed in range(12):
        motion = wiener(3, TIME, 1e-3, seed)[0]
        found = roughened(smoothed(motion, seed))
        assert found.roughness is not None
        logs.append(np.log(found.roughness))
        squares.append(np.mean(((found.evaluate(TIME)[0] - motion) / found.standard_deviation(TIME)[0]) ** 2))
    assert abs(np.median(logs)) < 0.3
    assert np.std(logs) < 0.8
    assert np.mean(squares) == pytest.approx(1.0, abs=0.2)


def test_a_joint_at_rest_says_nothing_of_its_roughness() -> None:
    joint = smoothed(np.full(len(TIME), 0.4), 0)
    assert np.isfinite(roughened(joint).standard_deviation(TIME)).all()


@pytest.mark.slow
@pytest.mark.parametrize(("profile", "sigma"), [(cycloid, 1e-5), (septic, 1e-4)])
def test_errors_of_moves_with_rests_are_covered(
    profile: Callable[..., tuple[float, float, float]], sigma: float
) -> None:
    """Six joints, moves of 20 to 30 s with rests between, in three recordings.

    An even process took many places for jumps and stated too little elsewhere: of other motions the mean square of the
    acceleration's errors was 2.4 with septic moves and encoders of 0.1 mrad. Where two moves are a second apart, one
    jump is found of two, so that a few samples remain with errors of five to eight stated deviations.
    """
    time = np.arange(0.0, 150.01, 0.25)
    squares, beyond = [], []
    for seed in range(3):
        rng = np.random.default_rng([23, seed])
        motion = ProfiledManoeuvres(duration=150.0, profile=profile).draw(["revolute"] * 6, rng)
        truth = np.array([motion(float(now)) for now in time])
        noise = sigma * rng.normal(size=truth[:, 0].shape)
        series = [[JointSamples(0, time, column, sigma)] for column in (truth[:, 0] + noise).T]
        for index, joint in enumerate(smooth_joints(series)):
            ratio = (joint.evaluate(time) - truth[:, :, index].T) / joint.standard_deviation(time)
            squares.append((ratio**2).mean(axis=1))
            beyond.append((np.abs(ratio) > 4.0).mean(axis=1))
    assert (np.mean(squares, axis=0) < 1.15).all(), np.mean(squares, axis=0)
    assert (np.mean(beyond, axis=0) < 3e-3).all(), np.mean(beyond, axis=0)
