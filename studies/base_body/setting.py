"""The paper's manoeuvre and a poorly exciting one, the robot's limits along them, and an arm with more mass."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design.designed import sample_times
from bayesid.inference.simulated_recordings import blank_channels
from bayesid.recording.joint_motion import Excitation
from bayesid.recording.recording import Recording
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from studies.base_body import paper
from studies.common.ets7 import BASE, INTERVAL, TIP_RATE, TIP_SPEED, excitation, tip_speed

__all__ = ["POOR", "heavy_arm", "limits_broken", "planned", "slowest"]

POOR = np.array([0.68, -0.03, 1.04, -0.53, 1.17, -0.37])
"""Excitation that hardly turns the base about z, since joint 1, which turns about z, almost rests [rad].

Nelder-Mead sought the smallest rate about z relative to the smaller of the other two, within the paper's joint limits,
from the best of 150 random manoeuvres.
"""


def heavy_arm(robot: Robot, ratio: float = 1.0 / 7.0) -> Robot:
    """Return the robot with all masses and inertias of the arm scaled until links 2 to 6 have this share of the base.

    Links 2 to 6 are what the paper counts as 1/25 of the base.
    """
    arm = {name: link.inertial for name, link in robot.links.items() if name != BASE and link.inertial.mass > 0.0}
    factor = ratio * robot.link(BASE).inertial.mass / sum(body.mass for name, body in arm.items() if name != "link1")
    for name, body in arm.items():
        robot = robot.with_inertial(name, InertialParameters(factor * body.mass, body.com, factor * body.inertia))
    return robot


def slowest(q: Floats) -> float:
    """Return how many times slower the excitation ``q`` must be to stay within the flight rules of ETS-VII."""
    motion = excitation(q)
    speed, rate = tip_speed(motion, motion.duration)
    return max(speed / TIP_SPEED, rate / TIP_RATE)


def planned(model: Model, motion: Excitation) -> Manoeuvre:
    """Return a manoeuvre with exact joints, whose recording holds placeholder samples of the model's sensors."""
    time = sample_times(motion.duration, INTERVAL)
    return Manoeuvre(Recording("manoeuvre", None, time, blank_channels(model.sensors, len(time))), motion)


def limits_broken(q: Floats = paper.EXCITATION) -> list[tuple[int, float, float]]:
    """Return joints (from 1) that leave the paper's limits, each with its lowest and highest position [rad]."""
    ends = [(index + 1, q1 - abs(q2), q1 + abs(q2)) for index, (q1, q2) in enumerate(q.reshape(-1, 2))]
    return [end for end in ends if max(-end[1], end[2]) > paper.LIMIT]
