"""URDFs as people write them are read as they are meant, or refused with what to do."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from importlib.metadata import distribution
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from bayesid._io.errors import InputError
from bayesid.robot.inertial_parameters import InertialParameters, nearest_physical
from bayesid.robot.robot import Robot

SERVICER = Path(__file__).resolve().parents[1] / "studies" / "truth" / "robots" / "servicer3.urdf"
PLAIN = SERVICER.read_text(encoding="utf-8")
LINK3 = '<inertia ixx="0.03" ixy="0.006" ixz="0.004" iyy="0.75" iyz="0.002" izz="0.74"/>'
ETS7_LINK5 = '<inertia ixx="0.57" ixy="0" ixz="-0.231" iyy="0.599" iyz="0" izz="0.129"/>'
PANEL = '<xacro:panel side="1"/>'


def read(folder: Path, text: str | bytes, **options) -> Robot:
    file = folder / "robot.urdf"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return Robot.from_urdf(file, **options)


def configuration(robot: Robot, seed: int = 0) -> np.ndarray:
    """Joint angles by rank of the joint, at a neutral base."""
    values = np.random.default_rng(seed).uniform(-1.0, 1.0, len(robot.joints))
    q = pin.neutral(robot.model)
    for value, place in zip(values, range(2, robot.model.njoints), strict=True):
        joint = robot.model.joints[place]
        q[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(value), np.sin(value)] if joint.nq == 2 else [value]
    return q


def mass_matrix(robot: Robot) -> np.ndarray:
    return pin.crba(robot.model, pin.Data(robot.model), configuration(robot))


def assert_same(robot: Robot, rtol: float = 1e-12) -> None:
    """The robot moves and weighs as the plain servicer."""
    known = Robot.from_string(PLAIN)
    np.testing.assert_allclose(mass_matrix(robot), mass_matrix(known), rtol=rtol, atol=1e-9)
    total = sum(link.inertial.mass for link in robot.links.values())
    assert total == pytest.approx(known.mass)


WORLD = (
    '<link name="world"/><joint name="w" type="{}"><parent link="world"/><child link="base_link"/></joint>'
    '<link name="base_link">'
)
ROS = (
    '<link name="base_link"/><joint name="b" type="fixed"><parent link="base_link"/><child link="bus"/>'
    '<origin xyz="0 0 0" rpy="0 0 0"/></joint><link name="bus">'
)
BASE = '<link name="base_link">'


@pytest.mark.parametrize(
    ("text", "remark"),
    [
        (PLAIN.replace('"joint1"', '"root_joint"'), None),
        (PLAIN.replace('"joint2"', '"free_flyer"'), None),
        (PLAIN.replace("<robot ", '<robot xmlns="http://drake.mit.edu" '), None),
        (PLAIN.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" '), None),
        (PLAIN.replace('version="1.0"', 'version="1.0" encoding="latin-1"').replace("servicer", "sévicer"), None),
        (PLAIN.replace(BASE, WORLD.format("floating"), 1), "world and its floating joint"),
        (PLAIN.replace(BASE, WORLD.format("fixed"), 1), "world and its fixed joint"),
        (PLAIN.replace(BASE, ROS, 1), "base_link has no inertia; that of bus"),
        (PLAIN.replace('axis xyz="0 0 1"', 'axis xyz="0 0 2"', 1), None),
        (PLAIN.replace('velocity="2"', 'velocity="0"', 1), "joint1: velocity 0"),
    ],
    ids=[
        "root_joint",
        "free_flyer",
        "namespace",
        "expanded xacro",
        "latin-1",
        "world floating",
        "world fixed",
        "root without mass",
        "axis not of unit length",
        "velocity 0",
    ],
)
def test_the_same_robot_is_read(tmp_path, text, remark):
    data = text.encode("latin-1") if "latin-1" in text else text
    robot = read(tmp_path, data)
    assert_same(robot)
    assert robot.base == "base_link"
    assert robot.remarks == () if remark is None else remark in " ".join(robot.remarks)


def test_a_base_takes_the_inertia_of_a_body_placed_askew(tmp_path):
    askew = ROS.replace('xyz="0 0 0" rpy="0 0 0"', 'xyz="0.3 -0.2 0.1" rpy="0.4 0.5 -0.6"')
    robot = read(tmp_path, PLAIN.replace(BASE, askew, 1))
    raw = pin.buildModelFromXML(PLAIN.replace(BASE, askew, 1), pin.JointModelFreeFlyer())
    np.testing.assert_allclose(
        robot.link("base_link").inertial.vector, raw.inertias[1].toDynamicParameters(), rtol=1e-12, atol=1e-12
    )
    assert robot.link("bus").inertial.mass == 0.0
    again = Robot.from_string(robot.to_urdf())
    np.testing.assert_allclose(mass_matrix(again), mass_matrix(robot), rtol=1e-12, atol=1e-12)


def test_a_joint_that_moves_nothing_is_said(tmp_path):
    """As in SolidWorks exports whose material was forgotten; a frame fixed to a body needs no mass."""
    tree = ET.fromstring(PLAIN)
    last = next(link for link in tree.findall("link") if link.get("name") == "link3")
    last.remove(last.find("inertial"))
    joints = [joint.get("name") for joint in tree.findall("joint") if joint.find("child").get("link") == "link3"]
    robot = read(tmp_path, ET.tostring(tree, encoding="unicode"))
    assert robot.remarks == (f"Joint {joints[0]} moves a body without mass, since no <inertial> is given: link3.",)


def test_zero_limits_are_those_that_nobody_entered(tmp_path):
    zero = 'limit lower="0" upper="0" effort="0" velocity="0"'
    robot = read(tmp_path, PLAIN.replace('limit lower="-6.3" upper="6.3" effort="200" velocity="2"', zero, 1))
    first, second = robot.joints[:2]
    assert (first.lower, first.upper, first.velocity) == (-np.inf, np.inf, np.inf)
    assert (second.lower, second.upper, second.velocity) == (-6.3, 6.3, 2.0)
    assert "joint1: range 0 to 0; joint1: velocity 0" in robot.remarks[0]
    bare = read(tmp_path, PLAIN.replace('<limit lower="-6.3" upper="6.3" effort="200" velocity="2"/>', "", 1))
    assert bare.joints[0].velocity == np.inf
    assert bare.remarks == ()


def test_inertias_that_miss_physics_by_their_rounding_are_read(tmp_path):
    plate = '<inertia ixx="0.083" ixy="0" ixz="0" iyy="0.833" iyz="0" izz="0.917"/>'
    body = read(tmp_path, PLAIN.replace(LINK3, plate)).link("link3").inertial
    moments = np.linalg.eigvalsh(body.inertia)
    assert moments[0] + moments[1] == pytest.approx(moments[2], rel=1e-12)
    np.testing.assert_allclose(body.inertia, np.diag([0.083, 0.833, 0.917]), atol=0.0005)
    point = '<inertia ixx="0" ixy="0" ixz="2.4e-35" iyy="0" iyz="0" izz="0"/>'
    assert np.abs(read(tmp_path, PLAIN.replace(LINK3, point)).link("link3").inertial.inertia).max() < 1e-30
    # a tenth as far off, with more digits than that: refused
    exact = plate.replace("0.083", "0.08300").replace("0.833", "0.83300").replace("0.917", "0.91650")
    with pytest.raises(InputError, match="link link3: the triangle inequality"):
        read(tmp_path, PLAIN.replace(LINK3, exact))


def test_all_links_that_are_no_bodies_are_named_with_the_nearest_and_taken_on_request(tmp_path):
    text = PLAIN.replace(LINK3, ETS7_LINK5).replace('ixx="0.05" ixy="0.01"', 'ixx="-0.05" ixy="0.01"')
    with pytest.raises(InputError) as error:
        read(tmp_path, text)
    words = ("link link2", "link link3", "0.03", "nearest_physical = true", "--nearest-physical", 'ixx="0.573')
    assert all(word in str(error.value) for word in words), error.value
    robot = read(tmp_path, text, nearest_physical=True)
    assert len(robot.remarks) == 2
    assert robot.link("link3").inertial.is_extended
    # what the message states is itself read
    nearest = error.value.problem.rpartition("axes: ")[2].rstrip(")")
    stated = read(tmp_path, PLAIN.replace(LINK3, f"<inertia {nearest}/>")).link("link3").inertial
    np.testing.assert_allclose(stated.inertia, robot.link("link3").inertial.inertia, atol=1e-5)


def test_the_nearest_body_is_the_projection_of_its_second_moments():
    rng = np.random.default_rng(3)
    for _ in range(20):
        root = rng.normal(size=(3, 3))
        tensor = root + root.T
        near = nearest_physical(tensor)
        InertialParameters(1.0, np.zeros(3), near)
        # no physical body is nearer, in second moments: the optimality condition of a projection onto a cone
        given, there = (0.5 * np.trace(each) * np.eye(3) - each for each in (tensor, near))
        assert abs(np.sum((given - there) * there)) < 1e-12
        assert np.linalg.eigvalsh(given - there).max() < 1e-12


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</robot>", PANEL + "</robot>", ("unexpanded xacro", "<xacro:panel>", "xacro robot.urdf > robot.urdf")),
        ('mass value="14"', 'mass value="${m}"', ("unexpanded xacro", "${m}")),
        ('axis xyz="0 0 1"', 'axis xyz="0 0 0"', ("joint joint1", "no direction", "0 0 0")),
        ('axis xyz="0 0 1"', 'axis xyz="0 1"', ("joint joint1", "not three numbers")),
        (
            "</robot>",
            '<joint name="loop" type="fixed"><parent link="link3"/><child link="link1"/></joint></robot>',
            ("link link1", "2 parents", "joint joint1", "joint loop", "Closed chains"),
        ),
        ('child link="link3"', 'child link="link9"', ("joint joint3", "'link9'", "not in the file")),
        ("</robot>", '<link name="spare"/></robot>', ("2 links have no parent", "spare")),
        ("</robot>", '<link name="link1"/></robot>', ("one name", "'link1'")),
        ('name="joint2"', 'name="joint1"', ("one name", "'joint1'")),
        ('name="joint1" type="revolute"', 'name="joint1" type="floating"', ("joint joint1", "'floating'", "link1")),
    ],
    ids=["macro", "property", "axis", "two", "loop", "child", "two roots", "link", "joint", "floating"],
)
def test_what_would_be_read_wrongly_is_refused(tmp_path, old, new, words):
    text = PLAIN.replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ').replace(old, new, 1)
    with pytest.raises(InputError) as error:
        read(tmp_path, text)
    assert all(word in str(error.value) for word in ("robot.urdf", *words)), error.value


# robots that other people made ----------------------------------------------------------------------------------------


def read_or_reason(file: Path) -> tuple[Robot | None, str]:
    try:
        return Robot.from_urdf(file), ""
    except InputError as error:
        return None, str(error)


REFUSED = ("mimic joints", "no inertia", "nearest physical", "it contains no link")


@pytest.mark.slow
def test_robots_of_a_public_collection_are_those_of_pinocchio_or_refused_with_a_reason():
    names = distribution("example-robot-data").files or ()
    files = sorted(Path(str(name.locate())) for name in names if name.suffix == ".urdf")
    assert len(files) > 50
    compared = 0
    for file in files:
        robot, reason = read_or_reason(file)
        if robot is None:
            assert any(word in reason for word in REFUSED), reason
            continue
        raw = pin.buildModelFromUrdf(str(file), pin.JointModelFreeFlyer())
        here, there = configuration(robot), pin.neutral(raw)
        for joint in robot.joints:
            mine, own = (model.joints[model.getJointId(joint.name)] for model in (robot.model, raw))
            there[own.idx_q : own.idx_q + own.nq] = here[mine.idx_q : mine.idx_q + mine.nq]
        assert robot.mass == pytest.approx(pin.computeTotalMass(raw), rel=1e-9), file
        order = [[m.joints[m.getJointId(j.name)].idx_v for j in robot.joints] for m in (robot.model, raw)]
        ours = pin.crba(robot.model, pin.Data(robot.model), here)[np.ix_(order[0], order[0])]
        theirs = pin.crba(raw, pin.Data(raw), there)[np.ix_(order[1], order[1])]
        np.testing.assert_allclose(ours, theirs, atol=1e-9 * robot.mass, err_msg=str(file))
        compared += 1
    assert compared > 35
