"""The cases: what is unknown, who makes the data, and how wide the priors are."""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum
from functools import cache

import numpy as np

from bayesid import BodyPrior, Model, Robot, SensorKind
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Load
from studies.common.ets7 import ACCEL, BASE, RATE, ets7
from studies.common.models import ARM_SPREAD, base_model

__all__ = ["BASE_SPREAD", "INDEPENDENT", "REPLICATES", "Case", "model_of"]

BASE_SPREAD, LOAD_SPREAD, DRAWINGS_SPREAD = 0.3, 0.3, 0.05
"""Relative widths of the priors of base and load (their masses are uncertain by a factor of 1.8) and, where the whole
system is unknown, of the links. The default width of 1 would draw bases of a tenth of the mass and of ten times it."""

START_RATE = 1e-3
"""Standard deviation of each axis of the initial rate [rad/s]."""

LOAD = Load("load", "link6", InertialParameters(120.0, [0.05, -0.1, 0.45], np.diag([14.0, 11.0, 9.0])))
"""Load in the hand where the whole system is unknown."""


class Case(StrEnum):
    """One kind of replicate."""

    BASE = "base body"
    EXACT = "base body, joints known exactly"
    ARM = "base body, arm known to 5 %"
    WHOLE = "whole system"
    AROUND = "base body, around one data set"
    MUJOCO = "MuJoCo, ETS-VII"
    MUJOCO_REST = "MuJoCo, ETS-VII from rest"
    PLANAR = "MuJoCo, planar robot"
    PLANAR_REST = "MuJoCo, planar robot from rest"


REPLICATES = {
    Case.BASE: 1000,
    Case.EXACT: 200,
    Case.ARM: 300,
    Case.WHOLE: 200,
    Case.AROUND: 100,
    Case.MUJOCO: 100,
    Case.MUJOCO_REST: 100,
    Case.PLANAR: 100,
    Case.PLANAR_REST: 100,
}
"""Number of replicates of each case in the full study."""

INDEPENDENT = (Case.MUJOCO, Case.MUJOCO_REST, Case.PLANAR, Case.PLANAR_REST)
"""Cases whose data MuJoCo makes; the package itself makes those of the others."""

AT_REST = (Case.MUJOCO_REST, Case.PLANAR_REST)


@cache
def model_of(case: Case) -> Model:
    """Return the model of a case: ETS-VII or the planar robot, its sensors and its priors."""
    robot = Robot.shipped("planar") if case in (Case.PLANAR, Case.PLANAR_REST) else ets7()
    robot = robot.with_load(LOAD) if case is Case.WHOLE else robot
    model = base_model(
        {SensorKind.RATE: RATE, SensorKind.ACCEL: ACCEL},
        robot=robot,
        base_spread=BASE_SPREAD,
        arm_spread=ARM_SPREAD if case is Case.ARM else 0.0,
        rate_sigma=0.0 if case in AT_REST else START_RATE,
    )
    return replace(model, priors=_whole(robot)) if case is Case.WHOLE else model


def _whole(robot: Robot) -> tuple[BodyPrior, ...]:
    """Return priors of all bodies with mass."""
    widths = {BASE: BASE_SPREAD, LOAD.name: LOAD_SPREAD}
    return tuple(
        BodyPrior(name, link.inertial, widths.get(name, DRAWINGS_SPREAD))
        for name, link in robot.links.items()
        if link.inertial.mass > 0.0
    )
