"""Timing of simulations, ours and others'."""

from __future__ import annotations

import importlib
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bayesid import InputError, Posterior, Robot
from studies.benchmark.cases import DURATION, RADIUS, SIGMA, excitation

BATCH = 64
"""Simulations evaluated per call."""

STEPS = (0.1, 0.05, 0.02, 0.01, 0.005)
"""Steps tried for MuJoCo, longest first [s]."""


class Rival(NamedTuple):
    """Another simulator: seconds per simulation, the step it needs, and its error in sigma."""

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
    """Time the step-by-step Pinocchio loop and MuJoCo's own rollouts of the same manoeuvre.

    Raises
    ------
    InputError
        If the tests' independent simulators are not beside the studies.
    """
    reference, truth = _independent()
    motion = excitation(len(robot.joints), 0)
    samples = posterior.data.times(0)
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        robot.write_urdf(urdf)
        return [
            _pinocchio(reference, urdf, motion, samples, repeats),
            _mujoco(truth, urdf, motion, samples, repeats),
        ]


def _independent() -> tuple[Any, Any]:
    tests = Path(__file__).parents[2] / "tests"
    if not (tests / "reference.py").is_file():
        raise InputError("the independent simulators are absent", file=tests, remedy="Run in a clone of the repository")
    sys.path.insert(0, str(tests))
    try:
        return importlib.import_module("reference"), importlib.import_module("mujoco_truth")
    finally:
        sys.path.remove(str(tests))


def _state_at(motion: Any) -> Callable[[float], tuple[Any, Any, Any]]:
    def at(instant: float) -> tuple[Any, Any, Any]:
        state = motion.evaluate(np.array([instant]))
        return state.position[0], state.velocity[0], state.acceleration[0]

    return at


def _pinocchio(reference: Any, urdf: Path, motion: Any, samples: Any, repeats: int) -> Rival:
    zenith = reference.circular_zenith(RADIUS)

    def simulate(step: float) -> Any:
        return reference.simulate(
            urdf, _state_at(motion), samples, step, rate0=np.zeros(3), accel_position=np.zeros(3), zenith=zenith
        )

    fine, coarse = simulate(0.25).rate, simulate(0.5).rate
    return Rival(
        "Pinocchio, step by step in Python", best_of(lambda: simulate(0.5), repeats), 0.5, _sigmas(coarse - fine)
    )


def _mujoco(truth: Any, urdf: Path, motion: Any, samples: Any, repeats: int) -> Rival:
    """Roll out in C, joints driven by the exact torques at mid-step; rollouts have no gravity gradient."""
    import mujoco
    from mujoco import rollout

    exact = truth.TruthModel(urdf)
    at = _state_at(motion)
    right = exact.run(at, samples, step=0.1).rate
    model = exact.model
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    position, speed, _ = at(0.0)
    data.qpos[exact._driven_q], data.qvel[exact._driven_v] = position, speed
    mujoco.mj_forward(model, data)
    initial = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, initial, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    result = None
    for step in STEPS:
        model.opt.timestep = step
        count = round(DURATION / step)
        middle = step * (np.arange(count) + 0.5)
        torque = np.zeros((1, count, model.nv))
        torque[0][:, exact._driven_v] = exact.run(at, middle, step=min(step, 0.1)).torque

        def roll(torque: Any = torque) -> Any:
            return rollout.rollout(
                model, data, initial[None], torque, control_spec=int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
            )

        sensed = roll()[1][0]
        # readings are taken before a step, so that row k belongs to time k step
        row = np.round(samples / step).astype(int)
        use = row < count
        error = _sigmas(sensed[row[use], 3:6] - right[use])
        result = Rival("MuJoCo rollouts in C", best_of(roll, repeats), step, error)
        if error < 0.01:
            break
    assert result is not None
    return result


def _sigmas(difference: Any) -> float:
    return float(np.abs(difference).max() / SIGMA)
