"""What the package predicts that a rate sensor, an accelerometer and a star sensor read in one recording."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pinocchio as pin

from bayesid.recording.joint_motion import Motion
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import Effect
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from bayesid.simulation.simulator import ModelConstants, Simulator, Values
from bayesid.simulation.time_grid import build_grid, pad_grids


def simulated(
    robot: Robot,
    motion: Motion,
    times: np.ndarray,
    rate0: tuple[float, float, float],
    point: tuple[float, float, float],
    effect: Effect | None = None,
    values: np.ndarray | None = None,
    *,
    step: float = 0.25,
    jumps: tuple[float, ...] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rate (T, 3), accelerometer (T, 3) and rotation matrices (T, 3, 3); a step ends at jumps, by default the effect's.

    The accelerometer is at a point of the base, which has an initial rate and begins parallel to the orbit's axes.
    """
    sensors = (Sensor(SensorKind.RATE, White(1e-5)), Sensor(SensorKind.ACCEL, White(1e-5), position=point))
    model = Model(robot, sensors, (), effects=() if effect is None else (effect,))
    if jumps is None:
        jumps = () if effect is None else tuple(effect.jumps(times[-1]))
    grid = pad_grids([build_grid(robot, (), motion, times, step, effects=model.effects, jumps=jumps)])
    present = () if effect is None else (jnp.asarray(values)[None] if effect.per_recording else jnp.asarray(values),)
    given = Values(jnp.zeros(0), jnp.asarray([rate0]), jnp.zeros((1, 3)), jnp.zeros((1, 0)), present)
    start = jnp.asarray([[0.0, 0.0, 0.0, 1.0]])
    found, quaternion, _ = Simulator.of(model).readings(ModelConstants.of(model), given, grid, start)
    attitude = np.array([pin.Quaternion(np.array(q)).toRotationMatrix() for q in quaternion[0]])
    return np.asarray(found.rate[0]), np.asarray(found.accel[0]), attitude
