"""The command identifiability from end to end: its JSON beside that of identify, plans, robots alone, errors."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import ENCODER, ORBIT, PLANAR, POINT, SIGMA
from test_cli import run

from bayesid.recording.recording import Recording
from bayesid.report.numbers import format_percent, format_quantity, format_unit
from tests.pdf_text import PdfText

STUDY = f"""
title = "Table"
[robot]
urdf = "{PLANAR}"
[orbit]
radius = {ORBIT.radius}
[sensors.rate]
sigma = {SIGMA}
[sensors.accel]
sigma = {SIGMA}
position = {list(POINT)}
[sensors.encoder]
sigma = {ENCODER}
[[recordings]]
file = "planar.csv"
attitude = [0.0, 0.0, 0.0, 1.0]
[unknowns]
bodies = ["base_link"]
spread = 0.3
[model]
effects = ["gravity-gradient"]
"""


@pytest.fixture(scope="module")
def study(noisy: Callable[..., Recording], tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    noisy(np.random.default_rng(7)).write(folder / "planar.csv")
    (folder / "study.toml").write_text(STUDY)
    return folder / "study.toml"


@pytest.fixture(scope="module")
def made(study: Path) -> tuple[dict, str, PdfText]:
    """The command's JSON, its output, and the text of its report."""
    status, text = run("identifiability", study, "--output", study.parent / "out", "--seed", 3)
    assert status == 0, text
    names = sorted(item.name for item in (study.parent / "out").iterdir())
    assert names == ["identifiability.json", "report.pdf"]
    return (
        json.loads((study.parent / "out" / "identifiability.json").read_text()),
        text,
        PdfText.read(study.parent / "out" / "report.pdf"),
    )


@pytest.mark.slow
def test_the_json_is_that_of_the_contract(made: tuple[dict, str, PdfText]) -> None:
    content = made[0]
    assert (content["standard_parameters"], content["base_parameters"], content["basis"]) == (30, 24, "fit")
    assert len(content["independent"]) == 24
    assert len(content["dependent"]) == 6
    assert np.shape(content["regrouping"]) == (24, 6)
    assert len(content["directions"]) == len(content["parameters"]) == 10
    prior, own = (np.array(content[key]["matrix"]) for key in ("prior_covariance", "covariance"))
    told = {advice["name"]: advice for advice in content["advice"]}
    assert {"better-rate", "add-attitude", "add-torque", "known-mass:base_link", "thrust", "swing:joint1"} <= set(told)
    assert all(advice["evaluated"] for advice in told.values() if not advice["name"].startswith("swing"))
    ratios = []
    for direction in content["directions"]:
        assert list(direction["combination"]) == content["covariance"]["names"]
        weights = np.array(list(direction["combination"].values()))
        assert direction["sd"] == pytest.approx(np.sqrt(weights @ own @ weights), rel=1e-6)
        assert direction["prior_sd"] == pytest.approx(np.sqrt(weights @ prior @ weights), rel=1e-6)
        assert direction["shrinkage"] == pytest.approx(1.0 - direction["sd"] / direction["prior_sd"])
        assert direction["words"]
        ratios.append(direction["sd"] / direction["prior_sd"])
    assert ratios == sorted(ratios, reverse=True)
    for index, parameter in enumerate(content["parameters"]):
        assert parameter["sd"] == pytest.approx(np.sqrt(own[index, index]), rel=1e-9)
        assert parameter["conditional_sd"] <= parameter["sd"] * (1.0 + 1e-9)
    evaluated = [item for item in content["advice"] if item["evaluated"]]
    assert {"better-rate", "better-accel", "add-attitude", "thrust", "wheels", "twice"} <= {
        x["name"] for x in evaluated
    }
    first = [item["worst_directions"][0] for item in evaluated]
    assert first == sorted(first)


@pytest.mark.usefixtures("slow")
def test_identify_agrees_on_every_direction_and_says_what_it_learnt(
    made: tuple[dict, str, PdfText], study: Path
) -> None:
    status, text = run("identify", study, "--output", study.parent / "identified", "--samples", 600)
    assert status == 0, text
    found = json.loads((study.parent / "identified" / "identification.json").read_text())
    names = found["covariance"]["names"]
    assert names == made[0]["covariance"]["names"]
    matrix = np.array(found["covariance"]["matrix"])
    for direction in made[0]["directions"]:
        weights = np.array([direction["combination"][name] for name in names])
        assert direction["sd"] == pytest.approx(np.sqrt(weights @ matrix @ weights), rel=0.15)
        assert direction["sampled_sd"] == pytest.approx(direction["sd"], rel=0.1)
    assert set(found["learnt"]) == set(names)
    for parameter in made[0]["parameters"]:
        contraction = found["learnt"][parameter["name"]]
        assert contraction["verdict"] == parameter["verdict"]
        assert 1.0 - contraction["shrinkage"] == pytest.approx(1.0 - parameter["shrinkage"], rel=0.5)


