"""The regressors against Pinocchio, a finite difference and a sum over the bodies written out."""

from __future__ import annotations

import jax
import numpy as np
import pinocchio as pin
import pytest

from bayesid.robot.composite_tables import link_table
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import configuration, kinematics
from bayesid.robot.regressors import balance_regressor, gradient_regressor, momentum_regressor, torque_regressor
from bayesid.robot.robot import Robot
from tests.trees import random_tree

TREES = {
    "chain": (("revolute", "revolute", "revolute"), 0),
    "mixed": (("revolute", "prismatic", "continuous", "fixed", "revolute"), 2),
    "sliding": (("prismatic", "fixed", "prismatic", "continuous"), 1),
    "lone": ((), 1),
}
TIMES = 4


class Case:
    """A random robot in random states of motion, and the same robot as Pinocchio reads it, loads and all."""

    def __init__(self, name: str) -> None:
        kinds, loads = TREES[name]
        rng = np.random.default_rng(len(name))
        self.robot = random_tree(kinds, rng, loads=loads)
        self.state = JointState(*rng.normal(size=(3, TIMES, len(self.robot.joints))))
        self.motion = kinematics(self.robot, self.state)
        self.rate, self.change, self.acceleration, self.velocity = rng.normal(size=(4, TIMES, 3))
        self.bodies = list(self.robot.links)
        self.p = np.concatenate([self.robot.link(body).inertial.vector for body in self.bodies])
        self.model = pin.buildModelFromXML(self.robot.to_urdf(), pin.JointModelFreeFlyer())
        self.model.gravity.setZero()
        self.data = self.model.createData()

    @property
    def tables(self) -> np.ndarray:
        return np.concatenate([link_table(self.robot, body, self.motion) for body in self.bodies], axis=2)

    def q(self, row: int) -> np.ndarray:
        return configuration(self.robot, self.state.position[row])

    def v(self, row: int) -> np.ndarray:
        return np.concatenate([self.velocity[row], self.rate[row], self.state.velocity[row]])

    def a(self, row: int) -> np.ndarray:
        """Pinocchio's base acceleration is a spatial one; ours is that of the base origin."""
        spatial = self.acceleration[row] - np.cross(self.rate[row], self.velocity[row])
        return np.concatenate([spatial, self.change[row], self.state.acceleration[row]])


@pytest.fixture(scope="module", params=TREES)
def case(request: pytest.FixtureRequest) -> Case:
    return Case(request.param)


def test_torques_are_those_of_recursive_newton_euler(case):
    regressor = torque_regressor(case.robot, case.bodies, case.motion, case.rate, case.change, case.acceleration)
    for row in range(TIMES):
        expected = pin.rnea(case.model, case.data, case.q(row), case.v(row), case.a(row))
        np.testing.assert_allclose(regressor[row] @ case.p, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())
    balance = balance_regressor(case.tables, case.rate, case.change, case.acceleration)
    np.testing.assert_allclose(regressor[:, :6], balance, rtol=1e-13, atol=1e-13)


def test_torque_regressor_is_pinocchios_column_by_column():
    """With the links' own axes at the joints, as URDF has them; the load is left to the test above."""
    case = Case("chain")
    regressor = torque_regressor(case.robot, case.bodies, case.motion, case.rate, case.change, case.acceleration)
    for row in range(TIMES):
        expected = pin.computeJointTorqueRegressor(case.model, case.data, case.q(row), case.v(row), case.a(row))
        np.testing.assert_allclose(regressor[row], expected, rtol=1e-10, atol=1e-11)


def test_traced_arrays_give_the_same():
    case = Case("mixed")
    base = (case.rate, case.change, case.acceleration)

    @jax.jit
    def of_joints(*parts):
        return torque_regressor(case.robot, case.bodies, kinematics(case.robot, JointState(*parts)), *base)

    @jax.jit
    def of_base(*parts):
        return torque_regressor(case.robot, case.bodies, case.motion, *parts)

    expected = torque_regressor(case.robot, case.bodies, case.motion, *base)
    assert isinstance(expected, np.ndarray)
    for traced in (of_joints(*case.state), of_base(*base)):
        np.testing.assert_allclose(traced, expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max())


