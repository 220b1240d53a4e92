"""Play of a joint in fast telemetry, where the encoder's leap is far quicker than the motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from bayesid.recording.blocks import Blocks
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.smoothing import JointSamples, smooth
from bayesid.simulation.effects.joint_backlash import _Speed
from studies.truth.motions import smooth_motion

END, RATE = 30.0, 60.0
NOISE = 5e-6
TIMES = np.arange(0.0, END, 1.0 / RATE)
FLOWN = smooth_motion(1, END, seed=4, amplitude=0.5, frequencies=(0.04, 0.08), ramp=8.0)


@pytest.fixture(scope="module")
def flown() -> np.ndarray:
    """Position, speed and acceleration of the link, (3, n)."""
    return np.array([[part[0] for part in FLOWN(float(time))] for time in TIMES]).T


def measured(position: np.ndarray) -> MeasuredMotion:
    """The motion that an encoder shows at the full rate, smoothed over blocks."""
    noisy = position + NOISE * np.random.default_rng(2).normal(size=len(position))
    return MeasuredMotion((smooth([JointSamples(0, TIMES, noisy, NOISE).reduced(10.0)]),), ("joint",))


def test_a_course_is_averaged_over_the_blocks_of_the_samples(flown):
    """A leap within a block is a share of it in the block's mean; that at the block's middle was nothing or all."""
    (joint,) = measured(flown[0]).joints

    def leap(at):
        return np.stack([(at > 12.34).astype(float), np.zeros_like(at), np.zeros_like(at)])

    blocks = Blocks.of(TIMES, 10.0)
    shares = blocks.mean(leap(TIMES)[0])
    np.testing.assert_allclose(joint.of_course(leap).series[0].value, shares)
    assert ((shares > 0.0) & (shares < 1.0)).sum() == 1


@pytest.mark.parametrize("creeping", [2.5e-4, 1e-3])
@pytest.mark.parametrize("gap", [5e-4, 2e-3])
def test_reversals_are_those_of_the_link_and_not_of_the_leaping_encoder(flown, gap, creeping):
    """The smoothed record itself reverses up to 0.15 s earlier, many times as steeply, and where it rings again.

    Measured: times to 0.05 s, slopes to 5 %. Near the ends the joint comes to rest, where this link creeps to the
    middle of its gap.
    """
    curve = CubicSpline(TIMES, flown[1])
    peak = np.abs(flown[1]).max()
    inner = [root for root in curve.roots(extrapolate=False) if 2.0 < root < END - 2.0]
    true = [root for root in inner if abs(curve(root, 1)) > 0.1 * peak]
    speed = _Speed.of(measured(flown[0] + 0.5 * gap * np.tanh(flown[1] / creeping)), 0, 0.0, END)
    turns = [turn for turn in speed.turns if turn.slope > 0.1 * peak and turn.time < END - 2.0]
    assert len(turns) == len(true) > 2
    for turn, time in zip(turns, true, strict=True):
        assert turn.time == pytest.approx(time, abs=0.06)
        assert turn.slope == pytest.approx(abs(curve(time, 1)), rel=0.06)
        assert turn.side == np.sign(curve(time, 1))


@pytest.mark.parametrize("creeping", [1e-3, 2e-3])
def test_a_leap_follows_the_encoder(flown, creeping):
    """What the encoder shows beside the link is a leap of the gap in each reversal, to a seventh of it at any time."""
    gap = 1e-3
    shown = flown[0] + 0.5 * gap * np.tanh(flown[1] / creeping)
    encoder = measured(shown)
    inner = np.arange(8.0, 22.0, 0.02)
    speed = _Speed.of(encoder, 0, 0.0, END)
    leaps = np.stack([speed.leap(inner, one)[0] for one in (3e-4, 1e-3, 3e-3)], axis=1)
    link = encoder.evaluate(inner).position[:, 0] - CubicSpline(TIMES, flown[0])(inner)
    shares = np.linalg.lstsq(leaps, -link, rcond=None)[0]
    assert shares.sum() == pytest.approx(gap, rel=0.05)
    assert np.abs(link + leaps @ shares).max() < 0.15 * gap


def test_a_joint_that_never_reverses_has_no_turns():
    speed = _Speed.of(measured(0.02 * TIMES), 0, 0.0, END)
    assert (speed.first, speed.turns) == (1.0, ())
