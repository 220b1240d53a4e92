"""``bayesid loop`` as a user meets it: a plan to be flown, an own spacecraft, one clear error for bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import PLANAR
from test_cli import run

from bayesid.app.schema import DesignSection, Study
from bayesid.app.study_to_design import load_loop_problem
from bayesid.app.user_files import load_spacecraft
from bayesid.design import Loop
from bayesid.design.excitation_loop import flown
from bayesid.design.loop_history import History
from bayesid.recording.recording import Recording

STUDY = f"""
title = "Loop"
[robot]
urdf = "{PLANAR}"
[sensors.rate]
sigma = 1e-4
[sensors.encoder]
sigma = 1e-5
[unknowns]
bodies = ["base_link"]
spread = 0.05
[model]
initial_rate = "zero"
[design]
duration = 10.0
joints = ["joint2"]
[design.limits]
base_rotation = 0.15
"""

SPACECRAFT = """
def execute(plan):
    return plan
"""


DATACLASS = """
from __future__ import annotations
from dataclasses import dataclass

@dataclass
class Spacecraft:
    speed: float = 1.0

    def execute(self, plan):
        return plan
"""


@pytest.fixture
def study(tmp_path: Path) -> Path:
    file = tmp_path / "study.toml"
    file.write_text(STUDY)
    return file


def test_the_design_section_becomes_a_problem(study: Path):
    problem = load_loop_problem(Study.load(study))
    assert problem.plan.family.duration == 10.0
    assert problem.plan.family.moving == (1,)
    assert problem.limits.base_rotation == 0.15
    assert problem.plan.tip.name == "tip"


DESIGN = {
    "duration": ("duration = 20.0", lambda p: p.plan.family.duration, 20.0),
    "interval": ("duration = 10.0\ninterval = 0.25", lambda p: p.plan.interval, 0.25),
    "tip_frame": ("duration = 10.0\ntip_frame = 'link1'", lambda p: p.plan.tip.name, "link1"),
    "joints": ("duration = 10.0\njoints = ['joint2', 'joint1']", lambda p: p.plan.family.moving, (1, 0)),
    "start": ("duration = 10.0\nstart = {joint1 = 0.4}", lambda p: p.plan.family.posture_at_rest.tolist(), [0.4, 0.0]),
    "parameterisation": ("duration = 10.0\nparameterisation = 'fourier'", lambda p: p.plan.family.name, "fourier"),
    "functions": ("duration = 10.0\nfunctions = 3", lambda p: p.plan.family.size, 6),
    "criteria": (
        "duration = 10.0\ncriteria = ['e-optimal', 'a-optimal']",
        lambda p: names_of(p.criteria),
        ["e-optimal"],
    ),
    "options": ("duration = 10.0\noptions = {d-optimal = {draws = 3}}", lambda p: p.criteria[0].draws, 3),
    "rivals": (
        "duration = 10.0\nrivals = ['rate-bias', 'rate-scale']",
        lambda p: [effect.label for effect in p.plan.model.effects],
        ["rate-bias", "rate-scale"],
    ),
    "attitude": ("duration = 10.0\nattitude = [1, 0, 0, 0]", lambda p: p.plan.attitude.tolist(), [1.0, 0.0, 0.0, 0.0]),
    "attitude_sigma": ("duration = 10.0\nattitude_sigma = 0.01", lambda p: p.plan.attitude_sigma, 0.01),
    "argument_of_latitude": ("duration = 10.0\nargument_of_latitude = 1.5", lambda p: p.plan.argument_of_latitude, 1.5),
    "wheel_speed": (
        "duration = 10.0\nwheel_speed = {spinner = 30.0}\n"
        "[[robot.wheels]]\nname = 'spinner'\naxis = [0, 0, 1]\ninertia = 1e-3",
        lambda p: list(p.plan.wheel_speeds),
        ["spinner"],
    ),
    "limits": ("duration = 10.0\nlimits = {joint_speed = 0.2}", lambda p: p.limits.joint_speed, 0.2),
}


def names_of(criteria) -> list[str]:
    return [criterion.name for criterion in criteria]


@pytest.mark.parametrize("key", DESIGN)
def test_every_key_of_the_design_section_reaches_the_loop(study: Path, key: str):
    text, reached, value = DESIGN[key]
    before = STUDY[: STUDY.index("[design]")]
    study.write_text(f"{before}[design]\n{text}\n")
    assert reached(load_loop_problem(Study.load(study))) == value
    study.write_text(f"{before}[design]\nduration = 10.0\n")
    assert reached(load_loop_problem(Study.load(study))) != value


def test_no_key_of_the_design_section_is_left_out():
    assert set(DESIGN) == set(DesignSection.model_fields)


@pytest.mark.parametrize("key", ["duration", "start", "functions", "criteria", "attitude", "limits"])
def test_a_loop_is_told_from_another_by_its_design(study: Path, key: str):
    before = STUDY[: STUDY.index("[design]")]
    keys = []
    for text in ("duration = 10.0", DESIGN[key][0]):
        study.write_text(f"{before}[design]\n{text}\n")
        keys.append(Loop(load_loop_problem(Study.load(study)), {0: 1e-6})._key())
    assert keys[0] != keys[1]


def test_the_loop_plans_by_the_smallest_volume_from_where_the_first_recording_starts(study: Path):
    recording = """
