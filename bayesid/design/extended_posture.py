"""Where the joints that the paper's excitation does not move are put: the arm beyond the others extended."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from bayesid._math.arrays import Floats
from bayesid.robot.end_effector import Tip
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot

__all__ = ["extended_posture"]

STARTS = 12
"""Of the search, at random within the ranges; the distance has several local maxima."""

PULL = 1e-6
"""Towards the start, per square of radian or metre: joints that do not matter stay there."""


def extended_posture(robot: Robot, start: Sequence[float] | Floats, free: Sequence[int], last: int, tip: Tip) -> Floats:
    """Return joint positions with the tip farthest from a joint.

    Parameters
    ----------
    start : (joints,) array_like
        Positions of all joints [rad or m].
    free : sequence of int
        Joints that may be placed; of those only the ones between ``last`` and the tip are.
    last : int
        The joint from whose origin the distance is taken.
    tip : Tip

    Returns
    -------
    (joints,) array
    """
    start = np.array(start, dtype=float)
    between = [joint for joint in _chain(robot, tip.joint) if joint in free and joint > last]
    if last not in _chain(robot, tip.joint) or not between:
        return start
    bounds = [_range(robot, joint) for joint in between]
    low, high = np.transpose(bounds)

    def posture(x: Floats) -> Floats:
        q = start.copy()
        q[between] = x
        return q

    def shortness(x: Floats) -> float:
        q = posture(x)[None]
        state = JointState(q, 0.0 * q, 0.0 * q)
        poses = kinematics(robot, state)
        end = tip.motion(robot, state)[0][0]
        away = x - start[between]
        return -float(np.linalg.norm(end[:3, 3] - poses.pose[0, last, :3, 3])) + PULL * float(away @ away)

    rng = np.random.default_rng(0)  # where the search begins is no matter of chance
    begins = [start[between], *(low + (high - low) * rng.uniform(size=(STARTS, len(between))))]
    ends = [minimize(shortness, begin, method="L-BFGS-B", bounds=bounds) for begin in begins]
    return posture(min(ends, key=lambda end: end.fun).x)


def _chain(robot: Robot, joint: int) -> list[int]:
    """Return the joints from one down to the base."""
    chain = []
    while joint >= 0:
        chain.append(joint)
        joint = robot.model.parents[joint + 2] - 2
    return chain


def _range(robot: Robot, index: int) -> tuple[float, float]:
    """Return a joint's range, a turn about zero or a metre where it has none."""
    joint = robot.joints[index]
    reach = 1.0 if joint.kind == "prismatic" else np.pi
    low = joint.lower if np.isfinite(joint.lower) else -reach
    return low, joint.upper if np.isfinite(joint.upper) else max(low, 0.0) + reach
