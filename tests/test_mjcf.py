"""Robots in MJCF are those that MuJoCo compiles; what is no tree of hinges and slides, and SDF, is refused."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from typer.testing import CliRunner

from bayesid._io.errors import InputError
from bayesid.app.command_line import app
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_model
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot

CHASER = """\
<mujoco model="chaser">
  <compiler angle="degree"/>
  <default>
    <default class="arm"><joint range="-170 170"/></default>
    <default class="loose"/>
  </default>
  <worldbody>
    <body name="bus" pos="0 0 1">
      <freejoint name="floating"/>
      <inertial pos="0.02 -0.01 0.05" mass="400" diaginertia="60 70 50"/>
      <geom type="box" size="0.5 0.5 0.5"/>
      <site name="imu" pos="0.1 0 0"/>
      <body name="shoulder" pos="0.5 0 0.2" quat="1 0 1 0" childclass="arm">
        <joint name="yaw" axis="0 0 1"/>
        <inertial pos="0 0 0.2" mass="8" fullinertia="0.3 0.3 0.05 0.01 0 0.02"/>
        <body name="boom" pos="0 0 0.4">
          <joint name="pitch" axis="0 1 0" pos="0 0 0.05"/>
          <inertial pos="0 0 0.3" quat="0.9 0.4 0.1 0" mass="6" diaginertia="0.25 0.24 0.03"/>
          <body name="slider" pos="0 0 0.6">
            <joint name="extend" type="slide" axis="0 0 1" range="-0.1 0.3"/>
            <geom type="cylinder" size="0.05 0.2" mass="4"/>
            <body name="tool" pos="0 0 0.25" quat="0.8 0 0.6 0">
              <inertial pos="0.05 0 0" mass="1.5" diaginertia="0.01 0.02 0.02"/>
              <body name="flange" pos="0.02 0 0" quat="0.9 0 0 -0.4">
                <body name="finger" pos="0.1 0 0" childclass="loose">
                  <joint name="grip" axis="1 2 0"/>
                  <inertial pos="0 0.03 0" mass="0.2" diaginertia="1e-4 1e-4 1e-4"/>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
      <body name="panel" pos="0 1 0" euler="0 0 30">
        <inertial pos="0 0.5 0" mass="10" diaginertia="3 0.2 3"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def written(folder: Path, text: str, name: str = "chaser.xml") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


COMPILER = '<compiler angle="degree"/>'
PANEL = '<body name="panel" pos="0 1 0" euler="0 0 30">'
END = "</body>\n    </body>"
SPHERES = """<geom type="sphere" size="0.2" group="1" mass="7"/><geom type="box" size="0.1 0.2 0.3" density="300"/>
<geom type="capsule" size="0.1 0.2" group="3"/>"""


def compiler(**attributes: str) -> tuple[str, str]:
    written = " ".join(f'{key}="{value}"' for key, value in attributes.items())
    return COMPILER, f'<compiler angle="degree" {written}/>'


VARIANTS = {
    "degrees": [],
    "radians": [(COMPILER, '<compiler angle="radian"/>'), ("-170 170", "-2.9 2.9"), ("0 0 30", "0 0 0.5")],
    **{f"eulerseq {s}": [compiler(eulerseq=s), ("0 0 30", "20 30 40")] for s in ("xyz", "ZYX", "XYZ", "YxZ", "zxz")},
    "inertiafromgeom": [compiler(inertiafromgeom="true"), ('<body name="', '<geom size="0.1"/><body name="')],
    "inertiagrouprange": [compiler(inertiagrouprange="1 2"), (PANEL, PANEL + SPHERES)],
    "boundmass": [compiler(boundmass="2.5")],
    "boundinertia": [compiler(boundinertia="0.02", boundmass="0.1")],
    "balanceinertia": [compiler(balanceinertia="true"), ("0.01 0.02 0.02", "0.01 0.02 0.04")],
    "settotalmass": [compiler(settotalmass="100")],
    "fusestatic": [compiler(fusestatic="true")],
    "autolimits": [compiler(autolimits="false"), ('range="-170', 'limited="true" range="-170')],
    "discardvisual": [compiler(discardvisual="true")],
    "alignfree": [compiler(alignfree="true")],
    "axisangle": [('euler="0 0 30"', 'axisangle="1 2 3 40"')],
    "xyaxes": [('euler="0 0 30"', 'xyaxes="1 1 0 -1 1 1"')],
    "zaxis": [('euler="0 0 30"', 'zaxis="1 1 1"')],
    "ref": [('axis="1 2 0"', 'axis="1 2 0" ref="20"'), ('type="slide"', 'type="slide" ref="0.1"')],
    "two joints": [('<joint name="pitch"', '<joint name="roll" axis="1 0 0" pos="0 0.1 0"/><joint name="pitch"')],
    "frame": [
        (PANEL, '<frame pos="0 0 1" euler="10 20 30">' + PANEL),
        ("</body>\n    </body>", "</body></frame></body>"),
    ],
    "replicate": [
        (PANEL, '<replicate count="3" euler="0 0 20">' + PANEL),
        ("</body>\n    </body>", "</body></replicate></body>"),
    ],
    "shell": [('size="0.05 0.2" mass="4"', 'size="0.05 0.2" mass="4" shellinertia="true"')],
    "density": [('size="0.05 0.2" mass="4"', 'size="0.05 0.2" density="400"')],
    "ellipsoid": [('type="cylinder" size="0.05 0.2"', 'type="ellipsoid" size="0.05 0.2 0.1" quat="1 1 0 0"')],
    "fromto": [('type="cylinder" size="0.05 0.2"', 'type="capsule" size="0.05" fromto="0 0 0 0.1 0.2 0.3"')],
    "another class": [('name="pitch"', 'name="pitch" class="loose"')],
    "armature": [('name="pitch"', 'name="pitch" armature="0.3"')],
}
"""What of MJCF's compiler, poses and shapes changes masses, poses or limits: old and new text of each."""