[[recordings]]
file = "absent.csv"
attitude = [0.0, 1.0, 0.0, 0.0]
argument_of_latitude = 0.3
"""
    study.write_text(STUDY + recording)
    problem = load_loop_problem(Study.load(study))
    assert names_of(problem.criteria) == ["d-optimal"]
    assert problem.plan.attitude.tolist() == [0.0, 1.0, 0.0, 0.0]
    assert problem.plan.argument_of_latitude == 0.3
    study.write_text(STUDY.replace("[design]", "[design]\nattitude = [0, 0, 1, 0]") + recording)
    problem = load_loop_problem(Study.load(study))
    assert problem.plan.attitude.tolist() == [0.0, 0.0, 1.0, 0.0]
    assert problem.plan.argument_of_latitude == 0.3
    study.write_text(STUDY.replace("[design]", "[design]\nargument_of_latitude = 1.5") + recording)
    problem = load_loop_problem(Study.load(study))
    assert problem.plan.attitude.tolist() == [0.0, 1.0, 0.0, 0.0]
    assert problem.plan.argument_of_latitude == 1.5


def test_joints_recorded_by_speed_start_where_the_plan_does(study: Path):
    study.write_text(STUDY.replace("[design]", "[design]\nstart = {joint1 = 0.4}"))
    plan = load_loop_problem(Study.load(study)).plan
    time = np.arange(0.0, 10.1, 0.5)
    speeds = Recording("step-1", None, time, {f"velocity.joint{k}": 0.0 * time for k in (1, 2)})
    position = flown(plan, speeds, {1: 1e-5}).motion.evaluate(time).position
    np.testing.assert_allclose(position[0], [0.4, 0.0], atol=1e-9)
    np.testing.assert_allclose(position, np.tile([0.4, 0.0], (len(time), 1)), atol=0.01)  # a smoother of noisy speeds


STAR = "[sensors.attitude]\nsigma = 1e-4\n[unknowns]"
READ, PLANNED = [0.6, 0.0, 0.0, 0.8], [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("sensors", "first", "attitude", "sigma"),
    [(STAR, 0.0, READ, 1e-3), (STAR, 0.5, PLANNED, 0.0), ("[unknowns]", 0.0, PLANNED, 0.0)],
    ids=["declared", "declared, and read later", "not declared"],
)
def test_a_flight_starts_as_its_star_sensor_says_or_as_planned(study: Path, sensors, first, attitude, sigma):
    study.write_text(STUDY.replace("[unknowns]", sensors))
    time = np.arange(0.0, 10.1, 0.5)
    channels = {f"position.joint{k}": 0.0 * time for k in (1, 2)}
    channels |= {f"attitude.{axis}": np.where(time < first, np.nan, READ[k]) for k, axis in enumerate("xyzw")}
    manoeuvre = flown(load_loop_problem(Study.load(study)).plan, Recording("step-1", None, time, channels), {0: 1e-6})
    np.testing.assert_allclose(manoeuvre.attitude, attitude, atol=1e-12)
    assert manoeuvre.attitude_sigma == pytest.approx(sigma)


def test_without_a_spacecraft_the_plan_is_written_and_the_command_waits(study, tmp_path, monkeypatch):
    monkeypatch.setattr(Loop, "_plan", planned)
    output = tmp_path / "out"
    status, text = run("loop", study, "--output", output)
    assert status == 0, text
    assert "step-1-plan.csv" in text
    assert "step-1-recording.csv" in text
    assert json.loads((output / "loop.json").read_text())["status"] == "waiting"
    # a recording without sensors, put where it belongs
    Recording.read(output / "step-1-plan.csv").write(output / "step-1-recording.csv")
    status, text = run("loop", study, "--output", output)
    assert status == 2
    assert "rate" in text
    assert text.count(" Error: ") + text.startswith("Error: ") == 1


def planned(self: Loop, history: History, number: int, problem, progress) -> bool:
    """Stand for a search, which would take long to compile."""
    time = np.arange(0.0, 10.1, 0.5)
    names = [f"{family}.joint{index}" for family in ("position", "velocity", "acceleration") for index in (1, 2)]
    Recording("step-1", None, time, dict.fromkeys(names, 0.0 * time)).write(history.path(number, "plan"))
    history.record(number, "plan", {"go": True, "attempts": [{"go": True, "limits": {}}]})
    return True


def test_a_users_file_executes(tmp_path: Path):
    file, time = tmp_path / "mine.py", np.arange(0.0, 10.1, 0.5)
    plan = Recording("step-1", None, time, {"position.joint1": time})
    file.write_text(SPACECRAFT)
    assert load_spacecraft(file).execute(plan) is plan
    file.write_text("class Spacecraft:\n    def execute(self, plan):\n        return plan\n")
    assert load_spacecraft(file).execute(plan) is plan
    file.write_text(DATACLASS)
    assert load_spacecraft(file).execute(plan) is plan


@pytest.mark.parametrize(
    ("content", "options", "words"),
    [
        (None, (), ["no such Python file", "execute(plan)"]),
        ("1 / 0", (), ["ZeroDivisionError", "Correct the file"]),
        ("def execute(plan):\n    return plan.nothing\n", (), ["execute fails", "nothing"]),
        ("x = 1", (), ["it defines no spacecraft"]),
        ("def execute(plan):\n    return 3\n", (), ["execute returned a int", "Recording.read"]),
        (SPACECRAFT, ("--wanted", 2.0), ["2 is not between 0 and 1"]),
        (SPACECRAFT, ("--wanted-sd", "base_link=0.5"), ["does not name a body to identify", "base_link.mass=0.5"]),
        (SPACECRAFT, ("--wanted-sd", "base_link.mass=light"), ["has no number after '='"]),
        (SPACECRAFT, ("--wanted-sd", "base_link.weight=0.5"), ["'weight' is not a quantity of a body", "mass"]),
        (SPACECRAFT, ("--wanted-tip", -1), ["-1 mm"]),
        (SPACECRAFT, ("--wanted-cause", "payload:link2=0.2"), ["0.2 is not a decisive probability"]),
        (SPACECRAFT, ("--no-diagnose", "--wanted-cause", "payload:link2"), ["the steps are not reviewed"]),
        (SPACECRAFT, ("--wanted-cause", "payloads:link2"), ["unknown effect 'payloads:link2'", "payload"]),
        (SPACECRAFT, ("--at-most", 0), ["0 manoeuvres"]),
    ],
)
def test_bad_input_is_one_clear_error(study, tmp_path, monkeypatch, content, options, words):
    monkeypatch.setattr(Loop, "_plan", planned)
    file = tmp_path / "mine.py"
    if content is not None:
        file.write_text(content)
    status, text = run("loop", study, "--output", tmp_path / "out", "--spacecraft", file, *options)
    assert status == 2, text
    assert text.count(" Error: ") + text.startswith("Error: ") == 1
    for word in words:
        assert word in text, text


def test_an_unknown_joint_is_an_error(study: Path, tmp_path: Path):
    study.write_text(STUDY.replace('joints = ["joint2"]', 'joints = ["elbow"]'))
    status, text = run("loop", study, "--output", tmp_path / "out")
    assert status == 2
    assert "no moving joint 'elbow'" in text
    assert "joint1, joint2" in text


FLIES = """
from pathlib import Path

