"""Shocks: found where a mass moves in MuJoCo, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.recording.shocks import ShakenSensor, shocks
from studies.truth import mujoco as mj
from studies.truth.bodies import SERVICER3

BLOCKS = 10.0
SIGMA = 5e-5
RATE = 60.0


def stamps(rate: float = RATE, end: float = 40.0, jitter: float = 0.3) -> np.ndarray:
    """Jittered times of samples [s]."""
    times = np.arange(0.0, end, 1.0 / rate)
    return times + jitter / rate * np.random.default_rng(1).uniform(-1.0, 1.0, len(times))


def sensors(times: np.ndarray, *courses: np.ndarray, seed: int = 3) -> list[ShakenSensor]:
    """Sensors of three axes that read some course along a direction of their own, in standard deviations, and noise."""
    rng, made = np.random.default_rng(seed), []
    for course in courses:
        direction = rng.normal(size=3)
        readings = np.outer(course, direction / np.abs(direction).max()) + rng.normal(size=(len(times), 3))
        made.append(ShakenSensor(times, SIGMA * readings, np.full(3, SIGMA)))
    return made


def bump(times: np.ndarray, middle: float, length: float) -> np.ndarray:
    """A bump of a height of one."""
    x = np.clip((times - middle) / length, -0.5, 0.5)
    return np.cos(np.pi * x) ** 2


@pytest.mark.parametrize(("start", "rate"), [(3.137, 60.0), (4.552, 60.0), (3.137, 10.0)])
def test_a_mass_that_moves_in_mujoco_shakes_the_sensors_as_long_as_it_moves(start, rate):
    part = mj.Body(6.0, np.array([0.4, 0.1, -0.3]), 1e-2 * np.eye(3))
    mover = mj.Mover(part, (0.6, 0.0, 0.8), 0.3, start, 0.1)
    times = np.arange(0.0, 8.0, 1.0 / rate)
    run = mj.TruthModel(SERVICER3, movers=[mover]).run(lambda _: (np.zeros(3),) * 3, times, rate0=(2e-3, 0.0, 1e-3))
    rng = np.random.default_rng(2)
    made = [
        ShakenSensor(times, values + SIGMA * rng.normal(size=values.shape), np.full(3, SIGMA))
        for values in (run.rate, run.accel)
    ]
    (shock,) = shocks(made, BLOCKS)
    assert start <= shock.begin <= shock.end <= start + 0.1
    left = ~shock.holds(times) & (times > start) & (times < start + 0.1)
    # what is left of the move is below the noise of a sample
    assert np.abs(run.accel[left]).max(initial=0.0) < 10.0 * SIGMA


def test_a_slow_recording_has_none():
    times = stamps(2.0)
    shaken = 1e3 * (np.arange(len(times)) == 40)
    assert shocks(sensors(times, shaken, shaken), BLOCKS) == []
    assert shocks(sensors(times, shaken, shaken), 0.0) == []


def test_a_disturbance_of_one_sensor_is_a_fault_and_no_shock():
    times = stamps()
    shaken = 200.0 * bump(times, 20.0, 0.15)
    assert len(shocks(sensors(times, shaken, shaken), BLOCKS)) == 1
    assert shocks(sensors(times, shaken, np.zeros(len(times))), BLOCKS) == []
    assert shocks(sensors(times, shaken), BLOCKS) == []


@pytest.mark.parametrize("length", [0.02, 0.15, 0.24])
def test_a_kick_or_a_jump_is_no_shock(length):
    times = stamps()
    step = 300.0 * np.clip((times - 20.0) / length, 0.0, 1.0)
    assert shocks(sensors(times, step, step), BLOCKS) == []
    assert shocks(sensors(times, step, 200.0 * bump(times, 20.0, length)), BLOCKS) == []


@pytest.mark.parametrize("size", [4.0, 6.0, 30.0, 1e4])
@pytest.mark.parametrize("frequency", [0.02, 0.1, 0.3, 0.9, 2.0, 12.0])
def test_motion_and_vibration_are_no_shocks(frequency, size):
    times = stamps()
    swing = size * np.sin(2.0 * np.pi * frequency * times)
    assert shocks(sensors(times, swing, swing), BLOCKS) == []


def test_noise_has_none():
    times = stamps()
    still = np.zeros(len(times))
    assert not any(shocks(sensors(times, still, still, seed=seed), BLOCKS) for seed in range(50))
