"""Base parameters of a robot, with the singular values of its regressor, and its equations in one state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bayesid import Robot
from bayesid._math.arrays import Floats
from bayesid.identifiability import Base, BaseParameters, base_parameters, consistent_accelerations
from bayesid.identifiability.stacked_regressor import massive_bodies, stacked_regressor
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import configuration, kinematics
from bayesid.robot.regressors import torque_regressor

__all__ = ["Equations", "Structure", "equations_at", "standard_parameters", "structure"]

SEED = 1991
"""Seed of the random states in which singular values are computed."""


@dataclass(frozen=True)
class Structure:
    """Identifiable part of a robot's parameters.

    Attributes
    ----------
    robot : Robot
    base : BaseParameters
    singular : (n,) array
        Singular values of the regressor with columns of unit length, relative to the largest.
    parameters : (n,) array
        Parameters of the robot, in the order of ``base.standard``.
    """

    robot: Robot
    base: BaseParameters
    singular: Floats
    parameters: Floats


@dataclass(frozen=True)
class Equations:
    """The paper's (23) in one state; base force and torque [N, N m], then the joint torques [N m].

    Attributes
    ----------
    regressor : (6 + joints,) array
        Product of this package's regressor with the parameters.
    pinocchio : (6 + joints,) array
        Result of Pinocchio's recursive Newton-Euler algorithm.
    """

    regressor: Floats
    pinocchio: Floats


def structure(robot: Robot, base: Base = Base.FREE) -> Structure:
    """Return which part of a robot's parameters can be identified."""
    regressor = stacked_regressor(robot, massive_bodies(robot), base, np.random.default_rng(SEED))
    length = np.linalg.norm(regressor, axis=0)
    values = np.linalg.svd(regressor / np.where(length > 0.0, length, 1.0), compute_uv=False)
    return Structure(robot, base_parameters(robot, base=base), values / values[0], standard_parameters(robot))


def standard_parameters(robot: Robot) -> Floats:
    """Return the linear parameters of all bodies, in the order of `BaseParameters.standard`."""
    return np.concatenate([robot.link(body).inertial.vector for body in massive_bodies(robot)])


def equations_at(robot: Robot, rng: np.random.Generator) -> Equations:
    """Evaluate (23) in a random state of the robot on which no wrench acts."""
    position, velocity, acceleration = rng.normal(size=(3, 1, len(robot.joints)))
    motion = kinematics(robot, JointState(position, velocity, acceleration))
    rate = rng.normal(size=(1, 3))
    change, lift = consistent_accelerations(robot, motion, rate, np.zeros((1, 6)))
    regressor = torque_regressor(robot, massive_bodies(robot), motion, rate, change, lift)[0]
    expected = pin.rnea(
        robot.model,
        robot.model.createData(),
        configuration(robot, position[0]),
        np.concatenate([np.zeros(3), rate[0], velocity[0]]),
        np.concatenate([lift[0], change[0], acceleration[0]]),
    )
    return Equations(regressor @ standard_parameters(robot), expected)
