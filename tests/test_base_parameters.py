"""Base parameters: counts against Pinocchio's regressor and theory, and that nothing measured sees the rest."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest
import scipy.linalg as sla

from bayesid import InputError
from bayesid.identifiability import Base, BaseParameters, base_parameters
from bayesid.identifiability.base_parameters import massive_bodies, stacked_regressor
from bayesid.robot.inertial_parameters import BASIS, InertialParameters, parameters_from_pseudo_inertia
from bayesid.robot.kinematics import configuration, joint_twist
from bayesid.robot.robot import Load, Robot
from bayesid.simulation.dynamics import Start, simulate
from bayesid.simulation.effects import GravityGradient
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.time_grid import build_grid
from studies.truth import mujoco as mj
from tests.sensed import read
from tests.trees import random_body, random_tree

REVOLUTE, PRISMATIC = ("revolute", "continuous"), ("prismatic",)


def parameters_of(robot: Robot, base: BaseParameters) -> np.ndarray:
    """Standard parameters in the order of `BaseParameters.standard`."""
    values = {}
    for name in robot.links:
        keys = (
            "mass",
            "first.x",
            "first.y",
            "first.z",
            *(f"inertia.{k}" for k in ("xx", "xy", "yy", "xz", "yz", "zz")),
        )
        values |= {f"{name}.{key}": value for key, value in zip(keys, robot.link(name).inertial.vector, strict=True)}
    return np.array([values[name] for name in base.standard])


def replaced(robot: Robot, p: np.ndarray) -> Robot:
    """The robot with other standard parameters."""
    for name, vector in zip(robot.links, p.reshape(-1, 10), strict=True):
        robot = robot.with_inertial(name, InertialParameters.from_vector(vector))
    return robot


def pinocchio_rank(model: pin.Model, rng: np.random.Generator) -> int:
    data, rows = model.createData(), []
    for _ in range(40 * (1 + 30 // model.nv)):
        q = pin.integrate(model, pin.neutral(model), 2.0 * rng.normal(size=model.nv))
        regressor = pin.computeJointTorqueRegressor(model, data, q, *rng.normal(size=(2, model.nv)))
        rows.append(np.atleast_2d(regressor).copy())
    matrix = np.concatenate(rows)
    return int(np.linalg.matrix_rank(matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-9), tol=1e-9))


TREES = {
    "chain": (("revolute", "revolute", "revolute"), 0, True),
    "tree": (("revolute", "prismatic", "continuous", "fixed", "revolute"), 1, False),
    "slides": (("prismatic", "prismatic", "revolute", "prismatic"), 0, True),
    "loaded": (("revolute", "fixed"), 2, False),
}


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("base", Base)
def test_counts_are_the_rank_of_pinocchios_regressor(name, base):
    kinds, loads, chain = TREES[name]
    rng = np.random.default_rng(len(name))
    robot = random_tree(kinds, rng, loads=loads, chain=chain)
    found = base_parameters(robot, base=base)
    root = (pin.JointModelFreeFlyer(),) if base is Base.FREE else ()
    model = pin.buildModelFromXML(robot.to_urdf(), *root)
    assert found.count == pinocchio_rank(model, rng)
    assert sorted((*found.independent, *found.dependent, *found.without_effect)) == sorted(found.standard)
    assert len(found.standard) == 10 * (1 + len(kinds) + loads)
    assert found.gap[0] > 1e-5
    assert found.gap[1] < 1e-12
    if base is Base.FREE:
        revolute, prismatic = (sum(kind in family for kind in kinds) for family in (REVOLUTE, PRISMATIC))
        fixed = len(kinds) - revolute - prismatic + loads
        assert len(found.dependent) == 3 * revolute + 6 * prismatic + 10 * fixed
        assert not found.without_effect


def test_the_papers_counts():
    assert base_parameters(Robot.shipped("planar")).count == 24
    arm = base_parameters(Robot.shipped("ets7"))
    assert (len(arm.standard), arm.count) == (70, 52)
    assert arm.dependent == tuple(
        f"link{index}.{key}" for index in range(1, 7) for key in ("mass", "first.z", "inertia.yy")
    )
    # a six-joint arm on a fixed base whose first axis is vertical: Gautier & Khalil's 36
    assert base_parameters(Robot.shipped("ets7"), base=Base.FIXED).count == 36


def test_gravity_shows_more_where_the_first_axis_is_not_vertical():
    robot = Robot.shipped("ets7")
    assert base_parameters(robot, base=Base.FIXED, gravity=(1.0, 2.0, -9.0)).count == 38


def test_regrouping_is_the_textbooks():
    """A joint about z displaced by (x, y, z) = (0.3, 0.1, 0): Khalil & Dombre's rules, worked out by hand."""
    robot = Robot.shipped("planar")
    found = base_parameters(robot)
    p = parameters_of(robot, found)
    value = dict(zip(found.standard, p, strict=True))
    grouped = dict(zip(found.independent, found.project(p), strict=True))
    m1, m2 = value["link1.mass"], value["link2.mass"]
    yy1, yy2 = value["link1.inertia.yy"], value["link2.inertia.yy"]
    moved = m1 + m2
    expected = {
        "base_link.mass": value["base_link.mass"] + moved,
        "base_link.first.x": value["base_link.first.x"] + 0.3 * moved,
        "base_link.inertia.xx": value["base_link.inertia.xx"] + 0.1**2 * moved + yy1 + yy2 + m2,
        "base_link.inertia.yy": value["base_link.inertia.yy"] + 0.3**2 * moved + yy1 + yy2 + m2,
        "base_link.inertia.xy": value["base_link.inertia.xy"] - 0.3 * 0.1 * moved,
        "base_link.inertia.zz": value["base_link.inertia.zz"] + (0.3**2 + 0.1**2) * moved,
        "link1.first.x": value["link1.first.x"] + m2,
        "link1.inertia.xx": value["link1.inertia.xx"] - yy1 - m2,
        "link1.inertia.zz": value["link1.inertia.zz"] + m2,
        "link2.inertia.xx": value["link2.inertia.xx"] - yy2,
        "link2.first.y": value["link2.first.y"],
    }
    for name, number in expected.items():
        assert grouped[name] == pytest.approx(number, rel=1e-12, abs=1e-12), name


