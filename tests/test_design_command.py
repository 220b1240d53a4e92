"""Design from the command line: files, limits against Pinocchio, errors, a search taken up again, the report."""

from __future__ import annotations

import json
import time
from pathlib import Path
from threading import Lock

import numpy as np
import pinocchio as pin
import pytest
from conftest import PLANAR
from scipy.interpolate import make_interp_spline
from test_cli import run

from bayesid._io.errors import InputError
from bayesid._io.progress import silent
from bayesid.app import study_to_design
from bayesid.app.schema import Study
from bayesid.app.study_to_design import fly_next, load_problem, write_motion
from bayesid.app.study_to_encoders import assume_missing, encoder_noise
from bayesid.design import Store
from bayesid.design.refine import _Descent
from bayesid.design.trajectories import extended_posture
from bayesid.recording.recording import Recording
from bayesid.report.numbers import format_fixed, format_number
from bayesid.robot.kinematics import Tip
from bayesid.robot.robot import Robot
from studies.common.ets7 import extended_wrist
from tests.pdf_text import PdfText

TIP_SPEED, TIP_RATE = 0.15, 0.12

STUDY = f"""
title = "Table"
[robot]
urdf = "{PLANAR}"
[sensors.rate]
sigma = 1e-5
[sensors.encoder]
sigma = 1e-6
[unknowns]
bodies = ["base_link"]
spread = 0.05
[model]
effects = []
initial_rate = "zero"
[design]
duration = 30.0
interval = 1.0
functions = 2
joints = ["joint1", "joint2"]
start = {{ joint2 = 0.8 }}
criteria = ["paper-26", "condition-number"]
tip_frame = "tip"
[design.limits]
tip_speed = {TIP_SPEED}
tip_rate = {TIP_RATE}
"""

EFFORT = ("--starts", 2, "--iterations", 8, "--seed", 3)


def write(folder: Path, change=lambda text: text) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(change(STUDY))
    return folder / "study.toml"


def wait_for(file: Path, seconds: float = 60.0) -> None:
    """Wait until a file is there; the caller's assertions fail if it never comes."""
    end = time.monotonic() + seconds
    while not file.exists() and time.monotonic() < end:
        time.sleep(0.01)


@pytest.fixture(scope="module")
def shared_problem():
    """Commands on the same study share one problem, so that it is compiled once."""
    problems, patch = {}, pytest.MonkeyPatch()

    def load(study: Study):
        text = study.file.read_text() + repr(study.design)
        if text not in problems:
            problems[text] = load_problem(study)
        return problems[text]

    with patch.context() as changed:
        changed.setattr(study_to_design, "load_problem", load)
        yield


@pytest.fixture(scope="module")
def made(shared_problem, tmp_path_factory: pytest.TempPathFactory):
    """A design that was interrupted in its second search and taken up again; the text of its report."""
    folder, patch = tmp_path_factory.mktemp("design"), pytest.MonkeyPatch()
    file, kept, one_at_a_time = write(folder), [], Lock()
    descend = _Descent.run

    def stop(self) -> None:
        with one_at_a_time:
            if len(kept) == 1:
                wait_for(folder / "out" / "search.json")  # what ends before the interruption is on disk
                raise KeyboardInterrupt
            descend(self)
            kept.append(self.best)

    with patch.context() as interrupted:
        interrupted.setattr(_Descent, "run", stop)
        status, text = run("design", file, "--output", folder / "out", *EFFORT)
    assert status == 130
    assert "resume from the stored results" in text
    assert [item.name for item in (folder / "out").iterdir()] == ["search.json"]
    status, text = run("design", file, "--output", folder / "out", *EFFORT)
    assert status == 0, text
    return folder, text, PdfText.read(folder / "out" / "report.pdf")


