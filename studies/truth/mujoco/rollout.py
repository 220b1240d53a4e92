"""MuJoCo's rollouts in C of a motion, to compare their speed."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
from mujoco import rollout as mujoco_rollout

from studies.truth.motions import Motion
from studies.truth.mujoco.model import TruthModel
from studies.truth.numerics import Array

__all__ = ["rollout"]


def rollout(exact: TruthModel, motion: Motion, count: int, step: float) -> Callable[[], Array]:
    """Prepare the rollout of a motion from time 0, its joints driven by the exact torques at mid-step.

    Parameters
    ----------
    exact : TruthModel
        The robot, without gravity gradient; its integrator is changed.
    motion : callable
        Time -> positions, speeds, accelerations of the joints.
    count : int
        Number of steps.
    step : float
        Length of a step [s].

    Returns
    -------
    callable
        Rolls out and returns the rates of the base before each step, (count, 3) [rad/s].
    """
    model = exact.model
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = step
    torque = np.zeros((1, count, model.nv))
    torque[0][:, exact.driven_v] = exact.run(motion, step * (np.arange(count) + 0.5), step=min(step, 0.1)).torque
    # a fresh state, since the exact flight leaves its last one behind
    data = mujoco.MjData(model)
    position, speed, _ = motion(0.0)
    data.qpos[exact.driven_q], data.qvel[exact.driven_v] = position, speed
    mujoco.mj_forward(model, data)
    initial = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
    mujoco.mj_getState(model, data, initial, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    control = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)

    def roll() -> Array:
        sensed = mujoco_rollout.rollout(model, data, initial[None], torque, control_spec=control)[1][0]
        return np.asarray(sensed[:, 3:6])

    return roll
