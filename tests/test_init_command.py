"""A first study drafted by ``bayesid init``: it is valid at once, and says what it could not know."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from bayesid.app.command_line import app
from bayesid.app.schema import Study
from bayesid.app.study_draft import channel_noise
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.recording.recording import Recording
from studies.truth.bodies import SERVICER3
from studies.truth.mujoco import Manoeuvres, Sensors, write_study

SENSORS = Sensors(rate_sigma=2e-5, accel_sigma=5e-5, attitude_sigma=1e-4, attitude_period=0.5, encoder_sigma=3e-6)


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, re.sub(r"\s+", " ", result.output)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a robot and two recordings made by MuJoCo."""
    made = write_study(
        tmp_path_factory.mktemp("flown"),
        SERVICER3,
        np.random.default_rng(4),
        orbit=None,
        sensors=SENSORS,
        manoeuvres=Manoeuvres(count=2, duration=60.0),
    )
    made.file.unlink()
    return made.file.parent


def copied(flown: Path, folder: Path) -> list[Path]:
    for item in flown.iterdir():
        (folder / item.name).write_bytes(item.read_bytes())
    return [folder / "robot.urdf", *sorted(folder.glob("*.csv"))]


def drafted(files: list[Path], study: Path) -> dict[str, Any]:
    status, output = run("init", *files, "--output", study)
    assert status == 0, output
    return tomllib.loads(study.read_text(encoding="utf-8"))


def test_check_passes_on_a_drafted_study_at_once(flown, tmp_path, slow):
    study = tmp_path / "new" / "study.toml"
    drafted(copied(flown, tmp_path), study)
    status, output = run("check", study, "--output", tmp_path / "check")
    assert status == 0, output
    marks = study.read_text(encoding="utf-8").count("# please check")
    assert f"{marks} places are still marked `# please check`" in " ".join(output.split())
    assert (tmp_path / "check" / "check.json").is_file()


def test_a_drafted_study_names_all_files_and_loads(flown, tmp_path):
    study = tmp_path / "new" / "study.toml"
    content = drafted(copied(flown, tmp_path), study)
    assert content["robot"]["urdf"] == "../robot.urdf"
    assert [item["file"] for item in content["recordings"]] == ["../manoeuvre-1.csv", "../manoeuvre-2.csv"]
    assert content["unknowns"]["bodies"] == ["base_link"]
    loaded = Study.load(study)
    model = load_model(loaded)
    assert [item.motion.names for item in load_manoeuvres(loaded, model.robot)] == [("joint1", "joint2", "joint3")] * 2


def test_the_noise_of_every_sensor_is_found_within_a_quarter(flown, tmp_path):
    sensors = drafted(copied(flown, tmp_path), tmp_path / "study.toml")["sensors"]
    truth = {"rate": 2e-5, "accel": 5e-5, "attitude": 1e-4, "encoder": 3e-6}
    assert set(sensors) == set(truth)
    for name, sigma in truth.items():
        np.testing.assert_allclose(sensors[name]["sigma"], sigma, rtol=0.25, err_msg=name)


def test_the_noise_of_unevenly_stamped_samples_is_found_too():
    rng = np.random.default_rng(0)
    time = np.arange(400) * 0.05 + rng.uniform(0.0, 0.02, 400)
    values = 0.5 * np.sin(0.6 * time) + 1e-3 * rng.normal(size=400)
    recording = Recording("uneven", None, time - time[0], {"position.joint1": values})
    assert channel_noise([recording], "position.joint1") == pytest.approx(1e-3, rel=0.15)


def test_axes_and_joints_of_different_noise_have_numbers_of_their_own(flown, tmp_path):
    files = copied(flown, tmp_path)
    rng = np.random.default_rng(1)
    for file in files[1:]:
        read = Recording.read(file)
        channels = dict(read.channels)
        for column in ("rate.y", "position.joint2"):
            channels[column] = channels[column] + 1e-4 * rng.normal(size=len(read.time))
        Recording(read.name, None, read.time, channels).write(file)
    sensors = drafted(files, tmp_path / "study.toml")["sensors"]
    np.testing.assert_allclose(sensors["rate"]["sigma"], [2e-5, 1e-4, 2e-5], rtol=0.3)
    encoder = sensors["encoder"]["sigma"]
    assert set(encoder) == {"joint1", "joint2", "joint3"}
    assert encoder["joint2"] == pytest.approx(1e-4, rel=0.3)


def test_what_could_not_be_known_is_marked(flown, tmp_path):
    drafted(copied(flown, tmp_path), tmp_path / "study.toml")
    text = (tmp_path / "study.toml").read_text(encoding="utf-8")
    for key in ("sigma", "position", "mounting", "attitude_sigma", "bodies", "spread", "effects", "initial_rate"):
        lines = [line for line in text.splitlines() if line.startswith(f"{key} =")]
        assert lines, key
        assert all("# please check: " in line for line in lines), lines
    assert "# [orbit]" in text
    assert "#   joint3: revolute" in text


def test_the_attitude_at_the_start_is_the_first_that_was_measured(flown, tmp_path):
    files = copied(flown, tmp_path)
    content = drafted(files, tmp_path / "study.toml")
    for item, file in zip(content["recordings"], files[1:], strict=True):
        _, quaternion = Recording.read(file).vector("attitude", ("x", "y", "z", "w"))
        np.testing.assert_allclose(item["attitude"], quaternion[0], atol=1e-8)
        assert item["attitude_sigma"] == pytest.approx(1e-4, rel=0.4)