@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_what_a_joint_hides_is_what_its_motion_leaves_alone(kind):
    """Bodies taken from one side of a joint and put on the other, by their pseudo-inertia, in closed form."""
    robot = random_tree([kind], np.random.default_rng(5))
    found = base_parameters(robot)
    q = configuration(robot, np.array([0.7]))
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    pose, axis = data.oMi[2].homogeneous, joint_twist(robot, 0)[3:]
    if kind == "revolute":
        along = np.zeros((3, 4, 4))
        along[0, 3, 3] = 1.0
        along[1, :3, 3] = along[1, 3, :3] = axis
        along[2, :3, :3] = np.outer(axis, axis)
    else:
        along = BASIS[4:]
    for hidden in along:
        taken = np.concatenate(
            [parameters_from_pseudo_inertia(jnp.asarray(body)) for body in (pose @ hidden @ pose.T, -hidden)]
        )
        np.testing.assert_allclose(found.project(taken), 0.0, atol=1e-12)
        assert np.abs(taken).max() > 0.1
    assert len(found.dependent) == len(along)


@pytest.fixture(scope="module")
def other() -> tuple[Robot, Robot, BaseParameters]:
    """A robot of every kind of joint, and another one with the same base parameters."""
    rng = np.random.default_rng(3)
    robot = random_tree(("revolute", "prismatic", "continuous"), rng, loads=1)
    found = base_parameters(robot)
    p = parameters_of(robot, found)
    assert {name.split(".")[0] for name in found.dependent} == {"link1", "link2", "link3", "load1"}
    second = dict(zip(found.standard, p, strict=True))
    changed = np.array([second[name] * (1.0 + 0.004 * rng.uniform()) for name in found.dependent])
    return robot, replaced(robot, reorder(found, found.recover(found.project(p), changed), robot)), found


