"""Prediction of planned manoeuvres: against MuJoCo at known parameters, linearisation, from the command line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import ORBIT, PLANAR
from scipy.spatial.transform import Rotation
from test_cli import run

from bayesid._io.errors import InputError
from bayesid.design.base_prediction import BasePredictor
from bayesid.design.pose_trajectory import REACH, Region
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.report.numbers import format_quantity
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient, SensorBias
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from tests.pdf_text import PdfText

ATTITUDE = Rotation.from_euler("xyz", [0.3, -0.5, 1.1]).as_quat()
DURATION = 40.0


@pytest.fixture(scope="module")
def motion() -> mj.Motion:
    """A quintic from rest to rest."""
    start, way = np.array([0.4, -0.8]), np.array([-1.1, 1.7])

    def move(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        x = time / DURATION
        slope, bend = 30.0 * x**2 * (1.0 - x) ** 2, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x)
        angle = start + x**3 * (10.0 - 15.0 * x + 6.0 * x**2) * way
        return angle, slope * way / DURATION, bend * way / DURATION**2

    return move


@pytest.fixture(scope="module")
def predictor(motion, formula_motion) -> BasePredictor:
    robot = Robot.from_urdf(PLANAR)
    prior = BodyPrior("base_link", robot.link("base_link").inertial, 0.01)
    sensors = (Sensor(SensorKind.RATE, White(1e-5)),)
    model = Model(robot, sensors, (prior,), Orbit(ORBIT.radius), (GravityGradient(), SensorBias.of(SensorKind.RATE)()))
    time = np.linspace(0.0, DURATION, 81)
    planned = formula_motion(motion, PLANAR, robot)
    position = planned.evaluate(time).position
    recording = Recording("plan", None, time, {f"position.joint{k + 1}": position[:, k] for k in range(2)})
    return BasePredictor(model, Manoeuvre(recording, planned, ATTITUDE))


@pytest.mark.slow
def test_the_final_pose_is_that_of_an_independent_simulator(predictor, motion):
    """MuJoCo integrates base position and attitude with the gravity gradient on every body, starting at rest."""
    truth = mj.TruthModel(PLANAR, orbit=ORBIT)
    run = truth.run(motion, [DURATION], attitude0=ATTITUDE, step=0.1)
    base, tip = predictor.courses(predictor.centre[None])
    np.testing.assert_allclose(base.position[0, -1], truth.data.qpos[:3], atol=1e-8)
    np.testing.assert_allclose(tip.position[0, -1], truth.data.body("tip").xpos, atol=1e-7)
    for attitude, wanted in (
        (base.attitude[0, -1], Rotation.from_quat(run.attitude[-1])),
        (tip.attitude[0, -1], Rotation.from_matrix(truth.data.body("tip").xmat.reshape(3, 3))),
    ):
        assert (Rotation.from_quat(attitude) * wanted.inv()).magnitude() < 1e-7
    assert np.linalg.norm(base.position[0, -1]) > 0.001
    np.testing.assert_array_equal(base.position[0, 0], 0.0)


@pytest.mark.slow
def test_the_width_is_that_of_a_linearisation(predictor):
    """A prior of 1 % is nearly linear; 400 draws give a standard deviation to 3.5 %, and four of them."""
    prediction = predictor.predict(400, np.random.default_rng(1))
    known = np.array([name.startswith("initial-rate") for name in predictor.posterior.unknowns.names])
    steps = 0.1 * np.eye(predictor.posterior.size)[~known]
    ends = [predictor.courses(predictor.centre + sign * steps) for sign in (1.0, -1.0)]
    for part, trajectory in enumerate((prediction.base, prediction.tip)):
        slopes = (ends[0][part].position[:, -1] - ends[1][part].position[:, -1]) / 0.2
        linear = Region(np.zeros(3), 1e6 * slopes.T @ slopes)
        pose = trajectory.pose()
        np.testing.assert_allclose(pose.millimetres.sd, linear.sd, rtol=0.14, atol=1e-9)
        turns = [Rotation.from_quat(end[part].attitude[:, -1]) for end in ends]
        turned = np.degrees((turns[0] * turns[1].inv()).as_rotvec()) / 0.2
        np.testing.assert_allclose(pose.degrees.sd, np.sqrt((turned**2).sum(axis=0)), rtol=0.14, atol=1e-9)
        assert pose.millimetres.holds(1e3 * pose.position).mean() == pytest.approx(0.95, abs=0.045)
    assert prediction.tip.pose().millimetres.sd.max() > 0.01


def test_a_region_holds_what_it_states_of_draws_with_heavy_tails():
    rng = np.random.default_rng(3)
    draws = rng.normal(size=(60, 500, 3)) * rng.lognormal(sigma=0.5, size=(60, 500, 1)) * [3.0, 2.0, 0.1]
    held = [Region.of(own[:400]).holds(own[400:]).mean() for own in draws]
    normal = [Region(own[:400].mean(axis=0), np.cov(own[:400].T)).holds(own[400:]).mean() for own in draws]
    np.testing.assert_allclose(np.mean(held), 0.95, atol=0.012)  # three standard errors, and what 400 draws leave
    assert np.mean(normal) < 0.93


def test_a_region_is_an_ellipsoid():
    covariance = np.diag([4.0, 9.0, 1.0])
    region = Region(np.array([1.0, 2.0, 3.0]), covariance)
    np.testing.assert_allclose(region.semi_axes, REACH * np.array([3.0, 2.0, 1.0]))
    np.testing.assert_allclose(np.abs(region.directions), [[0, 1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(REACH, 2.7955, atol=1e-4)
    assert list(region.holds(region.mean + np.array([[0.0, 8.3, 0.0], [0.0, 8.5, 0.0]]))) == [True, False]


def test_what_cannot_be_predicted_is_an_error(predictor):
    model = predictor.posterior.model
    time = np.linspace(0.0, 10.0, 9)
    joints = {f"position.joint{k}": 0.1 * time for k in (1, 2)}
    force = {f"base_force.{axis}": np.ones(9) for axis in "xyz"}
    motion = MeasuredMotion.from_recording(Recording("plan", None, time, joints), model.robot)
    with pytest.raises(InputError, match=r"base_force.x\|y\|z: a known force acts on the base"):
        BasePredictor(model, Manoeuvre(Recording("plan", None, time, {**joints, **force}), motion))
    with pytest.raises(InputError, match="16 or more"):
        predictor.predict(3, np.random.default_rng(0))


# command line ---------------------------------------------------------------------------------------------------------

STUDY = f"""
title = "Plan"
[robot]
urdf = "{PLANAR}"
[orbit]
radius = {ORBIT.radius}
[sensors.rate]
sigma = 1e-5
[sensors.encoder]
sigma = 1e-6
[[recordings]]
file = "plan.csv"
attitude = [0.0, 0.0, 0.0, 1.0]
[unknowns]
bodies = ["base_link"]
spread = 0.05
[model]
effects = ["gravity-gradient"]
[design]
tip_frame = "tip"
"""


@pytest.fixture
def plan(tmp_path: Path, motion: mj.Motion) -> Path:
    time = np.linspace(0.0, DURATION, 41)
    position = np.array([motion(float(t))[0] for t in time])
    channels = {f"position.joint{k + 1}": position[:, k] for k in range(2)}
    Recording("plan", None, time, channels).write(tmp_path / "plan.csv")
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path / "study.toml"


@pytest.mark.slow
def test_simulate_reads_a_plan(plan: Path, tmp_path: Path) -> None:
    """A plan holds the joint motion only; the readings that are written are those of the model, with noise."""
    status, text = run("simulate", plan, "--output", tmp_path / "out")
    assert status == 0, text
    flown = Recording.read(tmp_path / "out" / "plan.csv")
    assert {"rate.x", "rate.y", "rate.z", "position.joint1"} <= set(flown.channels)
    _, rate = flown.vector("rate")
    assert 1e-4 < np.abs(rate).max() < 1.0
    status, text = run("simulate", plan, "--output", tmp_path / "exact", "--no-noise")
    assert status == 0, text
    _, exact = Recording.read(tmp_path / "exact" / "plan.csv").vector("rate")
    assert (rate - exact).std() == pytest.approx(1e-5, rel=0.3)
    report = PdfText.read(tmp_path / "out" / "report.pdf")
    assert "without noise, and as written to the file (drawn as measured)" in report


def test_predict_writes_a_pose_with_its_region(plan: Path, tmp_path: Path) -> None:
    output = tmp_path / "out"
    status, text = run("predict", plan, "--output", output, "--draws", 40)
    assert status == 0, text
    assert sorted(item.name for item in output.iterdir()) == ["prediction.json", "report.pdf"]
    content = json.loads((output / "prediction.json").read_text())["recordings"][0]
    assert content["tip_frame"] == "tip"
    assert content["initial_rate"] == {"value": [0.0, 0.0, 0.0], "unit": "rad/s"}
    for body in ("base", "tip"):
        assert set(content[body]["position"]["x"]) == {"mean", "sd", "unit"}
        assert content[body]["rotation"]["z"]["unit"] == "deg"
        assert len(content[body]["region"]["position"]["directions"]) == 3
        assert len(content[body]["course"]["position"]["sd"]) == len(content[body]["course"]["time"])
    # every draw starts where the base starts
    assert content["base"]["course"]["position"]["sd"][0] == [0.0, 0.0, 0.0]
    report = PdfText.read(output / "report.pdf")
    assert "command: bayesid predict" in report
    assert "Every ± is one standard deviation of 40 draws from the present knowledge of the robot." in report
    assert "plan: the base starts with the first measured rate" not in report
    for key, name in (("base", "base"), ("tip", "end-effector tip")):
        for quantity, unit in (("position", "mm"), ("rotation", "deg")):
            poses = [content[key][quantity][axis] for axis in "xyz"]
            cells = [format_quantity(pose["mean"], pose["sd"]) for pose in poses]
            assert report.row("plan", name, f"{quantity} [{unit}]", *cells)


def test_a_plan_without_a_joint_or_a_frame_is_an_error(plan: Path, tmp_path: Path) -> None:
    study = plan.read_text()
    plan.write_text(study.replace('"tip"', '"hand"'))
    status, text = run("predict", plan, "--output", tmp_path / "out")
    assert status == 2
    assert "no frame named 'hand'" in text
    assert "link2" in text
    plan.write_text(study)
    status, text = run("predict", plan, "--output", tmp_path / "out", "--posterior", tmp_path / "none.nc")
    assert status == 2
    assert "none.nc: there is no such file" in text
    rows = [line.split(",") for line in (tmp_path / "plan.csv").read_text().splitlines()]
    (tmp_path / "plan.csv").write_text("\n".join(",".join(row[:2]) for row in rows) + "\n")
    status, text = run("predict", plan, "--output", tmp_path / "out")
    assert status == 2
    assert "no position or velocity for joint joint2" in text
    assert not (tmp_path / "out").exists()