@pytest.mark.slow
def test_the_report_holds_directions_parameters_and_structure(made: tuple[dict, str, PdfText]) -> None:
    content, text, report = made
    worst = content["directions"][0]["words"]
    assert worst in report
    assert worst in text
    for words in (
        "Of 30 standard inertial parameters",
        "depend on 24",
        "was fitted to 1 recording",
        "nats",
        "command: bayesid identifiability",
    ):
        assert words in report, words
    for number, direction in enumerate(content["directions"], start=1):
        left = format_percent(direction["sd"] / direction["prior_sd"])
        assert report.row(str(number), left, direction["verdict"], direction["words"].partition(": ")[0])
    for item in content["parameters"]:
        assert report.row(item["name"], format_unit(item["unit"]), format_quantity(item["mean"], item["sd"])), item[
            "name"
        ]
    dependent = content["dependent"]
    assert f"the {len(dependent)} dependent parameters are {', '.join(dependent)}." in report
    alone = [
        name
        for name, row in zip(content["independent"], content["regrouping"], strict=True)
        if np.abs(row).max() < 1e-9
    ]
    assert alone
    assert f"The other base parameters are single parameters: {', '.join(alone)}." in report


def test_a_study_without_recordings_gets_the_structure_alone(tmp_path: Path) -> None:
    text = STUDY.replace('[[recordings]]\nfile = "planar.csv"\nattitude = [0.0, 0.0, 0.0, 1.0]\n', "")
    assert "[[recordings]]" not in text
    (tmp_path / "study.toml").write_text(text)
    status, output = run("identifiability", tmp_path / "study.toml", "--output", tmp_path / "out")
    assert status == 0, output
    content = json.loads((tmp_path / "out" / "identifiability.json").read_text())
    assert (content["base_parameters"], content["directions"], content["basis"]) == (24, [], "not evaluated")
    assert "not evaluated: the study names no [[recordings]]" in content["statement"]
    report = PdfText.read(tmp_path / "out" / "report.pdf")
    assert "Of 30 standard inertial parameters of the robot, motion and torques depend on 24 combinations" in report
    assert content["statement"] in report
    assert "Directions" not in report


@pytest.mark.usefixtures("slow")
def test_joint_motion_alone_gives_a_prediction_that_the_fit_bears_out(
    made: tuple[dict, str, PdfText], study: Path, tmp_path: Path
) -> None:
    recording = Recording.read(study.parent / "planar.csv")
    joints = {name: values for name, values in recording.channels.items() if name.startswith("position.")}
    Recording("planar", None, recording.time, joints).write(tmp_path / "planar.csv")
    torques = STUDY.replace(
        "[[recordings]]", "[sensors.torque]\nsigma = 10.0\n[[recordings]]"
    )  # too coarse to tell much
    (tmp_path / "study.toml").write_text(torques)
    status, output = run("identifiability", tmp_path / "study.toml", "--output", tmp_path / "out", "--profiles", 0)
    assert status == 0, output
    content = json.loads((tmp_path / "out" / "identifiability.json").read_text())
    assert content["basis"] == "prediction"
    assert "This is a prediction: 1 recording without rate, accel, torque" in content["statement"]
    assert "This is a prediction" in output
    assert "better-torque" in {advice["name"] for advice in content["advice"]}
    # the flight also tumbled, which the plan does not know: it tells less
    predicted, flown = ({p["name"]: p["sd"] for p in data["parameters"]} for data in (content, made[0]))
    assert flown["base_link.mass"] * 0.5 < predicted["base_link.mass"] < flown["base_link.mass"] * 3.0


BAD = {
    "file": ("planar.csv", "absent.csv", ["absent.csv", "there is no such file"]),
    "effect": ("gravity-gradient", "gravity-gradiant", ["study.toml", "gravity-gradiant"]),
    "joint left out": (
        "planar.urdf",
        "ets7.urdf",
        ["planar.csv", "joint3", "Record exactly the robot's moving joints"],
    ),
    "body": ('bodies = ["base_link"]', 'bodies = ["base"]', ["study.toml", "'base'"]),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_input_gives_one_clear_error(kind: str, tmp_path: Path) -> None:
    old, new, words = BAD[kind]
    time = np.arange(0.0, 10.0, 0.5)
    joints = {f"position.joint{number}": 0.1 * np.sin(time) for number in (1, 2)}
    Recording("planar", None, time, joints).write(tmp_path / "planar.csv")
    (tmp_path / "study.toml").write_text(STUDY.replace(old, new))
    status, text = run("identifiability", tmp_path / "study.toml", "--output", tmp_path / "out")
    assert status == 2, text
    assert text.count("Error:") == 1
    for word in words:
        assert word in text, text
    assert not (tmp_path / "out").exists()
