"""Robots read from and written to URDF, with Pinocchio and the MuJoCo generator's own parser as witnesses."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest

from bayesid._io.errors import InputError
from bayesid.robot.body_prior import BodyPrior, coordinates_of
from bayesid.robot.composite_tables import ENTRIES, link_table
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Load, Robot
from studies.truth import mujoco as mj

ROOT = Path(__file__).resolve().parents[1]
ROBOTS = {
    "ets7": ROOT / "bayesid" / "robot" / "models" / "ets7.urdf",
    "planar": ROOT / "bayesid" / "robot" / "models" / "planar.urdf",
    "branched": ROOT / "studies" / "truth" / "robots" / "branched.urdf",
    "servicer4": ROOT / "studies" / "truth" / "robots" / "servicer4.urdf",
}
LOAD = InertialParameters(10.0, [0.1, -0.2, 0.15], [[1.0, 0.1, 0.0], [0.1, 1.2, 0.2], [0.0, 0.2, 0.9]])


def witness_of_pinocchio(file: Path) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia about it of the whole robot at rest, base axes."""
    model = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
    data = model.createData()
    q = pin.neutral(model)
    pin.ccrba(model, data, q, np.zeros(model.nv))
    return data.Ig.mass, data.com[0].copy(), data.Ig.inertia.copy()


def witness_of_mujoco(file: Path) -> tuple[float, np.ndarray, np.ndarray]:
    """The same from the tests' own URDF reader, by MuJoCo."""
    import mujoco

    model = mj.TruthModel(file).model
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    mass = model.body_mass[1:]
    com = mass @ data.xipos[1:] / mass.sum()
    tensor = np.zeros((3, 3))
    for index in range(1, model.nbody):
        axes = data.ximat[index].reshape(3, 3)
        arm = data.xipos[index] - com
        tensor += axes @ np.diag(model.body_inertia[index]) @ axes.T
        tensor += model.body_mass[index] * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return mass.sum(), com, tensor


def own(robot: Robot) -> tuple[float, np.ndarray, np.ndarray]:
    """The same from the package's tables."""
    still = JointState(*np.zeros((3, 1, len(robot.joints))))
    motion = kinematics(robot, still)
    row = sum(link_table(robot, name, motion)[0] @ link.inertial.vector for name, link in robot.links.items())
    mass = row[0]
    com = row[ENTRIES["first"]] / mass
    xx, yy, zz, xy, xz, yz = row[ENTRIES["second"]]
    second = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) - mass * np.outer(com, com)
    return mass, com, np.trace(second) * np.eye(3) - second


def assert_same(left, right, scale: float = 1e-9) -> None:
    """Equal to 1e-9, which rounding of 17 digits through rotations and MuJoCo's quaternions does not reach."""
    assert left[0] == pytest.approx(right[0], rel=1e-12)
    np.testing.assert_allclose(left[1], right[1], atol=scale)
    np.testing.assert_allclose(left[2], right[2], rtol=scale, atol=scale * np.abs(left[2]).max())


# reading --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
def test_composite_body_agrees_with_both_witnesses(name):
    robot = Robot.from_urdf(ROBOTS[name])
    assert_same(own(robot), witness_of_pinocchio(ROBOTS[name]))
    assert_same(own(robot), witness_of_mujoco(ROBOTS[name]))
    assert robot.mass == pytest.approx(own(robot)[0], rel=1e-14)


def test_every_shipped_robot_loads():
    folder = ROOT / "bayesid" / "robot" / "models"
    names = sorted(file.stem for file in folder.glob("*.urdf"))
    assert {"ets7", "planar"} <= set(names)
    for name in names:
        robot = Robot.shipped(name)
        assert robot.name == name
        assert robot.joints
        assert robot.link(robot.base).inertial.is_extended
    with pytest.raises(InputError, match=r"no built-in robot 'getex'. Choose one of ets7, planar"):
        Robot.shipped("getex")