@pytest.mark.parametrize("changes", VARIANTS.values(), ids=VARIANTS)
@pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass':UserWarning")
def test_mass_matrix_and_limits_are_those_of_mujoco(tmp_path, monkeypatch, changes):
    monkeypatch.chdir(tmp_path)  # where MuJoCo writes its warnings
    text = CHASER
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file = written(tmp_path, text)
    robot = Robot.from_urdf(file)
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()
    truth = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(truth)
    names = [joint.name for joint in robot.joints]
    assert {"extend", "grip", "pitch", "yaw"} <= set(names)
    for joint in robot.joints:
        limited = bool(truth.jnt_limited[truth.joint(joint.name).id])
        limits = truth.joint(joint.name).range if limited else (-np.inf, np.inf)
        assert (joint.lower, joint.upper) == pytest.approx(tuple(limits)), joint
    order = [truth.joint(name).dofadr[0] for name in names]
    rng = np.random.default_rng(0)
    for _ in range(5):
        values = rng.uniform(-1.0, 1.0, len(names))
        data.qpos[:] = 0.0
        data.qpos[3] = 1.0
        q = pin.neutral(robot.model)
        for name, value in zip(names, values, strict=True):
            data.qpos[truth.joint(name).qposadr[0]] = value
            joint = robot.model.joints[robot.model.getJointId(name)]
            turns = joint.nq == 2  # a joint without limits has cosine and sine
            q[joint.idx_q : joint.idx_q + joint.nq] = [np.cos(value), np.sin(value)] if turns else [value]
        mujoco.mj_forward(truth, data)
        matrix = np.zeros((truth.nv, truth.nv))
        mujoco.mj_fullM(truth, data, matrix)
        matrix -= np.diag(truth.dof_armature)  # rotors have no part in a measured motion
        take = [0, 1, 2, 3, 4, 5, *order]
        np.testing.assert_allclose(
            pin.crba(robot.model, pin.Data(robot.model), q), matrix[np.ix_(take, take)], atol=1e-6
        )


def test_bodies_joints_and_limits_are_those_of_the_file(tmp_path):
    robot = Robot.from_urdf(written(tmp_path, CHASER))
    assert robot.name == "chaser"
    assert robot.base == "bus"
    assert robot.mass == pytest.approx(429.7)
    masses = {"bus": 400.0, "panel": 10.0, "shoulder": 8.0, "boom": 6.0, "slider": 4.0, "tool": 1.5, "finger": 0.2}
    assert {name: link.inertial.mass for name, link in robot.links.items() if link.inertial.mass} == pytest.approx(
        masses
    )
    np.testing.assert_allclose(robot.link("boom").inertial.com, [0.0, 0.0, 0.3])
    joints = {joint.name: joint for joint in robot.joints}
    assert (joints["yaw"].lower, joints["yaw"].upper) == pytest.approx((-np.radians(170), np.radians(170)))
    # the range of a slide is in metres, also where angles are in degrees
    assert (joints["extend"].lower, joints["extend"].upper) == pytest.approx((-0.1, 0.3))
    assert joints["extend"].unit == "m"
    assert joints["grip"].upper == np.inf


