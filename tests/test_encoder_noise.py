"""What an error of a joint's position does to the readings, against MuJoCo with that error as a true motion."""

from __future__ import annotations

import jax
import numpy as np
import pytest

from bayesid.inference.data import RecordedSamples
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from bayesid.simulation.time_grid import build_grid
from studies.truth import mujoco as mj
from tests.conftest import PLANAR, POINT

SIZE, WIDTH, PEAK, END = 1e-4, 0.1, 0.5, 0.6
"""Size of the error [rad], half its duration, when it is largest, and the end of the run [s]."""


def bump(time: float) -> np.ndarray:
    """An error that rises and falls within twice `WIDTH`, and its two derivatives."""
    x = (time - PEAK) / WIDTH
    if abs(x) >= 1.0:
        return np.zeros(3)
    u = 1.0 - x * x
    slope, curvature = -8.0 * x * u**3, -8.0 * u**3 + 48.0 * x * x * u**2
    return SIZE * np.array([u**4, slope / WIDTH, curvature / WIDTH**2])


@pytest.mark.parametrize("joint", [0, 1])
def test_an_error_of_position_turns_base_and_momentum(joint, formula_motion):
    """The base tumbles fast, so that what the error turns shows; where the error is largest its speed is zero."""
    smooth = mj.smooth_motion(2, 40.0, seed=11, amplitude=0.3, frequencies=(0.03, 0.05), ramp=20.0)

    def displaced(time: float) -> tuple[np.ndarray, ...]:
        unit = np.eye(2)[joint]
        return tuple(part + change * unit for part, change in zip(smooth(time), bump(time), strict=True))

    times = np.array([0.0, PEAK, END])
    model = mj.TruthModel(PLANAR, accel_position=POINT)
    before, after = (model.run(motion, times, rate0=(0.3, -0.2, 0.25), step=0.002) for motion in (smooth, displaced))
    robot = Robot.from_urdf(PLANAR)
    motion = formula_motion(smooth, PLANAR, robot)
    grid = build_grid(robot, ("base_link",), motion, times, 0.1)
    environment = jax.tree.map(np.asarray, grid.sample.environment)
    sensors = (
        Sensor(SensorKind.RATE, White(1e-5)),
        Sensor(SensorKind.ACCEL, White(1e-5), position=POINT),
        Sensor(SensorKind.ATTITUDE, White(1e-5)),
    )
    seen = SampledMotion(before.attitude, before.rate, environment)
    slope = joint_sensitivity(robot, JointState(*motion.evaluate(times)), seen, sensors)[joint, :, 1]
    expected = slope.T @ bump(PEAK)
    attitude = np.asarray(SensorKind.ATTITUDE.residual(after.attitude[1], before.attitude[1]))
    changed = np.concatenate([after.rate[1] - before.rate[1], after.accel[1] - before.accel[1], attitude])
    for columns in (slice(0, 3), slice(3, 6), slice(6, 9)):
        # the motion of the base since the error began is left out, a part of its rate times the duration
        np.testing.assert_allclose(changed[columns], expected[columns], atol=0.06 * np.abs(expected[columns]).max())


def test_the_covariance_of_means_over_blocks_is_that_of_the_instants_that_predict_them():
    """Beside a jump of the acceleration that at the middle of a block may be a hundred times too small."""
    rng, times, noise = np.random.default_rng(5), np.arange(0.0, 12.0, 1.0 / 60.0), 5e-6
    bent = 0.05 * np.clip(times - 6.17, 0.0, None) ** 2  # the acceleration jumps
    channels = {f"position.joint{index + 1}": bent + noise * rng.normal(size=len(times)) for index in range(2)}
    channels |= {f"rate.{axis}": 1e-4 * rng.normal(size=len(times)) for axis in "xyz"}
    recording = Recording("flight", None, times, channels)
    robot = Robot.from_urdf(PLANAR)
    motion = MeasuredMotion.from_recording(recording, robot, sigma={0: noise})
    model = Model(robot, (Sensor(SensorKind.RATE, White(1e-4)),), ())
    samples = RecordedSamples.of(model, Manoeuvre(recording, motion))
    lags = 3
    found = samples.motion_covariance(motion, lags)
    node, weight = samples.average("rate")
    for row in range(40, 80):
        for lag in range(lags + 1):
            expected = np.zeros((2, 3, 3))
            for i in range(2):
                for j in range(2):
                    now, before = samples.nodes[node[row, i]], samples.nodes[node[row - lag, j]]
                    pair = motion.lag_covariance(np.sort([before, now]), 1)[:, 1 if now != before else 0, 1]
                    pair = np.swapaxes(pair, -1, -2) if now < before else pair
                    expected += weight[row, i] * weight[row - lag, j] * pair
            np.testing.assert_allclose(found[:, lag, row], expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())
    at_middle = motion.lag_covariance(samples.time, 0)[:, 0, :, 2, 2]
    assert (found[:, 0, :, 2, 2] / at_middle).max() > 10.0
