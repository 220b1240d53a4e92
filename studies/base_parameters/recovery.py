"""Identification of K_B of (24) from motion and joint torques, and of K_1 from it once K_2 is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bayesid import Robot
from bayesid._math.arrays import Floats
from bayesid.identifiability import base_parameters, consistent_accelerations
from bayesid.identifiability.stacked_regressor import massive_bodies
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import configuration, kinematics
from bayesid.robot.regressors import torque_regressor
from studies.base_parameters.structure import standard_parameters

__all__ = ["Recovery", "identify_by_torques"]

STATES = 60
"""Number of instants at which motion and torques are measured."""

WRONG = 1.05
"""Factor by which the wrong K_2 differs from the true one."""


@dataclass(frozen=True)
class Recovery:
    """Result of a least-squares identification with exact data.

    Attributes
    ----------
    base_error : float
        Largest error of K_B relative to its largest entry of the same unit.
    standard_error : float
        Largest such error of all standard parameters, recovered with the true K_2.
    shifted : tuple
        Name, true value, and value recovered with K_2 wrong by 5 %, of the parameters of K_1 that change most.
    untouched : int
        Number of parameters of K_1 that do not change at all.
    torque_error : float
        Largest error of the torques that the wrong set predicts, by Pinocchio, relative to the largest torque.
    """

    base_error: float
    standard_error: float
    shifted: tuple[tuple[str, float, float], ...]
    untouched: int
    torque_error: float


def identify_by_torques(robot: Robot, rng: np.random.Generator) -> Recovery:
    """Solve (23) for the base parameters, with the torques that Pinocchio gives, and recover the others."""
    base, bodies, p = base_parameters(robot), massive_bodies(robot), standard_parameters(robot)
    state = JointState(*rng.normal(size=(3, STATES, len(robot.joints))))
    rate = 0.1 * rng.normal(size=(STATES, 3))
    motion = kinematics(robot, state)
    change, lift = consistent_accelerations(robot, motion, rate, np.zeros((STATES, 6)))
    regressor = torque_regressor(robot, bodies, motion, rate, change, lift).reshape(-1, len(p))

    def torques(inertias: Floats) -> Floats:
        """Return Pinocchio's wrench on the base and joint torques, one instant after the other."""
        model = robot.model.copy()
        for body, vector in zip(bodies, inertias.reshape(-1, 10), strict=True):
            model.inertias[robot.link(body).joint + 2] = pin.Inertia.FromDynamicParameters(vector)
        data, rows = model.createData(), []
        for row in range(STATES):
            v = np.concatenate([np.zeros(3), rate[row], state.velocity[row]])
            a = np.concatenate([lift[row], change[row], state.acceleration[row]])
            rows.append(pin.rnea(model, data, configuration(robot, state.position[row]), v, a).copy())
        return np.concatenate(rows)

    independent = regressor[:, [base.standard.index(name) for name in base.independent]]
    measured = torques(p)
    grouped = np.linalg.lstsq(independent, measured)[0]
    value = dict(zip(base.standard, p, strict=True))
    second = np.array([value[name] for name in base.dependent])
    recovered, wrong = base.recover(grouped, second), base.recover(grouped, WRONG * second)
    moved = {
        name: (float(p[index]), float(wrong[index]))
        for index, name in enumerate(base.standard)
        if name in base.independent
    }
    order = sorted(moved, key=lambda name: -abs(moved[name][1] - moved[name][0]))
    return Recovery(
        base_error=_relative(grouped, base.project(p), base.independent),
        standard_error=_relative(recovered, p, base.standard),
        shifted=tuple((name, *moved[name]) for name in order[:8]),
        untouched=sum(abs(new - old) < 1e-6 for old, new in moved.values()),
        torque_error=float(np.abs(torques(wrong) - measured).max() / np.abs(measured).max()),
    )


def _relative(values: Floats, true: Floats, names: tuple[str, ...]) -> float:
    """Return the largest error, relative to the largest value of the same kind: mass, first moment, inertia."""
    kinds = np.array([name.split(".")[1] for name in names])
    return max(float(np.abs((values - true)[kinds == k]).max() / np.abs(true[kinds == k]).max()) for k in set(kinds))
