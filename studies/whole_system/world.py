"""Manoeuvres of the true robot, flown by an independent simulator and recorded with noise."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayesid import Manoeuvre, Robot
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import joint_motion, kinematics
from studies.common import flight
from studies.common.ets7 import ACCEL, ENCODER, RATE, TIP
from studies.truth.mujoco import Thrust, Truth, smooth_motion
from studies.whole_system.setting import COULOMB, TORQUE, VISCOUS

__all__ = ["START_RATE", "flights", "fly", "hand_speed", "record"]

STEP, INTERVAL = 0.1, 0.5  # integration step of MuJoCo, and time between samples [s]
START_RATE = np.array([2e-4, -1e-4, 3e-4])  # true rate of the base at the start [rad/s]
CENTRE = np.array([0.2, -0.8, 1.2, -0.5, 0.6, 0.3])  # joint positions before and after a manoeuvre [rad]


def flights(duration: float) -> dict[str, dict[str, Any]]:
    """Return the manoeuvres compared, by name: arguments of `fly`."""
    first, second = round(0.25 * duration), round(0.6 * duration)
    pulses = (Thrust(first, first + 2.0, force=(20.0, 0.0, 0.0)), Thrust(second, second + 2.0, force=(0.0, 20.0, 0.0)))
    return {
        "three joints": {"joints": (0, 1, 2)},
        "six joints": {"joints": tuple(range(6))},
        "six joints, half as far": {"joints": tuple(range(6)), "amplitude": 0.25},
        "six joints, known thrust": {"joints": tuple(range(6)), "thrusts": pulses},
    }


def fly(
    robot: Robot, seed: int, *, duration: float, joints: tuple[int, ...], amplitude: float = 0.5, **hidden: Any
) -> Truth:
    """Fly a smooth manoeuvre of some joints and return what truly happened at the samples.

    Parameters
    ----------
    robot : Robot
        The robot as it truly is.
    seed : int
        Seed of the manoeuvre.
    duration : float
        Duration of the manoeuvre [s].
    joints : tuple of int
        Joints that move.
    amplitude : float
        Typical excursion [rad].
    **hidden
        Further influences, keywords of `studies.truth.mujoco.TruthModel`.
    """
    size = np.zeros(len(robot.joints))
    size[list(joints)] = amplitude
    motion = smooth_motion(len(size), duration, seed, amplitude=size, centre=CENTRE)
    time = np.arange(0.0, duration + 1e-9, INTERVAL)
    return flight.true_robot(robot, **hidden).run(motion, time, rate0=START_RATE, step=STEP)


def hand_speed(truth: Truth, robot: Robot) -> float:
    """Return the largest speed of the end-effector relative to the base [m/s]."""
    moved = kinematics(robot, JointState(truth.position, truth.speed, truth.acceleration))
    link = robot.link(TIP)
    _, flow, _ = joint_motion(moved, link.joint)
    return float(np.linalg.norm((flow @ link.placement)[:, :3, 3], axis=1).max())


def record(truth: Truth, robot: Robot, name: str, rng: np.random.Generator | None) -> Manoeuvre:
    """Record a flight with the noise of all sensors; torques include the friction of the joints."""
    friction = COULOMB * np.sign(truth.speed) + VISCOUS * truth.speed
    noise = {"position": ENCODER, "torque": TORQUE, "rate": RATE, "accel": ACCEL}
    return flight.record(truth._replace(torque=truth.torque + friction), name, robot, noise, rng, by_channel=())
