"""``bayesid loop`` as a user meets it: a plan to be flown, an own spacecraft, one clear error for bad input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from conftest import PLANAR
from test_cli import run

from bayesid.app.loop_command import load_spacecraft, problem_of
from bayesid.app.schema import Study
from bayesid.design import Loop
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


@pytest.fixture
def study(tmp_path: Path) -> Path:
    file = tmp_path / "study.toml"
    file.write_text(STUDY)
    return file


def test_the_design_section_becomes_a_problem(study: Path):
    problem = problem_of(Study.load(study))
    assert problem.plan.family.duration == 10.0
    assert problem.plan.family.moving == (1,)
    assert problem.limits.base_rotation == 0.15
    assert problem.plan.tip.name == "tip"


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


@pytest.mark.parametrize(
    ("content", "options", "words"),
    [
        (None, (), ["no such Python file", "execute(plan)"]),
        ("1 / 0", (), ["ZeroDivisionError", "Correct the file"]),
        ("def execute(plan):\n    return plan.nothing\n", (), ["execute fails", "nothing"]),
        ("x = 1", (), ["it defines no spacecraft"]),
        ("def execute(plan):\n    return 3\n", (), ["execute returned a int", "Recording.read"]),
        (SPACECRAFT, ("--wanted", 2.0), ["2 is not between 0 and 1"]),
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
    assert "no moving joint named 'elbow'" in text
    assert "joint1, joint2" in text