def test_a_robot_from_mjcf_is_written_as_urdf(tmp_path):
    robot = Robot.from_urdf(written(tmp_path, CHASER))
    robot.write_urdf(tmp_path / "identified.urdf")
    again = Robot.from_urdf(tmp_path / "identified.urdf")
    assert set(again.links) == set(robot.links)
    assert again.joints == robot.joints


def test_a_base_without_free_joint_is_the_first_body(tmp_path):
    free = Robot.from_urdf(written(tmp_path, CHASER))
    fixed = Robot.from_urdf(written(tmp_path, CHASER.replace('<freejoint name="floating"/>', "")))
    assert fixed.base == "bus"
    assert {name: link.inertial.mass for name, link in fixed.links.items()} == pytest.approx(
        {name: link.inertial.mass for name, link in free.links.items()}
    )
    np.testing.assert_allclose(fixed.link("panel").placement, free.link("panel").placement, atol=1e-12)


def test_a_study_may_name_an_mjcf(tmp_path):
    file = written(tmp_path, CHASER)
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 40.0, 0.5)
    channels = {f"rate.{axis}": 1e-5 * rng.normal(size=len(time)) for axis in "xyz"}
    for joint in ("yaw", "pitch", "extend", "grip"):
        channels[f"position.{joint}"] = 0.1 + 0.1 * np.sin(0.2 * time) + 1e-6 * rng.normal(size=len(time))
    Recording("swing", None, time, channels).write(tmp_path / "swing.csv")
    study = tmp_path / "study.toml"
    result = CliRunner().invoke(app, ["init", str(file), str(tmp_path / "swing.csv"), "--output", str(study)])
    assert result.exit_code == 0, result.output
    assert 'urdf = "chaser.xml"' in study.read_text(encoding="utf-8")
    model = load_model(Study.load(study))
    assert model.robot.base == "bus"
    assert model.robot.mass == pytest.approx(429.7)


def test_what_has_no_part_in_a_measured_motion_is_left_out(tmp_path):
    visible = CHASER.replace(
        '<geom type="box" size="0.5 0.5 0.5"/>', '<geom type="mesh" mesh="bus" contype="0" conaffinity="0"/>'
    )
    driven = visible.replace(
        "</mujoco>",
        '<asset><mesh name="bus" file="absent.obj"/></asset>'
        '<equality><joint joint1="yaw" joint2="pitch"/></equality>'
        '<actuator><position joint="yaw" kp="3500"/></actuator></mujoco>',
    )
    plain, whole = (Robot.from_urdf(written(tmp_path, text)) for text in (CHASER, driven))
    assert whole.urdf == plain.urdf


TARGET = '<body name="target"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>'


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'type="slide" axis="0 0 1" range="-0.1 0.3"',
            'type="ball" range="0 90"',
            ("'ball'", "joint extend", "hinges or prismatic joints"),
        ),
        ("</worldbody>", TARGET, ("2 bodies", "target")),
        ("<worldbody>", '<include file="arm.xml"/><worldbody>', ("arm.xml", "MuJoCo cannot read")),
        ('<freejoint name="floating"/>', '<joint axis="1 0 0"/>', ("body bus", "a hinge connects it to the world")),
        (
            "</mujoco>",
            '<equality><connect body1="tool" body2="panel" anchor="0 0 0"/></equality></mujoco>',
            ("<connect>", "tree of bodies"),
        ),
        ("</mujoco>", "", ("not well-formed XML",)),
        ('type="slide"', 'type="screw"', ("MuJoCo cannot read the robot", "'screw'")),
        (COMPILER, '<compiler boundinertia="1"/>', ("body flange", "mass > 0 fails for a body with inertia 1 kg m2")),
    ],
    ids=["ball", "two trees", "include", "hinge", "loop", "no XML", "screw", "inertia without mass"],
)
def test_what_is_no_tree_of_hinges_and_slides_is_refused(tmp_path, old, new, words):
    file = written(tmp_path, CHASER.replace(old, new, 1))
    with pytest.raises(InputError) as error:
        Robot.from_urdf(file)
    assert all(word in str(error.value) for word in (file.name, *words)), error.value


SDF = """\
<sdf version="1.9"><model name="chaser"><link name="bus"><inertial><mass>400</mass></inertial></link></model></sdf>
"""


@pytest.mark.parametrize(
    ("text", "words"), [(SDF, ("SDF", "Convert it to URDF or MJCF")), ("<scene/>", ("<scene>", "<robot>", "<mujoco>"))]
)
def test_other_formats_are_refused(tmp_path, text, words):
    file = written(tmp_path, text, "chaser.sdf")
    with pytest.raises(InputError) as error:
        Robot.from_urdf(file)
    assert all(word in str(error.value) for word in (file.name, *words)), error.value