def reorder(found: BaseParameters, p: np.ndarray, robot: Robot) -> np.ndarray:
    """Standard parameters in the order of the robot's links."""
    place = {name: index for index, name in enumerate(found.standard)}
    keys = [name.split(".", 1)[1] for name in found.standard[:10]]
    return p[[place[f"{link}.{key}"] for link in robot.links for key in keys]]


def test_torques_do_not_see_the_change(other):
    first, second, _ = other
    rng = np.random.default_rng(4)
    assert abs(first.link("link1").inertial.mass - second.link("link1").inertial.mass) > 1e-3
    models = [pin.buildModelFromXML(robot.to_urdf(), pin.JointModelFreeFlyer()) for robot in (first, second)]
    for model in models:
        model.gravity.setZero()
    for _ in range(5):
        q = pin.integrate(models[0], pin.neutral(models[0]), rng.normal(size=models[0].nv))
        v, a = rng.normal(size=(2, models[0].nv))
        one, two = (pin.rnea(model, model.createData(), q, v, a) for model in models)
        np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-11 * np.abs(one).max())


def test_motion_does_not_see_the_change(other, formula_motion, tmp_path):
    first, second, found = other
    (tmp_path / "robot.urdf").write_text(first.to_urdf())
    formula = mj.smooth_motion(3, 60.0, seed=3, amplitude=0.6)
    motion = formula_motion(formula, tmp_path / "robot.urdf", first)
    times = np.arange(0.0, 10.1, 1.0)
    names = tuple(first.links)
    grid = build_grid(first, names, motion, times, 0.5, orbit=Orbit(6.9e6), argument_of_latitude=0.3)
    start = Start(jnp.array([0.1, 0.2, 0.3, 0.9]), jnp.array([0.01, -0.02, 0.03]))

    @jax.jit
    def readings(p: jax.Array) -> jax.Array:
        point = jnp.array([0.2, 0.1, 0.4])
        result = read(simulate(grid, p, start, (GravityGradient(),), (jnp.zeros(0),), point[None]), point)
        return jnp.concatenate([result.rate, result.accel], axis=1)

    p, same = (np.concatenate([robot.link(name).inertial.vector for name in names]) for robot in (first, second))
    true = readings(p)
    assert np.abs(true).max() > 1e-3
    np.testing.assert_allclose(readings(same), true, rtol=0.0, atol=1e-12)
    # and it does see a change of any base parameter
    rng = np.random.default_rng(1)
    visible = found.projection.T @ rng.normal(size=found.count)
    visible *= 0.01 * np.linalg.norm(p) / np.linalg.norm(visible)
    assert np.abs(readings(p + reorder(found, visible, first)) - true).max() > 1e-6


def test_the_space_does_not_depend_on_what_is_called_dependent():
    robot = Robot.shipped("ets7")
    usual = base_parameters(robot)
    kept = ("link6.mass", "link6.first.z", "link6.inertia.yy", "link3.mass")
    other = base_parameters(robot, keep=kept, rng=np.random.default_rng(8))
    assert set(kept[:3]) <= set(other.independent)
    assert other.count == usual.count
    assert other.dependent != usual.dependent
    both = np.concatenate([usual.projection, other.projection])
    values = np.linalg.svd(both, compute_uv=False)
    assert values[usual.count - 1] > 1e-2
    assert values[usual.count] < 1e-12
    np.testing.assert_allclose(other.projection @ usual.unseen, 0.0, atol=1e-12)