def test_base_and_joints_of_the_branched_robot():
    robot = Robot.from_urdf(ROBOTS["branched"])
    assert robot.base == "bus"
    kinds = {joint.name: joint.kind for joint in robot.joints}
    assert kinds == {
        "slide": "prismatic",
        "shoulder": "revolute",
        "elbow": "continuous",
        "wrist": "revolute",
        "hinge": "revolute",
    }
    limits = {joint.name: (joint.lower, joint.upper, joint.velocity, joint.unit) for joint in robot.joints}
    assert limits["slide"] == (-1.0, 1.0, 0.5, "m")
    assert limits["wrist"] == (-3.0, 3.0, 1.0, "rad")
    assert limits["elbow"] == (-np.inf, np.inf, np.inf, "rad")
    assert [robot.joint_index(joint.name) for joint in robot.joints] == list(range(5))
    with pytest.raises(InputError, match="no moving joint named 'grip'"):
        robot.joint_index("grip")


def test_a_fixed_link_with_mass_is_a_body_of_its_own():
    robot = Robot.from_urdf(ROBOTS["branched"])
    tool, hand = robot.link("tool"), robot.link("hand")
    assert tool.joint == hand.joint == robot.joint_index("wrist")
    np.testing.assert_allclose(tool.placement[:3, 3], [0.0, 0.0, 0.2], atol=1e-15)
    np.testing.assert_allclose(tool.placement[:3, :3], mj.rotation_from_rpy([0.4, 0.5, -0.6]), atol=1e-15)
    np.testing.assert_array_equal(hand.placement, np.eye(4))
    assert robot.mass == pytest.approx(320 + 12 + 8 + 3 + 4 + 15 + 6)


def test_rotated_inertial_frames_are_turned_to_the_links_axes():
    robot = Robot.from_urdf(ROBOTS["branched"])
    for link in ElementTree.parse(ROBOTS["branched"]).getroot().iterfind("link"):
        body = mj.read_body(link)
        np.testing.assert_allclose(robot.link(link.get("name")).inertial.inertia, body.inertia, atol=1e-13)


def test_gravity_is_off():
    assert not Robot.shipped("ets7").model.gravity.vector.any()


# changing and writing -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
def test_a_changed_robot_survives_writing(name, tmp_path):
    """A changed link and a load, read again by Pinocchio and by MuJoCo."""
    robot = Robot.from_urdf(ROBOTS[name])
    link = list(robot.links)[2]
    changed = robot.perturbed(link, 0.2, np.random.default_rng(5)).with_load(Load("load", link, LOAD))
    assert not np.allclose(own(changed)[2], own(robot)[2], rtol=1e-3)
    assert changed.mass == pytest.approx(
        robot.mass + 10.0 + changed.link(link).inertial.mass - robot.link(link).inertial.mass
    )
    file = tmp_path / "changed.urdf"
    changed.write_urdf(file)
    assert_same(own(changed), witness_of_pinocchio(file))
    assert_same(own(changed), witness_of_mujoco(file))
    again = Robot.from_urdf(file)
    assert set(again.links) == set(changed.links)
    for each in changed.links:
        np.testing.assert_allclose(
            again.link(each).inertial.vector, changed.link(each).inertial.vector, rtol=1e-12, atol=1e-14
        )


def test_a_load_on_a_fixed_link_is_placed_there(tmp_path):
    robot = Robot.from_urdf(ROBOTS["branched"]).with_load(Load("sample", "tool", LOAD))
    assert robot.loads == ("sample",)
    assert robot.link("sample").joint == robot.link("tool").joint
    robot.write_urdf(tmp_path / "loaded.urdf")
    assert_same(own(robot), witness_of_pinocchio(tmp_path / "loaded.urdf"))
    assert_same(own(robot), witness_of_mujoco(tmp_path / "loaded.urdf"))


def test_changes_return_a_new_robot():
    robot = Robot.shipped("planar")
    before = robot.mass
    robot.with_inertial("base_link", LOAD)
    robot.with_load(Load("load", "link2", LOAD))
    assert robot.mass == before
    assert robot.loads == ()
    with pytest.raises(TypeError):
        robot.links["base_link"] = None  # type: ignore[index]