def test_a_sensor_that_only_some_recordings_have_is_left_out(flown, tmp_path):
    files = copied(flown, tmp_path)
    read = Recording.read(files[2])
    rest = {column: values for column, values in read.channels.items() if not column.startswith("attitude")}
    Recording(read.name, None, read.time, rest).write(files[2])
    assert set(drafted(files, tmp_path / "study.toml")["sensors"]) == {"rate", "accel", "encoder"}
    assert "because manoeuvre-2 lacks it" in (tmp_path / "study.toml").read_text(encoding="utf-8")


def test_joints_recorded_by_speed_alone_get_a_start(flown, tmp_path):
    files = copied(flown, tmp_path)
    read = Recording.read(files[1])
    channels = dict(read.channels)
    channels["velocity.joint2"] = np.gradient(channels.pop("position.joint2"), read.time)
    Recording(read.name, None, read.time, channels).write(files[1])
    content = drafted(files, tmp_path / "study.toml")
    assert content["recordings"][0]["start"] == {"joint2": 0.0}
    assert "start" not in content["recordings"][1]


def test_nothing_is_overwritten(flown, tmp_path):
    files = copied(flown, tmp_path)
    study = tmp_path / "study.toml"
    study.write_text("mine")
    status, output = run("init", *files, "--output", study)
    assert status == 2
    assert "exists" in output
    assert study.read_text() == "mine"


def renamed(old: str, new: str):
    def change(files: list[Path]) -> None:
        files[1].write_text(files[1].read_text().replace(old, new))

    return change


def without_base_sensors(files: list[Path]) -> None:
    read = Recording.read(files[1])
    joints = {column: values for column, values in read.channels.items() if column.startswith("position")}
    Recording(read.name, None, read.time, joints).write(files[1])


def in_degrees(files: list[Path]) -> None:
    read = Recording.read(files[1])
    channels = {c: np.degrees(v) if c.startswith("position") else v for c, v in read.channels.items()}
    Recording(read.name, None, read.time, channels).write(files[1])


def noisy_rate(files: list[Path]) -> None:
    rng = np.random.default_rng(0)
    for file in files[1:]:
        read = Recording.read(file)
        channels = {
            c: v + 3.0 * rng.normal(size=len(v)) if c.startswith("rate") else v for c, v in read.channels.items()
        }
        Recording(read.name, None, read.time, channels).write(file)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            renamed("position.joint2", "position.wrist"),
            ("no position or velocity for joint joint2", "joint wrist is not"),
        ),
        (without_base_sensors, ("no sensor of the base is in all recordings", "manoeuvre-1")),
        (in_degrees, ("outside the joint's limits", "in degrees, give them in radians")),
        (noisy_rate, ("sensors.rate.sigma", "implausibly large", "rad/s")),
        (lambda files: files[0].unlink(), ("no such file", "robot.urdf")),
        (lambda files: files[1].unlink(), ("no such file", "manoeuvre-1.csv")),
    ],
    ids=["unknown joint", "no base sensor", "degrees", "wrong unit", "no robot", "no recording"],
)
def test_input_that_fits_no_study_is_refused_and_nothing_written(flown, tmp_path, change, words):
    files = copied(flown, tmp_path)
    change(files)
    status, output = run("init", *files, "--output", tmp_path / "new" / "study.toml")
    assert status == 2, output
    assert all(word in output for word in words), output
    assert not (tmp_path / "new").exists()


def test_the_draft_is_a_toml_file(flown, tmp_path):
    status, output = run("init", *copied(flown, tmp_path), "--output", tmp_path / "study")
    assert status == 2
    assert "study.toml" in output


def test_an_impossible_inertia_is_refused_or_replaced_on_request_and_the_study_says_so(flown, tmp_path):
    urdf, *recordings = copied(flown, tmp_path)
    text = urdf.read_text(encoding="utf-8")
    urdf.write_text(text.replace('izz="0.74"', 'izz="0.94"'), encoding="utf-8")
    study = tmp_path / "study.toml"
    status, output = run("init", urdf, *recordings, "--output", study)
    assert (status, study.exists()) == (2, False)
    assert "link link3" in output
    assert "--nearest-physical" in output
    status, output = run("init", urdf, *recordings, "--output", study, "--nearest-physical")
    assert status == 0, output
    assert "Link link3" in output
    model = load_model(Study.load(study))
    assert model.robot.link("link3").inertial.is_extended
    assert "Link link3" in model.robot.remarks[0]


def test_a_wheel_whose_speed_is_recorded_gets_a_section(flown, tmp_path):
    files = copied(flown, tmp_path)
    for file in files[1:]:
        read = Recording.read(file)
        channels = {**read.channels, "wheel_speed.wheel1": 10.0 + 0.0 * read.time}
        Recording(read.name, None, read.time, channels).write(file)
    study = drafted(files, tmp_path / "study.toml")
    (wheel,) = study["robot"]["wheels"]
    assert (wheel["name"], wheel["axis"]) == ("wheel1", [0.0, 0.0, 1.0])
    assert 1e-6 < wheel["inertia"] < 1.0
    assert load_model(Study.load(tmp_path / "study.toml")).robot.wheels[0].name == "wheel1"