from bayesid.app.schema import Study
from bayesid.app.study_to_design import load_loop_problem
from bayesid.design import SimulatedSpacecraft


class Spacecraft:
    def __init__(self):
        self.truth = SimulatedSpacecraft(load_loop_problem(Study.load({study!r})).plan.model, 1e-5, seed=3)

    def execute(self, plan):
        if plan.name == "step-2" and Path({tired!r}).exists():
            raise RuntimeError("killed")
        return self.truth.execute(plan)
"""


@pytest.mark.slow  # two minutes of a processor
def test_the_command_plans_flies_identifies_and_goes_on_with_the_same_numbers(tmp_path: Path):
    file, tired = tmp_path / "study.toml", tmp_path / "tired"
    # what moves in a plane shows little of the base: a narrow prior and a criterion that compiles fast do here
    file.write_text(
        STUDY.replace("spread = 0.05", "spread = 0.01").replace(
            "[design]", "[design]\ncriteria = ['paper-26-intended']"
        )
    )
    spacecraft = tmp_path / "mine.py"
    spacecraft.write_text(FLIES.format(study=str(file), tired=str(tired)))
    options = ("--spacecraft", spacecraft, "--at-most", 2, "--samples", 100, "--no-diagnose", "--wanted", 1e-6)
    outputs = [tmp_path / name for name in ("whole", "parts")]
    status, text = run("loop", file, "--output", outputs[0], *options)
    assert status == 0, text
    tired.touch()
    status, text = run("loop", file, "--output", outputs[1], *options)
    assert status == 2
    assert "killed" in text
    assert len(json.loads((outputs[1] / "loop.json").read_text())["steps"]) == 2
    tired.unlink()
    status, text = run("loop", file, "--output", outputs[1], *options)
    assert status == 0, text
    whole, parts = (json.loads((output / "loop.json").read_text()) for output in outputs)
    assert whole["status"] == parts["status"] == "at-most"
    for first, second in zip(whole["steps"], parts["steps"], strict=True):
        assert first["plan"]["parameters"] == second["plan"]["parameters"]
        assert first["identification"]["bodies"] == second["identification"]["bodies"]
        assert first["goals"] == second["goals"]
    assert "mass" in whole["steps"][1]["identification"]["bodies"]["base_link"]
    assert (outputs[1] / "report.pdf").read_bytes().startswith(b"%PDF")
