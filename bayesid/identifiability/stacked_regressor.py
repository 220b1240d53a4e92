"""Regressor of a robot's equations of motion in random states; structure is what holds in every state."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike

from bayesid._math.arrays import Floats
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Kinematics, kinematics
from bayesid.robot.regressors import torque_regressor
from bayesid.robot.robot import Robot

__all__ = ["GRAVITY", "Base", "massive_bodies", "random_motion", "stacked_regressor"]

GRAVITY = (0.0, 0.0, -9.81)
"""Acceleration of gravity on a fixed base, base axes [m/s2]."""


class Base(Enum):
    """Support of the base body."""

    FREE = "free-flying"
    """The base moves freely: the equations are its force and torque balance and the joint torques, without gravity."""
    FIXED = "fixed"
    """The base is bolted to the ground: the equations are the joint torques, with gravity."""


def massive_bodies(robot: Robot) -> tuple[str, ...]:
    """Return the links with mass and the loads, every body after those that carry it."""
    bodies = [name for name, link in robot.links.items() if link.inertial.mass > 0.0 or name in robot.loads]
    return tuple(sorted(bodies, key=lambda name: robot.link(name).joint))


def random_motion(robot: Robot, count: int, rng: np.random.Generator) -> Kinematics:
    """Draw random joint states with unit standard deviations of speed and acceleration.

    Revolute joints are drawn anywhere on the circle, prismatic joints with a standard deviation of 1 m about zero.
    """
    position, velocity, acceleration = rng.normal(size=(3, count, len(robot.joints)))
    turning = np.array([joint.kind != "prismatic" for joint in robot.joints], dtype=bool)
    position[:, turning] = rng.uniform(-np.pi, np.pi, size=(count, int(turning.sum())))
    return kinematics(robot, JointState(position, velocity, acceleration))


def stacked_regressor(
    robot: Robot,
    bodies: Sequence[str],
    base: Base,
    rng: np.random.Generator,
    *,
    gravity: ArrayLike = GRAVITY,
    surplus: float = 3.0,
) -> Floats:
    """Return the regressor of all equations of motion in random states, stacked as in the paper's (23).

    Parameters
    ----------
    robot : Robot
        Robot with its joints and links.
    bodies : sequence of str
        Bodies whose parameters multiply the columns, ten for each body.
    base : Base
        Support of the base, which decides the equations.
    rng : numpy.random.Generator
        Source of the random states.
    gravity : (3,) array_like
        Acceleration of gravity on a fixed base, base axes [m/s2].
    surplus : float
        Smallest number of rows per column.

    Returns
    -------
    (rows, 10 bodies) array
        Stacked regressor; it has no rows where a fixed base has no joints.
    """
    free = base is Base.FREE
    per_state = len(robot.joints) + (6 if free else 0)
    count = int(np.ceil(surplus * 10 * len(bodies) / max(per_state, 1)))
    motion = random_motion(robot, count, rng)
    if free:
        rate, change, acceleration = rng.normal(size=(3, count, 3))
    else:
        rate = change = np.zeros((count, 3))
        acceleration = np.tile(-np.asarray(gravity, dtype=float), (count, 1))
    regressor = torque_regressor(robot, bodies, motion, rate, change, acceleration)
    return regressor[:, 0 if free else 6 :].reshape(-1, 10 * len(bodies))