def test_a_fixed_base_in_gravity():
    case, gravity = Case("mixed"), np.array([1.0, -2.0, -9.0])
    model = pin.buildModelFromXML(case.robot.to_urdf())
    model.gravity.linear = gravity
    still = np.zeros((TIMES, 3))
    regressor = torque_regressor(case.robot, case.bodies, case.motion, still, still, still - gravity)
    for row in range(TIMES):
        q, v, a = case.q(row)[7:], case.state.velocity[row], case.state.acceleration[row]
        expected = pin.rnea(model, model.createData(), q, v, a)
        np.testing.assert_allclose(regressor[row, 6:] @ case.p, expected, rtol=1e-10, atol=1e-10)


def test_momentum_is_pinocchios(case):
    momentum = momentum_regressor(case.tables, case.rate, case.velocity) @ case.p
    for row in range(TIMES):
        central = pin.computeCentroidalMomentum(case.model, case.data, case.q(row), case.v(row))
        # base axes are the world's here, and the base origin the world's
        com = pin.centerOfMass(case.model, case.data, case.q(row))
        about_origin = central.angular + np.cross(com, central.linear)
        np.testing.assert_allclose(momentum[row], [*central.linear, *about_origin], rtol=1e-11, atol=1e-11)


def test_the_change_of_momentum_is_the_balance(case):
    """In inertial axes, about a point that rests where the base origin is, by central differences of each column."""
    step, joints = 1e-5, case.state
    balance = balance_regressor(case.tables, case.rate, case.change, case.acceleration)
    moved = []
    for sign in (-1.0, 1.0):
        dt = sign * step
        position = joints.position + dt * joints.velocity + 0.5 * dt**2 * joints.acceleration
        motion = kinematics(case.robot, JointState(position, joints.velocity + dt * joints.acceleration, joints[2]))
        tables = np.concatenate([link_table(case.robot, body, motion) for body in case.bodies], axis=2)
        turned = np.array([pin.exp3(dt * w + 0.5 * dt**2 * c) for w, c in zip(case.rate, case.change, strict=True)])
        spatial = case.acceleration - np.cross(case.rate, case.velocity)
        velocity = case.velocity + dt * spatial  # in base axes
        momentum = momentum_regressor(tables, case.rate + dt * case.change, velocity).swapaxes(1, 2)
        linear, angular = (part @ turned.swapaxes(1, 2) for part in np.split(momentum, 2, axis=2))
        shift = (dt * case.velocity)[:, None]  # of the base origin; what is of second order cancels
        moved.append(np.concatenate([linear, angular + np.cross(shift, linear)], axis=2).swapaxes(1, 2))
    np.testing.assert_allclose((moved[1] - moved[0]) / (2.0 * step), balance, rtol=1e-7, atol=1e-7)


def test_the_gradient_acts_on_every_body(case):
    zenith, gradient = np.array([0.6, 0.0, 0.8]), 1.2
    regressor = gradient_regressor(case.tables, np.tile(zenith, (TIMES, 1)), gradient)
    for row in range(TIMES):
        pin.forwardKinematics(case.model, case.data, case.q(row))
        force, torque = np.zeros((2, 3))
        for place, body in list(zip(case.data.oMi, case.model.inertias, strict=True))[1:]:
            position, tensor = place.act(body.lever), place.rotation @ body.inertia @ place.rotation.T
            own = body.mass * gradient * (3.0 * zenith * (zenith @ position) - position)
            force += own
            torque += np.cross(position, own) + 3.0 * gradient * np.cross(zenith, tensor @ zenith)
        np.testing.assert_allclose(regressor[row] @ case.p, [*force, *torque], rtol=1e-11, atol=1e-11)


def test_no_joints_no_torques():
    body = '<inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    robot = Robot.from_string(f'<robot name="r"><link name="b">{body}</link></robot>')
    still = np.zeros((1, 3))
    motion = kinematics(robot, JointState(*np.zeros((3, 1, 0))))
    regressor = torque_regressor(robot, ["b"], motion, still, still, still + 1.0)
    assert regressor.shape == (1, 6, 10)
    np.testing.assert_allclose(regressor[0] @ robot.link("b").inertial.vector, [2.0, 2.0, 2.0, 0.0, 0.0, 0.0])
