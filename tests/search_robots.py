"""Three robots for searches: ETS-VII, the planar table, and one of four joints that no other test knows."""

from __future__ import annotations

import numpy as np

from bayesid.design import BSplines, DOptimal, EOptimal, Limits, Plan, Problem, Tip
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import create
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensor, SensorKind, White

SENSORS = (Sensor(SensorKind.RATE, White(1e-5)), Sensor(SensorKind.ACCEL, White(1e-5), position=(0.4, 0.3, 0.8)))
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0")


def four_joints() -> Robot:
    """A base of 400 kg with an arm of four links of 12 kg."""
    parts = [
        '<link name="base_link"><inertial><origin xyz="0.1 0 -0.05"/><mass value="400"/>'
        '<inertia ixx="120" iyy="150" izz="90" ixy="3" ixz="0" iyz="-2"/></inertial></link>'
    ]
    for index, axis in enumerate(AXES):
        parent, place = ("base_link", "0.6 0.1 0.4") if index == 0 else (f"part{index}", "0.5 0 0")
        parts.append(
            f'<link name="part{index + 1}"><inertial><origin xyz="0.25 0 0.02"/><mass value="12"/>'
            '<inertia ixx="0.1" iyy="0.4" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="joint{index + 1}" type="revolute"><parent link="{parent}"/><child link="part{index + 1}"/>'
            f'<origin xyz="{place}"/><axis xyz="{axis}"/>'
            '<limit lower="-2" upper="2" effort="1" velocity="0.3"/></joint>'
        )
    return Robot.from_string(f'<robot name="four">{"".join(parts)}</robot>')


def search_problem(name: str, points: int = 8, duration: float = 120.0) -> Problem:
    """Return the problem of one of the robots, with its base to identify to first order from a prior of 10 %."""
    robot = four_joints() if name == "four" else Robot.shipped(name)
    base = BodyPrior(robot.base, robot.link(robot.base).inertial, 0.1)
    model = Model(robot, SENSORS, (base,), effects=(create("accel-bias"),), rate_sigma=1e-4)
    start = np.resize([0.0, -0.6, 1.0, -0.4, 0.3, 0.0], len(robot.joints))
    family = BSplines(start, range(len(start)), duration, points)
    plan = Plan(model, family, 0.5, Tip.of(robot), step=2.0, thinning=2)
    return Problem(plan, Limits(tip_speed=0.05, tip_rate=0.0873), (DOptimal(), EOptimal()))
