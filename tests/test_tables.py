import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest

from bayesid.robot.composite_tables import composite_rows, link_table
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import configuration, kinematics
from bayesid.robot.robot import Robot

BRANCHED = """<robot name="branched">
  <link name="body"><inertial>
    <mass value="50"/><inertia ixx="5" iyy="6" izz="7"/></inertial></link>
  <link name="boom"><inertial>
    <origin xyz="0.1 0.2 0.3"/><mass value="3"/><inertia ixx="1" iyy="1" izz="0.5"/></inertial></link>
  <link name="hand"><inertial>
    <origin xyz="0 0.1 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial></link>
  <link name="mast"><inertial>
    <origin xyz="0.3 0 0"/><mass value="4"/><inertia ixx="0.2" iyy="0.3" izz="0.4"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="body"/><child link="boom"/>
    <origin xyz="0.5 0 0" rpy="0.3 0.2 0.1"/>
    <axis xyz="0.6 0.8 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="wrist" type="revolute"><parent link="boom"/><child link="hand"/><origin xyz="0 0.4 0.1" rpy="0 1 0"/>
    <axis xyz="0 0.6 -0.8"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="turn" type="continuous"><parent link="body"/><child link="mast"/>
    <origin xyz="0 -0.5 0"/><axis xyz="0 1 0"/></joint>
</robot>"""


ROBOTS = pytest.mark.parametrize("robot", [Robot.shipped("ets7"), Robot.from_string(BRANCHED)], ids=["chain", "tree"])


@ROBOTS
def test_kinematics_are_pinocchios(robot: Robot) -> None:
    """Poses, spatial velocities and spatial accelerations of all joint frames, base at rest."""
    state = JointState(*np.random.default_rng(3).normal(size=(3, 7, len(robot.joints))))
    moved = kinematics(robot, state)
    data = robot.model.createData()
    for row in range(7):
        still = np.zeros(6)
        velocity, acceleration = (np.concatenate([still, part[row]]) for part in state[1:])
        pin.forwardKinematics(robot.model, data, configuration(robot, state.position[row]), velocity, acceleration)
        for joint in range(len(robot.joints)):
            pose = data.oMi[joint + 2].homogeneous
            twist, change = hat(data.v[joint + 2].vector), hat(data.a[joint + 2].vector)
            np.testing.assert_allclose(moved.pose[row, joint], pose, atol=1e-14)
            np.testing.assert_allclose(moved.rate[row, joint], pose @ twist, atol=1e-13)
            np.testing.assert_allclose(moved.acceleration[row, joint], pose @ (change + twist @ twist), atol=1e-12)


def hat(twist):
    """Matrix (4, 4) of a spatial velocity, linear part first."""
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = pin.skew(twist[3:])
    matrix[:3, 3] = twist[:3]
    return matrix


@ROBOTS
def test_traced_tables_are_those_of_numpy(robot: Robot) -> None:
    rng = np.random.default_rng(3)
    state = JointState(*rng.normal(size=(3, 7, len(robot.joints))))

    def rows(*parts):  # tracing is what chooses the code in JAX
        moved = kinematics(robot, JointState(*parts))
        return moved, composite_rows(robot, moved), link_table(robot, list(robot.links)[-1], moved)

    traced = jax.jit(rows)(*(jnp.asarray(part) for part in state))
    for ours, plain in zip(jax.tree.leaves(traced), jax.tree.leaves(rows(*state)), strict=True):
        np.testing.assert_allclose(ours, plain, rtol=1e-12, atol=1e-12 * np.abs(plain).max())
