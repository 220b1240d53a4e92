"""The scale of the masses: lost in motion alone, found by every action that is known and not zero."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bayesid.identifiability import base_parameters
from bayesid.identifiability.base_parameters import massive_bodies, random_motion
from bayesid.robot.composite_tables import link_table
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import configuration, kinematics
from bayesid.robot.regressors import balance_regressor, gradient_regressor, torque_regressor
from bayesid.robot.robot import Robot
from studies.common.mass_scale import consistent_accelerations, determined, rates_at_rest
from studies.truth.stepwise import Reference
from tests.trees import random_tree

TIMES = 60


class Case:
    """Random states of a random robot that satisfy its equations of motion."""

    def __init__(self, kinds: tuple[str, ...] = ("revolute", "prismatic", "revolute"), loads: int = 0) -> None:
        self.rng = np.random.default_rng(9)
        self.robot = random_tree(kinds, self.rng, loads=loads)
        self.bodies = massive_bodies(self.robot)
        self.base = base_parameters(self.robot)
        self.p = np.concatenate([self.robot.link(body).inertial.vector for body in self.bodies])
        self.motion = random_motion(self.robot, TIMES, self.rng)
        self.tables = np.concatenate([link_table(self.robot, body, self.motion) for body in self.bodies], axis=2)
        self.rate = self.rng.normal(size=(TIMES, 3))

    def equations(self, wrench=0.0, *, joints: bool = False, zenith=None, rate=None) -> np.ndarray:
        """Left side of what is measured, when this external wrench and perhaps the gravity gradient acts."""
        rate = self.rate if rate is None else rate
        wrench = np.zeros((TIMES, 6)) + wrench
        accelerations = consistent_accelerations(self.robot, self.motion, rate, wrench, zenith, 0.8)
        if joints:
            left = torque_regressor(self.robot, self.bodies, self.motion, rate, *accelerations)
        else:
            left = balance_regressor(self.tables, rate, *accelerations)
        if zenith is not None:
            left = left - gradient_regressor(self.tables, zenith, 0.8)
        np.testing.assert_allclose(left[:, :6] @ self.p, wrench, atol=1e-10 * np.abs(self.p).max())
        return left.reshape(-1, len(self.p))

    def known(self, body: str) -> np.ndarray:
        return np.eye(len(self.p))[10 * self.bodies.index(body) :][:10]


@pytest.fixture(scope="module")
def case() -> Case:
    return Case()


def test_motion_alone_lacks_the_scale(case):
    found = determined(case.base, case.equations())
    grouped = case.base.project(case.p)
    assert found.rank == case.base.count - 1
    assert found.leaves_open(grouped)
    assert abs(found.undetermined[:, 0] @ grouped) == pytest.approx(np.linalg.norm(grouped), rel=1e-10)
    assert found.gap[0] > 1e-4
    assert found.gap[1] < 1e-13


def test_also_from_rest(case):
    rate = rates_at_rest(case.robot, case.motion)
    found = determined(case.base, case.equations(rate=rate))
    assert found.rank == case.base.count - 1
    assert found.leaves_open(case.base.project(case.p))


def test_the_gravity_gradient_does_not_help(case):
    zenith = case.rng.normal(size=(TIMES, 3))
    zenith /= np.linalg.norm(zenith, axis=1)[:, None]
    found = determined(case.base, case.equations(zenith=zenith))
    assert found.rank == case.base.count - 1
    assert found.leaves_open(case.base.project(case.p))


def test_known_actions_restore_it(case):
    wheel = np.array([3.0, -1.0, 2.0])
    pulse, thrust = np.zeros((2, TIMES, 6))
    pulse[:, 3:] = -np.cross(case.rate, wheel)
    pulse[7, 3:] -= [0.5, 0.1, 0.2]  # the wheels speed up
    thrust[5, 0] = 1.0  # once
    for left in (
        case.equations(joints=True),
        case.equations(pulse),
        case.equations(thrust),
        np.concatenate([case.equations(), case.known("body")]),
    ):
        found = determined(case.base, left)
        assert found.rank == case.base.count
        assert not found.leaves_open(case.base.project(case.p))


def test_a_known_load_on_an_unknown_link_does_not():
    """It weighs as much as the link is unknown: only what both weigh together is seen."""
    case = Case(("revolute",), loads=1)
    left = np.concatenate([case.equations(), case.known("load1")])
    assert determined(case.base, left).leaves_open(case.base.project(case.p))


def test_what_never_moves_stays_open():
    """Both joints of the planar robot turn about z: from rest, alone, it moves in a plane and shows little else."""
    robot = Robot.shipped("planar")
    bodies, base = massive_bodies(robot), base_parameters(robot)
    motion = random_motion(robot, TIMES, np.random.default_rng(1))
    rate = rates_at_rest(robot, motion)
    np.testing.assert_allclose(rate[:, :2], 0.0, atol=1e-12)
    accelerations = consistent_accelerations(robot, motion, rate, np.zeros((TIMES, 6)))
    left = torque_regressor(robot, bodies, motion, rate, *accelerations)
    found = determined(base, left[:, :6].reshape(-1, 30))
    assert found.rank < 20
    assert found.leaves_open(base.project(np.concatenate([robot.link(body).inertial.vector for body in bodies])))


def test_accelerations_are_those_of_the_reference(tmp_path):
    """The step-by-step reference solves Pinocchio's joint-space inertia and bias."""
    rng = np.random.default_rng(6)
    robot = random_tree(("revolute", "prismatic"), rng, chain=True)
    robot.write_urdf(tmp_path / "robot.urdf")
    state = rng.normal(size=(3, 2))
    rate, force, torque = rng.normal(size=(3, 3))
    own = Reference(
        tmp_path / "robot.urdf",
        lambda time: tuple(state),
        zenith=None,
        wheel=np.zeros(3),
        base_force=lambda time: force,
        base_torque=lambda time: torque,
    )
    spatial = own.acceleration(0.0, np.array([0, 0, 0, 0, 0, 0, 1.0, 0, 0, 0, *rate]), 0.0)
    motion = kinematics(robot, JointState(*state[:, None]))
    change, acceleration = consistent_accelerations(robot, motion, rate[None], np.array([[*force, *torque]]))
    np.testing.assert_allclose(np.concatenate([acceleration[0], change[0]]), spatial, rtol=1e-10)


def test_at_rest_there_is_no_momentum():
    rng = np.random.default_rng(6)
    robot = random_tree(("revolute", "prismatic", "continuous"), rng)
    state = JointState(*rng.normal(size=(3, 2, 3)))
    rate = rates_at_rest(robot, kinematics(robot, state))
    model = pin.buildModelFromXML(robot.to_urdf(), pin.JointModelFreeFlyer())
    data = model.createData()
    for row in range(2):
        v = np.concatenate([np.zeros(3), rate[row], state.velocity[row]])
        momentum = pin.computeCentroidalMomentum(model, data, configuration(robot, state.position[row]), v)
        np.testing.assert_allclose(momentum.angular, 0.0, atol=1e-11)