def test_perturbed_changes_one_link_by_the_prior_and_repeats():
    robot = Robot.shipped("planar")
    first, again = (robot.perturbed("link1", 0.1, np.random.default_rng(3)) for _ in range(2))
    np.testing.assert_array_equal(first.link("link1").inertial.vector, again.link("link1").inertial.vector)
    np.testing.assert_array_equal(first.link("base_link").inertial.vector, robot.link("base_link").inertial.vector)
    z = coordinates_of(BodyPrior("link1", robot.link("link1").inertial, 0.1), first.link("link1").inertial)
    np.testing.assert_allclose(z, np.random.default_rng(3).normal(size=10), atol=1e-9)


def test_names_must_exist_and_be_free():
    robot = Robot.shipped("planar")
    with pytest.raises(InputError, match=r"no link or load named 'arm'. Choose one of base_link, link1, link2, tip"):
        robot.link("arm")
    with pytest.raises(InputError, match="no link or load named 'arm'"):
        robot.with_inertial("arm", LOAD)
    with pytest.raises(InputError, match="no link or load named 'arm'"):
        robot.with_load(Load("load", "arm", LOAD))
    with pytest.raises(InputError, match="the name 'link1' is already used"):
        robot.with_load(Load("link1", "link2", LOAD))


# what cannot be read --------------------------------------------------------------------------------------------------

INERTIAL = '<inertial><mass value="{mass}"/><inertia ixx="{ixx}" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def urdf(*, mass: str = "1", ixx: str = "1", joint: str = "revolute", inside: str = "", base: str | None = None) -> str:
    own_base = INERTIAL.format(mass="10", ixx="1") if base is None else base
    return f"""<robot name="r"><link name="base">{own_base}</link>
      <link name="arm">{INERTIAL.format(mass=mass, ixx=ixx)}</link>
      <joint name="j" type="{joint}"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
      <limit lower="-1" upper="1" effort="1" velocity="1"/>{inside}</joint></robot>"""


def test_the_plain_version_of_the_broken_robots_is_read():
    assert Robot.from_string(urdf()).mass == 11.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (urdf(mass="-2"), r"link arm: mass >= 0 fails: mass = -2 kg"),
        (urdf(ixx="2.5"), r"link arm: the triangle inequality .* 1 \+ 1 < 2.5 kg m2"),
        (urdf(ixx="-1"), r"link arm: principal moments >= 0 fails: the smallest is -1"),
        (urdf(mass="heavy"), r"link arm: unreadable <inertial>"),
        (urdf(mass="nan"), r"link arm: an inertial parameter is not finite"),
        (urdf(base="<inertial><mass value='1'/></inertial>"), r"link base: <inertial> lacks its <mass> or <inertia>"),
        (urdf(joint="floating"), r"joint j: joint type 'floating' is supported only"),
        (urdf(joint="planar"), r"joint j: joint type 'planar' is not supported"),
        (urdf(inside='<mimic joint="k"/>'), r"joint j: mimic joints are not supported"),
        (urdf(base=""), r"link base: mass > 0 fails: neither the root link nor"),
        (urdf(base=INERTIAL.format(mass="0", ixx="0").replace('"1"', '"0"')), r"link base: mass > 0 fails"),
        ("mass: 10", r"not well-formed XML"),
        ("<robot name='r'></robot>", r"r.urdf"),
        (
            urdf().replace('<child link="arm"/>', '<child link="leg"/>'),
            r"joint j: its child, the link 'leg', is not in the file",
        ),
    ],
)
def test_a_broken_robot_is_refused_with_file_and_place(text, message, tmp_path):
    file = tmp_path / "r.urdf"
    file.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        Robot.from_urdf(file)
    assert str(file) in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none\.urdf: no such file"):
        Robot.from_urdf(tmp_path / "none.urdf")
