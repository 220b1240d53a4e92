"""Timing of simulations by this package and by others."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bayesid import Posterior, Robot
from studies.benchmark.cases import DURATION, SIGMA, excitation
from studies.common.ets7 import INTERVAL, RADIUS
from studies.truth import stepwise
from studies.truth.mujoco import TruthModel, rollout

__all__ = ["EVALUATED", "Rival", "rivals", "seconds_per_evaluation"]

BATCH = 64
"""Number of simulations that are evaluated per call."""

EVALUATED = (
    f"one recording of {round(DURATION / INTERVAL) + 1} samples over {DURATION:g} s, joints known exactly, base and "
    f"initial rate unknown, in batches of {BATCH} points"
)
"""What is evaluated where no other case is named, in words."""

STEPS = (0.1, 0.05, 0.02, 0.01, 0.005)
"""Steps tried for MuJoCo, longest first [s]."""


class Rival(NamedTuple):
    """Another simulator.

    Attributes
    ----------
    name : str
    seconds : float
        Time per simulation [s].
    step : float
        Integration step that it needs [s].
    error : float
        Largest error of a rate, in standard deviations of a sample.
    """

    name: str
    seconds: float
    step: float
    error: float


def best_of(function: Callable[[], Any], repeats: int) -> float:
    """Return the shortest time of several calls [s], after one that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return min(times)


def seconds_per_evaluation(posterior: Posterior, repeats: int = 10) -> float:
    """Return the time of one evaluation of the log density, simulation and sensors included [s]."""
    z = posterior.starting_point() + 0.01 * np.random.default_rng(0).normal(size=(BATCH, posterior.size))
    return best_of(lambda: posterior.log_density(z), repeats) / BATCH


def rivals(robot: Robot, posterior: Posterior, repeats: int = 2) -> list[Rival]:
    """Time the step-by-step Pinocchio loop and MuJoCo's rollouts of the same manoeuvre."""
    motion = excitation(len(robot.joints), 0)
    samples = posterior.data.times(0)
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        robot.write_urdf(urdf)
        return [_pinocchio(urdf, motion, samples, repeats), _mujoco(urdf, motion, samples, repeats)]


def _state_at(motion: Any) -> Callable[[float], tuple[Any, Any, Any]]:
    def at(instant: float) -> tuple[Any, Any, Any]:
        state = motion.evaluate(np.array([instant]))
        return state.position[0], state.velocity[0], state.acceleration[0]

    return at


def _pinocchio(urdf: Path, motion: Any, samples: Any, repeats: int) -> Rival:
    zenith = stepwise.circular_zenith(RADIUS)

    def simulate(step: float) -> Any:
        return stepwise.simulate(
            urdf, _state_at(motion), samples, step, rate0=np.zeros(3), accel_position=np.zeros(3), zenith=zenith
        )

    fine, coarse = simulate(0.25).rate, simulate(0.5).rate
    seconds = best_of(lambda: simulate(0.5), repeats)
    return Rival("Pinocchio, step by step in Python", seconds, 0.5, _sigmas(coarse - fine))


def _mujoco(urdf: Path, motion: Any, samples: Any, repeats: int) -> Rival:
    """Roll out in C, joints driven by the exact torques at mid-step; rollouts have no gravity gradient."""
    exact = TruthModel(urdf)
    at = _state_at(motion)
    right = exact.run(at, samples, step=0.1).rate
    for step in STEPS:
        count = round(DURATION / step)
        roll = rollout(exact, at, count, step)
        # readings are taken before a step, so that row k belongs to time k step
        row = np.round(samples / step).astype(int)
        use = row < count
        result = Rival("MuJoCo rollouts in C", best_of(roll, repeats), step, _sigmas(roll()[row[use]] - right[use]))
        if result.error < 0.01:
            break
    return result


def _sigmas(difference: Any) -> float:
    return float(np.abs(difference).max() / SIGMA)
