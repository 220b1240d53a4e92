"""Errors of smoothed joints in the standard deviations stated for them: why chi-square per sample is not exactly one.

The smoothing takes a joint's motion as an m-fold integral of white noise. In frequency w its posterior variance is that
of the encoder times H = 1 / (1 + (w / c)^2m), of which H^2 is noise let through and H - H^2 roughness not resolved. Of
the r-th derivative's variance the second part is (2r + 1) / 2m. A motion of a few sines has no such roughness, so that
the mean square of its errors is 1 - (2r + 1) / 2m of what is stated; at a jump of the jerk that is not found in the
samples (`bayesid.recording.jumps`) it is far more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.recording.jumps import smooth_joints
from bayesid.recording.smoothing import ORDERS, JointSamples
from studies.calibration.data import AMPLITUDE, DURATION
from studies.truth.mujoco import smooth_motion

RAMP = 20.0  # length of the quintic ramps, at whose inner ends the jerk jumps [s]
NEAR = 1.0  # distance from such an end within which a sample counts as near it [s]
MOTIONS = 10  # number of random motions of each row

# time between samples [s] and noise of the encoder [rad]
SETTINGS = ((0.5, 1e-6), (0.5, 1e-5), (0.5, 1e-4), (2.0, 1e-6))


class Smoothed(NamedTuple):
    """Mean squares of the errors of joint position, speed and acceleration over their stated variances, each (3,)."""

    # time between samples [s] and noise of the encoder [rad]
    interval: float
    encoder: float
    # (3,): farther than `NEAR` from the inner ends of the ramps, and nearer
    between: Floats
    near: Floats


def smooth_share(derivative: int, order: int = ORDERS[-1]) -> float:
    """Return the mean square error of a derivative of a motion much smoother than the process, over that stated."""
    return 1.0 - (2 * derivative + 1) / (2 * order)


def smoothed_errors(seed: int = 1, motions: int = MOTIONS) -> list[Smoothed]:
    """Smooth samples of random motions that are known exactly, and compare."""
    rows = []
    for interval, encoder in SETTINGS:
        time = np.arange(0.0, DURATION + 1e-9, interval)
        near = np.abs(time[:, None] - [RAMP, DURATION - RAMP]).min(axis=1) <= NEAR
        ratios = np.mean([_ratios(time, encoder, seed + number) for number in range(motions)], axis=0)
        rows.append(Smoothed(interval, encoder, ratios[:, ~near].mean(axis=1), ratios[:, near].mean(axis=1)))
    return rows


def _ratios(time: Floats, encoder: float, seed: int) -> Floats:
    """Return squared errors over stated variances of one motion, shape (3, T)."""
    motion = smooth_motion(1, DURATION, seed, amplitude=AMPLITUDE, ramp=RAMP)
    exact = np.array([np.ravel(motion(float(now))) for now in time]).T
    noisy = exact[0] + encoder * np.random.default_rng(seed).normal(size=len(time))
    (joint,) = smooth_joints([[JointSamples(0, time, noisy, encoder)]])
    return np.asarray(((joint.evaluate(time) - exact) / joint.standard_deviation(time)) ** 2)
