"""Manoeuvres of the true robot, flown by an independent simulator and recorded with noise."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid import Manoeuvre, MeasuredMotion, Recording, Robot
from bayesid.motion import JointState
from bayesid.tables import joint_motion, kinematics
from studies.truth import mujoco as truth
from studies.whole_system.setting import (
    ACCEL,
    COULOMB,
    ENCODER,
    POINT,
    RADIUS,
    RATE,
    TIP,
    TORQUE,
    VISCOUS,
)

__all__ = ["START_RATE", "flights", "fly", "hand_speed", "record"]

Floats = NDArray[np.floating]

STEP, INTERVAL = 0.1, 0.5
"""Of the independent simulator, and between samples [s]."""

START_RATE = np.array([2e-4, -1e-4, 3e-4])
"""True rate of the base at the start [rad/s]."""


def flights(duration: float) -> dict[str, dict[str, Any]]:
    """Return the manoeuvres compared, by name: arguments of `fly`."""
    thrust = truth.Thrust
    first, second = round(0.25 * duration), round(0.6 * duration)
    pulses = (
        thrust(first, first + 2.0, force=(20.0, 0.0, 0.0)),
        thrust(second, second + 2.0, force=(0.0, 20.0, 0.0)),
    )
    return {
        "three joints": {"joints": (0, 1, 2)},
        "six joints": {"joints": tuple(range(6))},
        "six joints, half as far": {"joints": tuple(range(6)), "amplitude": 0.25},
        "six joints, known thrust": {"joints": tuple(range(6)), "thrusts": pulses},
    }


def fly(
    robot: Robot, seed: int, *, duration: float, joints: tuple[int, ...], amplitude: float = 0.5, **hidden: Any
) -> Any:
    """Fly a smooth manoeuvre of some joints and return what truly happened at the samples.

    Parameters
    ----------
    robot : Robot
        The true one.
    seed : int
        Of the manoeuvre.
    duration : float
        [s]
    joints : tuple of int
        Those that move.
    amplitude : float
        Typical excursion [rad].
    **hidden
        What else acts, keywords of the simulator's ``TruthModel``.
    """
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        robot.write_urdf(urdf)
        model = truth.TruthModel(urdf, orbit=truth.Orbit(radius=RADIUS), accel_position=POINT, **hidden)
    size = np.zeros(len(robot.joints))
    size[list(joints)] = amplitude
    centre = np.array([0.2, -0.8, 1.2, -0.5, 0.6, 0.3])
    motion = truth.smooth_motion(len(size), duration, seed, amplitude=size, centre=centre)
    time = np.arange(0.0, duration + 1e-9, INTERVAL)
    return model.run(motion, time, rate0=START_RATE, step=STEP)


def hand_speed(run: Any, robot: Robot) -> float:
    """Return the largest speed of the end-effector relative to the base [m/s]."""
    moved = kinematics(robot, JointState(run.position, run.speed, run.acceleration))
    link = robot.link(TIP)
    _, flow, _ = joint_motion(moved, link.joint)
    return float(np.linalg.norm((flow @ link.placement)[:, :3, 3], axis=1).max())


def record(run: Any, robot: Robot, name: str, rng: np.random.Generator | None, *, friction: bool = True) -> Manoeuvre:
    """Record a flight with the noise of all sensors; torques hold the friction of the joints."""

    def noisy(values: Floats, sigma: float) -> Floats:
        return values if rng is None else values + sigma * rng.standard_normal(values.shape)

    torque = run.torque
    if friction:
        torque = torque + COULOMB * np.sign(run.speed) + VISCOUS * run.speed
    position, torque = noisy(run.position, ENCODER), noisy(torque, TORQUE)
    channels = {}
    for k, joint in enumerate(robot.joints):
        channels[f"position.{joint.name}"] = position[:, k]
        channels[f"torque.{joint.name}"] = torque[:, k]
    for family, values, sigma in (("rate", run.rate, RATE), ("accel", run.accel, ACCEL)):
        own = noisy(values, sigma)
        channels |= {f"{family}.{axis}": own[:, k] for k, axis in enumerate("xyz")}
    if np.any(run.force) or np.any(run.external_torque):
        for family, values in (("base_force", run.force), ("base_torque", run.external_torque)):
            channels |= {f"{family}.{axis}": values[:, k] for k, axis in enumerate("xyz")}
    recording = Recording(name, None, np.asarray(run.times), channels)
    sigmas: dict[int, float] = {0: ENCODER}
    return Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma=sigmas))