@pytest.mark.slow
def test_files_are_those_of_the_contract(made):
    folder, text, _ = made
    names = sorted(item.name for item in (folder / "out").iterdir())
    assert names == ["condition-number.csv", "design.json", "paper-26.csv", "report.pdf"]
    content = json.loads((folder / "out" / "design.json").read_text())
    assert content["best"] in text
    assert [item["name"] for item in content["manoeuvres"]] == ["paper-26", "condition-number"]
    for item in content["manoeuvres"]:
        assert set(item) >= {"name", "criterion", "parameters", "predicted_sd", "log_det_covariance", "limits", "file"}
        assert set(item["predicted_sd"]) >= {"base_link.mass", "base_link.com.x", "base_link.inertia.yz"}
        assert set(item["limits"]["tip_speed"]) >= {"limit", "largest"}
        assert item["limits"]["tip_speed"]["limit"] == TIP_SPEED
        assert len(item["parameters"]) == 4
    best = min(content["manoeuvres"], key=lambda item: item["log_det_covariance"])
    assert content["best"] == best["name"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper-26", "condition-number"])
def test_a_manoeuvre_keeps_its_limits_by_independent_kinematics(made, name: str):
    """The tip's twist relative to the base, by Pinocchio, 30 times more finely than the optimiser looked."""
    recording = Recording.read(made[0] / "out" / f"{name}.csv")
    assert list(recording.channels) == ["position.joint1", "position.joint2"]
    robot = pin.buildModelFromUrdf(str(PLANAR))
    data, frame = robot.createData(), robot.getFrameId("tip")
    position = np.column_stack([recording.channels[f"position.joint{k}"] for k in (1, 2)])
    spline = make_interp_spline(recording.time, position, k=5)
    fine = np.linspace(0.0, recording.time[-1], 1801)
    twists = []
    for q, speed in zip(spline(fine), spline(fine, nu=1), strict=True):
        pin.forwardKinematics(robot, data, q, speed)
        twists.append(pin.getFrameVelocity(robot, data, frame, pin.LOCAL_WORLD_ALIGNED).vector)
    speed, rate = (np.linalg.norm(np.array(twists)[:, part], axis=1).max() for part in (slice(3), slice(3, 6)))
    content = json.loads((made[0] / "out" / "design.json").read_text())["manoeuvres"]
    limits = next(item for item in content if item["name"] == name)["limits"]
    assert speed <= limits["tip_speed"]["largest"] * 1.002 <= TIP_SPEED * 1.003
    assert rate <= limits["tip_rate"]["largest"] * 1.002 <= TIP_RATE * 1.003
    # a condition number does not depend on how far the joints swing
    assert max(speed / TIP_SPEED, rate / TIP_RATE) > (0.9 if name == "paper-26" else 0.1)
    np.testing.assert_allclose(position[[0, -1]], [[0.0, 0.8]] * 2, atol=1e-9)
    assert np.abs(spline(fine)).max() < 2.8


@pytest.mark.slow
def test_a_search_taken_up_again_ends_as_one_never_interrupted(made, tmp_path: Path):
    folder = made[0]
    status, text = run("design", folder / "study.toml", "--output", tmp_path, *EFFORT)
    assert status == 0, text
    assert json.loads((tmp_path / "design.json").read_text()) == json.loads(
        (folder / "out" / "design.json").read_text()
    )


@pytest.mark.slow
def test_a_thorough_search_goes_on_from_the_best_motions(made, tmp_path: Path):
    status, text = run("design", made[0] / "study.toml", "--output", tmp_path, *EFFORT, "--thorough")
    assert status == 0, text
    before, after = (
        json.loads((folder / "design.json").read_text())["manoeuvres"] for folder in (made[0] / "out", tmp_path)
    )
    for plain, thorough in zip(before, after, strict=True):
        assert thorough["search"]["evaluations"] > 2 * plain["search"]["evaluations"]


@pytest.mark.slow
def test_the_report_holds_the_result_and_the_assumptions(made):
    text = made[2]
    content = json.loads((made[0] / "out" / "design.json").read_text())
    for words in (
        "2 manoeuvres of 30 s for the robot planar, of the family",
        "were designed to identify base_link",
        "command: bayesid design study.toml",
        f"The smallest posterior is that of {content['best']}",
        "−y1² + y2² + 3 y3²",
        "white noise of the sensors and the noise of the encoders",
        "each the larger of the one relative to the base",
        "initial rate, which the manoeuvre does not cause, is omitted",
        "99 % quantile",
    ):
        assert words in text, words
    first, second = content["manoeuvres"]
    assert (first["name"], second["name"]) == ("paper-26", "condition-number")
    for item in (first, second):
        assert text.row(item["name"], format_fixed(item["log_det_covariance"], 2))
    for name, sd in first["predicted_sd"].items():
        unit, *_ = (unit for key, unit in (("mass", "kg"), ("com", "m"), ("inertia", "kg m²")) if f".{key}" in name)
        other = second["predicted_sd"][name]
        pair = [format_number(value["sd"] if isinstance(value, dict) else value) for value in (sd, other)]
        assert f"{name}{unit}" in text
        assert text.row(*pair)


BAD = {
    "criterion": ('"condition-number"]', '"z-optimal"]', ["design.criteria #2", "z-optimal", "d-optimal"]),
    "joint": ('"joint2"]', '"joint7"]', ["design.joints #2", "joint7", "Did you mean 'joint"]),
    "frame": ('tip_frame = "tip"', 'tip_frame = "tool"', ["design.tip_frame", "tool", "link2"]),
    "start": ("joint2 = 0.8", "joint2 = 8.0", ["design.start.joint2", "8 rad", "2.8"]),
    "start joint": ("joint2 = 0.8", "elbow = 0.8", ["design.start.elbow", "no moving joint 'elbow'"]),
    "nothing unknown": ('bodies = ["base_link"]', "bodies = []", ["unknowns.bodies", "nothing is unknown"]),
    "interval": ("interval = 1.0", "interval = 5.0", ["design.interval", "fewer than 16 samples"]),
    "one rival": ("functions = 2", 'rivals = ["rate-bias"]', ["design.rivals", "at least two"]),
    "rival": (
        "functions = 2",
        'rivals = ["rate-bias", "gravity-gradient"]',
        ["design.rivals", "gravity-gradient", "orbit"],
    ),
    "odd": ("functions = 2", 'functions = 3\nparameterisation = "fourier"', ["design.functions", "even"]),
    "paper": ("functions = 2", 'functions = 2\nparameterisation = "paper"', ["design.functions", "Remove it"]),
    "not in JAX": (
        "effects = []",
        'effects = ["joint-flexibility:joint1"]',
        ["model.effects", "joint-flexibility:joint1", "outside JAX"],
    ),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_input_gives_one_clear_error(kind: str, tmp_path: Path):
    old, new, words = BAD[kind]
    assert old in STUDY
    file = write(tmp_path, lambda text: text.replace(old, new))
    status, text = run("design", file, "--output", tmp_path / "out")
    assert status == 2, text
    assert text.count("Error:") == 1
    for word in ["study.toml" if kind != "frame" else "planar.urdf", *words]:
        assert word in text, text
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_limits_that_only_rest_keeps_are_an_error(tmp_path: Path):
    limits = f"tip_speed = {TIP_SPEED}\ntip_rate = {TIP_RATE}"
    file = write(tmp_path, lambda text: text.replace(limits, "quiet_band = [0.0, 0.5]"))
    status, text = run("design", file, "--output", tmp_path / "out", "--starts", 1, "--iterations", 2)
    assert status == 2, text
    for word in ("study.toml", "design.limits", "quiet_band", "Relax"):
        assert word in text, text
    assert not list((tmp_path / "out").iterdir()) if (tmp_path / "out").exists() else True


def test_rivals_extend_the_model_and_ask_for_separation(tmp_path: Path):
    study = Study.load(
        write(
            tmp_path,
            lambda text: text.replace(
                'criteria = ["paper-26", "condition-number"]', 'rivals = ["rate-bias", "rate-scale"]'
            ),
        )
    )
    problem = load_problem(study)
    assert [effect.label for effect in problem.plan.model.effects] == ["rate-bias", "rate-scale"]
    assert problem.criteria[-1].rivals == ("rate-bias", "rate-scale")
    assert [criterion.name for criterion in problem.criteria[:2]] == ["paper-26", "condition-number"]
    assert assume_missing(encoder_noise(study, problem.plan.model.robot))[0][0] == {"joint1": 1e-6, "joint2": 1e-6}
    assert len(problem.plan.samples) <= 121


def test_the_papers_family_extends_the_wrist():
    robot = Robot.shipped("ets7")
    posture = extended_posture(robot, np.zeros(6), [3, 4, 5], 2, Tip.of(robot, "tip"))
    np.testing.assert_allclose(posture[3:], extended_wrist(), atol=1e-4)
    np.testing.assert_array_equal(posture[:3], 0.0)


def test_state_of_another_question_is_not_used(tmp_path: Path):
    store = Store(tmp_path / "search.json", "one")
    store.of("a").keep("0.0", np.array([1.0]), 2.0, 7)
    assert Store.open(tmp_path / "search.json", "one").of("a").known("0.0")[1:] == (2.0, 7)
    assert Store.open(tmp_path / "search.json", "two").of("a").known("0.0") is None
    (tmp_path / "search.json").write_text("{")
    with pytest.raises(InputError, match="Delete the file"):
        Store.open(tmp_path / "search.json", "one")


@pytest.mark.usefixtures("slow")
def test_two_effects_are_told_apart_by_hand(tmp_path: Path):
    """The option stands for rivals and their separation alone; the file holds neither."""
    file = write(tmp_path)
    effort = ("--starts", 1, "--iterations", 3, "--seed", 3)
    status, text = run("design", file, "--output", tmp_path / "out", *effort, "--separate", "rate-bias", "rate-scale")
    assert status == 0, text
    content = json.loads((tmp_path / "out" / "design.json").read_text())
    assert [item["criterion"] for item in content["manoeuvres"]] == ["separation"]
    assert "separation distinguishes rate-bias and rate-scale" in " ".join(text.split())
    decisions = content["manoeuvres"][0]["decisions"]
    assert set(decisions) == {"rate-bias", "rate-scale"}
    assert all(0.0 < each["rate"] < 1.0 and each["standard_error"] < 0.01 for each in decisions.values())
    status, text = run("design", file, "--output", tmp_path / "out2", *effort, "--separate", "rate-bias", "rate-bias")
    assert status != 0
    assert "cannot be distinguished from itself" in " ".join(text.split())


@pytest.mark.usefixtures("slow")
def test_the_next_manoeuvre_keeps_the_limits_and_is_written_as_joint_motion(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(STUDY, encoding="utf-8")
    study = Study.load(file)
    designed = fly_next(study, ("rate-bias", "rate-scale"), 1, silent)
    assert designed.criterion == "separation"
    assert all(item.largest <= item.limit * (1.0 + 1e-9) for item in designed.reached)
    write_motion(designed, tmp_path / "next.csv")
    flown = Recording.read(tmp_path / "next.csv")
    assert set(flown.channels) == {"position.joint1", "position.joint2"}
    assert flown.time[-1] == 30.0
    assert np.ptp(flown.channels["position.joint1"]) > 0.05


def test_no_manoeuvre_is_designed_for_causes_that_the_design_cannot_weigh(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(STUDY + "\n[orbit]\nradius = 6.9e6\n", encoding="utf-8")
    with pytest.raises(InputError, match="no unknown size"):
        fly_next(Study.load(file), ("rate-bias", "gravity-gradient"), 1, silent)
