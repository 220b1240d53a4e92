"""Posture of the joints that the paper's excitation does not move, in which the outer arm is extended."""

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

STARTS = 12  # number of random starts of the search, since the distance has several local maxima
PULL = 1e-6  # penalty on the squared distance from the start [m/rad2, 1/m], so that joints without influence stay there


def extended_posture(robot: Robot, start: Sequence[float] | Floats, free: Sequence[int], last: int, tip: Tip) -> Floats:
    """Return joint positions in which the tip is farthest from a joint.

    Parameters
    ----------
    robot : Robot
        Robot with its joint ranges.
    start : (joints,) array_like
        Positions of all joints at the start [rad or m].
    free : sequence of int
        Indices of the joints that may move; only those between ``last`` and the tip do.
    last : int
        Index of the joint from whose origin the distance is measured.
    tip : Tip
        End-effector.

    Returns
    -------
    (joints,) array
        Positions of all joints [rad or m].
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

    rng = np.random.default_rng(0)  # a fixed seed, so that the posture repeats
    begins = [start[between], *(low + (high - low) * rng.uniform(size=(STARTS, len(between))))]
    ends = [minimize(shortness, begin, method="L-BFGS-B", bounds=bounds) for begin in begins]
    return posture(min(ends, key=lambda end: end.fun).x)


def _chain(robot: Robot, joint: int) -> list[int]:
    """Return the indices of the joints from one joint down to the base."""
    chain = []
    while joint >= 0:
        chain.append(joint)
        joint = robot.model.parents[joint + 2] - 2
    return chain


def _range(robot: Robot, index: int) -> tuple[float, float]:
    """Return a joint's range; ends that it lacks are half a turn or a metre away from zero."""
    joint = robot.joints[index]
    reach = 1.0 if joint.kind == "prismatic" else np.pi
    low = joint.lower if np.isfinite(joint.lower) else -reach
    return low, joint.upper if np.isfinite(joint.upper) else max(low, 0.0) + reach