def test_identified_directions_do_not_depend_on_what_is_called_dependent():
    """A posterior of all parameters says the same of K_B, direction by direction, under either choice of K_2."""
    robot, rng = Robot.shipped("planar"), np.random.default_rng(5)
    own = base_parameters(robot)
    other = base_parameters(robot, keep=own.dependent, rng=np.random.default_rng(8))
    assert set(own.independent) != set(other.independent)
    bodies = massive_bodies(robot)
    scale = np.abs(np.concatenate([robot.link(name).inertial.vector for name in bodies])) + 0.1
    prior = np.diag((0.3 * scale) ** 2)
    regressor = stacked_regressor(robot, bodies, Base.FREE, rng)[:40]  # few states: some directions are hardly seen
    posterior = np.linalg.inv(regressor.T @ regressor / 0.05**2 + np.linalg.inv(prior))
    found = []
    for base in (own, other):
        before, after = (base.projection @ covariance @ base.projection.T for covariance in (prior, posterior))
        ratios, weights = sla.eigh(after, before)
        found.append((ratios, weights.T @ base.projection))  # a direction as weights of all parameters
    (ratios, directions), (others, their) = found
    assert ratios.min() < 0.01
    assert ratios.max() > 0.3
    np.testing.assert_allclose(ratios, others, rtol=1e-6)
    overlap = their @ prior @ directions.T  # of normalised directions: 1 where they are the same
    distinct = np.min(np.abs(np.diff(ratios, prepend=-1.0)), initial=1.0) > 1e-9
    assert distinct
    np.testing.assert_allclose(np.abs(np.diag(overlap)), 1.0, atol=1e-5)


def test_the_first_part_follows_from_the_second():
    robot = Robot.shipped("ets7")
    found = base_parameters(robot, base=Base.FIXED)
    p = np.random.default_rng(2).normal(size=len(found.standard))
    place = {name: index for index, name in enumerate(found.standard)}
    dependent = p[[place[name] for name in found.dependent]]
    rest = p[[place[name] for name in found.without_effect]]
    np.testing.assert_allclose(found.recover(found.project(p), dependent, rest), p, atol=1e-12)


def test_a_load_regroups_with_its_carrier():
    robot = Robot.shipped("planar").with_load(Load("load", "tip", random_body(np.random.default_rng(1))))
    found = base_parameters(robot)
    assert len([name for name in found.dependent if name.startswith("load.")]) == 10
    assert found.count == 24


def test_same_states_every_time():
    robot = Robot.shipped("planar")
    np.testing.assert_array_equal(base_parameters(robot).regrouping, base_parameters(robot).regrouping)


def almost_parallel(tilt: float) -> Robot:
    body = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    links = "".join(f'<link name="{name}">{body}</link>' for name in "abc")
    joint = (
        '<joint name="{0}{1}" type="continuous"><parent link="{0}"/><child link="{1}"/>{2}<axis xyz="0 0 1"/></joint>'
    )
    joints = joint.format("a", "b", "") + joint.format("b", "c", f'<origin xyz="1 0 0" rpy="{tilt} 0 0"/>')
    return Robot.from_string(f'<robot name="r">{links}{joints}</robot>')


@pytest.mark.parametrize(("tilt", "count"), [(0.0, 4), (1e-9, 4), (1e-5, 8), (1e-2, 8), (1.0, 8)])
def test_almost_parallel_joints(tilt, count):
    """Faint effects are told from rounding; on a free base the tilt does not matter."""
    robot = almost_parallel(tilt)
    assert base_parameters(robot, base=Base.FIXED).count == count
    assert base_parameters(robot).count == 24


def test_no_number_is_given_where_rounding_decides():
    with pytest.raises(InputError, match=r"ambiguous: 7 or 8.*almost, but not exactly, parallel"):
        base_parameters(almost_parallel(7e-7), base=Base.FIXED)


def test_errors():
    with pytest.raises(InputError, match=r"no inertial parameter link9\.mass\. Choose from base_link\.mass"):
        base_parameters(Robot.shipped("planar"), keep=["link9.mass"])


def test_without_joints():
    body = '<inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    robot = Robot.from_string(f'<robot name="r"><link name="b">{body}</link></robot>')
    assert base_parameters(robot).count == 10
    held = base_parameters(robot, base=Base.FIXED)
    assert held.count == 0
    assert len(held.without_effect) == 10
