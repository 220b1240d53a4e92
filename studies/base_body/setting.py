"""ETS-VII, the paper's manoeuvre and a poor neighbour of it, and recordings simulated without noise."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bayesid.recording.joint_motion import Excitation, sample_joints
from bayesid.recording.recording import Recording
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.sensors import Kind
from studies.base_body import paper

__all__ = [
    "BASE",
    "INTERVAL",
    "POOR",
    "blank",
    "excitation",
    "extended_wrist",
    "heavy_arm",
    "limits_broken",
    "ship",
    "slowest",
    "tip_speed",
]

Floats = NDArray[np.float64]

BASE = "base_link"

PERIOD, RAMP, PERIODS = 30.0, 30.0, 2
"""Of the fast manoeuvre [s]; the base then turns with 8 mrad/s at most."""

INTERVAL = 0.5
"""Between samples [s]."""

POOR = np.array([0.68, -0.03, 1.04, -0.53, 1.17, -0.37])
"""Found by Nelder-Mead from the best of 150 random manoeuvres within the paper's joint limits, for the least rate about
z against the lesser of the other two: joint 1, which turns about z, almost rests."""

TIP_SPEED, TIP_RATE = 0.05, np.radians(5.0)
"""What was allowed on ETS-VII [m/s, rad/s]."""


def ship() -> Robot:
    """Return ETS-VII."""
    return Robot.shipped("ets7")


def heavy_arm(robot: Robot, ratio: float = 1.0 / 7.0) -> Robot:
    """Scale the arm's masses and inertias until links 2 to 6, the paper's 1/25, are this fraction of the base."""
    arm = {name: link.inertial for name, link in robot.links.items() if name != BASE and link.inertial.mass > 0.0}
    factor = ratio * robot.link(BASE).inertial.mass / sum(own.mass for name, own in arm.items() if name != "link1")
    for name, own in arm.items():
        robot = robot.with_inertial(name, InertialParameters(factor * own.mass, own.com, factor * own.inertia))
    return robot


@cache
def extended_wrist() -> tuple[float, float, float]:
    """Return joints 4 to 6 with the tip farthest from the elbow; of two mirror images the one nearer zero.

    The distance depends on neither shoulder nor elbow, nor on joint 6, whose axis goes through the tip.
    """

    def minus_reach(wrist: Floats) -> float:
        rest = np.array([[0.0, 0.0, 0.0, *wrist, 0.0]])
        joints = kinematics(ship(), JointState(rest, 0.0 * rest, 0.0 * rest)).pose[0]
        return -float(np.linalg.norm(_tip(joints[None])[0] - joints[2, :3, 3]))

    found = minimize(minus_reach, [-0.5, -0.4], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-14}).x
    return float(found[0]), float(found[1]), 0.0


def excitation(q: Floats, slow: float = 1.0) -> Excitation:
    """Return the excitation (27) of the first three joints with the wrist extended, ``slow`` times slower.

    Parameters
    ----------
    q : (6,) array
        q1 and q2 of joint 1, of joint 2, of joint 3 [rad].
    """
    wrist = np.array(extended_wrist())
    return Excitation(
        offset=np.concatenate([q[0::2], wrist]),
        amplitude=np.concatenate([q[1::2], np.zeros(3)]),
        frequency=2.0 * np.pi / (slow * PERIOD),
        periods=PERIODS,
        ramp=slow * RAMP,
        start=np.concatenate([np.zeros(3), wrist]),
    )


def tip_speed(motion: Excitation) -> tuple[float, float]:
    """Largest speed [m/s] and turning rate [rad/s] of the tip relative to the base."""
    state = motion.evaluate(np.linspace(0.0, motion.duration, 400))
    moving = kinematics(ship(), state)
    turning = moving.rate[:, -1, :3, :3]
    # two entries of the matrix w x R for each of w's in its norm
    return float(np.linalg.norm(_tip(moving.rate), axis=1).max()), float(
        np.linalg.norm(turning, axis=(1, 2)).max() / np.sqrt(2.0)
    )


def slowest(q: Floats) -> float:
    """How many times slower the manoeuvre must be to stay within what was allowed on ETS-VII."""
    speed, rate = tip_speed(excitation(q))
    return max(speed / TIP_SPEED, rate / TIP_RATE)


def blank(
    motion: Excitation, kinds: Sequence[Kind], robot: Robot | None = None, interval: float = INTERVAL
) -> Recording:
    """Return a planned recording: the sensors' sample times, and the joints' positions if a robot is given."""
    time = np.arange(0.0, motion.duration + 1e-9, interval)
    channels = {
        f"{kind.value}.{axis}": np.full(len(time), 1.0 if axis == "w" else 0.0)
        for kind in kinds
        for axis in ("xyzw" if kind is Kind.ATTITUDE else "xyz")
    }
    joints = {} if robot is None else sample_joints(motion, robot, time)
    return Recording("manoeuvre", None, time, {**joints, **channels})


def limits_broken(q: Floats = paper.EXCITATION) -> list[tuple[int, float, float]]:
    """Joints (from 1) whose oscillation leaves the paper's own limits, with their lowest and highest position."""
    ends = [(index + 1, q1 - abs(q2), q1 + abs(q2)) for index, (q1, q2) in enumerate(q.reshape(-1, 2))]
    return [end for end in ends if max(-end[1], end[2]) > paper.LIMIT]


def _tip(pose: NDArray[np.floating]) -> Floats:
    """Position of the tip from poses of the joints (T, joints, 4, 4): 0.53 m along the axis of joint 6."""
    tip: Floats = pose[:, -1] @ np.array([0.0, 0.0, 0.53, 1.0])
    return tip[:, :3]
