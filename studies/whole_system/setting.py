"""The case: ETS-VII carrying a load, what its maker's drawings say of every body, and its sensors."""

from __future__ import annotations

import numpy as np

from bayesid import BodyPrior, InertialParameters, Model, Robot
from bayesid.robot.robot import Load
from bayesid.simulation.effects import JointFriction
from bayesid.simulation.joint_torques import TorqueSensor
from studies.common.ets7 import BASE, ets7
from studies.common.models import ARM_SPREAD, guess_about, orbiting_model

__all__ = ["LOAD", "bodies", "drawn", "groups", "model_of", "spreads", "true_robot"]

LOAD, HAND = "load", "link6"  # name of the load, and link that carries it

# relative widths of the priors in log-Cholesky coordinates: links of the arm known from drawings, to 5 % of each mass
# as in all studies, a base that has used some of its fuel, and a load
ARM, BASE_SPREAD, LOAD_SPREAD = ARM_SPREAD, 0.3, 1.0

TORQUE = 0.1  # noise per sample of the joint torques [N m]
COULOMB, VISCOUS = 1.5, 8.0  # true friction of every joint, dry and viscous [N m, N m s]


def true_robot() -> Robot:
    """Return the robot as it truly is: the published one, holding a load of 120 kg."""
    body = InertialParameters(120.0, [0.05, -0.1, 0.45], np.diag([14.0, 11.0, 9.0]))
    return ets7().with_load(Load(LOAD, HAND, body))


def bodies(robot: Robot) -> tuple[str, ...]:
    """Return the names of the bodies with mass."""
    return tuple(name for name, link in robot.links.items() if link.inertial.mass > 0.0)


def groups(robot: Robot) -> dict[str, tuple[str, ...]]:
    """Return the four groups of bodies whose masses are reported, each with the names of its bodies."""
    names = bodies(robot)
    arm = tuple(name for name in names if name not in (BASE, LOAD))
    return {"base": (BASE,), "load": (LOAD,), "arm": arm, "whole system": names}


def spreads(robot: Robot) -> dict[str, float]:
    """Return the width of the prior of every body."""
    return {name: {BASE: BASE_SPREAD, LOAD: LOAD_SPREAD}.get(name, ARM) for name in bodies(robot)}


def drawn(truth: Robot, seed: int) -> Robot:
    """Return the drawings: every body such that the truth is a draw of the prior about it."""
    rng, robot = np.random.default_rng(seed), truth
    for name, spread in spreads(truth).items():
        robot = robot.with_inertial(name, guess_about(truth.link(name).inertial, spread, rng))
    return robot


def model_of(robot: Robot, *, torques: bool = False) -> Model:
    """Return the model with all bodies unknown.

    Parameters
    ----------
    robot : Robot
        The drawings, on which the priors are centred.
    torques : bool
        True if the joint torques are measured; friction in every joint is then unknown.
    """
    priors = [BodyPrior(name, robot.link(name).inertial, spread) for name, spread in spreads(robot).items()]
    if not torques:
        return orbiting_model(robot, priors)
    joints = tuple(joint.name for joint in robot.joints)
    sensor = TorqueSensor(joints, (TORQUE,) * len(joints))
    return orbiting_model(robot, priors, *(JointFriction(joint) for joint in joints), torque=sensor)
