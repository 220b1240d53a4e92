"""The case: ETS-VII carrying a load, what its maker's drawings say of every body, and its sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesid import BodyPrior, InertialParameters, Kind, Model, Orbit, Robot, Sensor, White
from bayesid.robot.robot import Load
from bayesid.simulation.effects import Effect, GravityGradient, JointFriction
from bayesid.simulation.joint_torques import TorqueSensor
from studies.common.ets7 import ACCEL, ACCELEROMETER, BASE, RADIUS, RATE, ets7
from studies.common.guesses import guess_about

__all__ = ["LOAD", "bodies", "drawn", "friction_effects", "model_of", "spreads", "true_robot"]

Floats = NDArray[np.floating]

LOAD, HAND = "load", "link6"

ARM, BASE_SPREAD, LOAD_SPREAD = 0.05, 0.3, 1.0
"""Relative widths of the priors in log-Cholesky coordinates: drawings of the arm, a base partly out of fuel, a load."""

TORQUE = 0.1
"""Noise per sample of the joint torques [N m]."""

COULOMB, VISCOUS = 1.5, 8.0
"""True friction of every joint [N m, N m s]."""


def true_robot() -> Robot:
    """Return what is really there: the published robot, holding a load of 120 kg."""
    body = InertialParameters(120.0, [0.05, -0.1, 0.45], np.diag([14.0, 11.0, 9.0]))
    return ets7().with_load(Load(LOAD, HAND, body))


def spreads(robot: Robot) -> dict[str, float]:
    """Return the prior's width of every body."""
    return {name: {BASE: BASE_SPREAD, LOAD: LOAD_SPREAD}.get(name, ARM) for name in bodies(robot)}


def bodies(robot: Robot) -> tuple[str, ...]:
    """Return the names of the bodies with mass."""
    return tuple(name for name, link in robot.links.items() if link.inertial.mass > 0.0)


def drawn(truth: Robot, seed: int) -> Robot:
    """Return the drawings: every body such that the truth is a draw of the prior about it."""
    rng = np.random.default_rng(seed)
    robot = truth
    for name, spread in spreads(truth).items():
        robot = robot.with_inertial(name, guess_about(truth.link(name).inertial, spread, rng))
    return robot


def friction_effects(robot: Robot) -> tuple[Effect, ...]:
    """Return friction in every joint."""
    return tuple(JointFriction(joint.name) for joint in robot.joints)


def model_of(robot: Robot, *, known: Sequence[str] = (), torques: bool = False) -> Model:
    """Return the model of the whole system as unknown.

    Parameters
    ----------
    robot : Robot
        The drawings, on which the priors centre.
    known : sequence of str
        Bodies taken for exactly known.
    torques : bool
        Whether joint torques are measured, and friction unknown.
    """
    priors = tuple(
        BodyPrior(name, robot.link(name).inertial, spread)
        for name, spread in spreads(robot).items()
        if name not in known
    )
    model = Model(
        robot,
        (Sensor(Kind.RATE, White(RATE)), Sensor(Kind.ACCEL, White(ACCEL), position=ACCELEROMETER)),
        priors,
        Orbit(RADIUS),
        (GravityGradient(),),
    )
    if not torques:
        return model
    joints = tuple(joint.name for joint in robot.joints)
    sensor = TorqueSensor(joints, (TORQUE,) * len(joints))
    return replace(model, torque=sensor, effects=(*model.effects, *friction_effects(robot)))
