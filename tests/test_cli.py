"""The command line as a user meets it: files written, exit status, one clear error for each kind of bad input."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner
from xarray import open_datatree

import bayesid
from bayesid import app as app_room
from bayesid._io.files import write_json
from bayesid.app.command_line import app
from bayesid.report.numbers import format_fixed, format_number, format_quantity
from studies.truth.bodies import SERVICER4
from studies.truth.mujoco import Manoeuvres, TruthModel, write_study
from tests.pdf_text import PdfText


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of the four-joint servicer, made by MuJoCo."""
    folder = tmp_path_factory.mktemp("study")
    made = write_study(
        folder,
        SERVICER4,
        np.random.default_rng(3),
        manoeuvres=Manoeuvres(count=1, duration=60.0),
        title="Servicer",
    )
    return made.file


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    return result.exit_code, re.sub(r"\s+", " ", result.output)


def as_json(result: Any) -> dict:
    """Content of a result's JSON file."""
    with tempfile.TemporaryDirectory() as folder:
        write_json(Path(folder) / "result.json", result.to_dict())
        return json.loads((Path(folder) / "result.json").read_text(encoding="utf-8"))


def copy(study: Path, folder: Path) -> Path:
    for item in study.parent.iterdir():
        (folder / item.name).write_bytes(item.read_bytes())
    return folder / study.name


def test_identify_writes_what_the_contract_names(study: Path, tmp_path: Path) -> None:
    status, output = run("identify", study, "--output", tmp_path, "--samples", 300)
    assert status == 0, output
    names = ["identification.json", "identified-uncertainty.json", "identified.urdf", "posterior.nc", "report.pdf"]
    assert sorted(item.name for item in tmp_path.iterdir()) == names
    content = json.loads((tmp_path / "identification.json").read_text())
    assert set(content) >= {"bodies", "effects", "covariance", "fit", "sampler", "log_evidence"}
    assert set(content["seconds"]) == {"load", "fit", "sample", "report"}
    assert all(value > 0.0 for value in content["seconds"].values())
    body = content["bodies"]["base_link"]
    assert set(body["inertia"]) == {"xx", "yy", "zz", "xy", "xz", "yz"}
    assert set(body["mass"]) == {"mean", "sd", "unit"}
    assert len(content["covariance"]["names"]) == len(content["covariance"]["matrix"]) == 10
    assert content["covariance"]["names"][:3] == ["base_link.mass", "base_link.com.x", "base_link.com.y"]
    variance = content["covariance"]["matrix"][0][0]
    assert body["mass"]["sd"] == pytest.approx(np.sqrt(variance), rel=1e-6)
    identified = TruthModel(tmp_path / "identified.urdf").base  # MuJoCo takes the URDF
    assert identified.mass == pytest.approx(body["mass"]["mean"], rel=1e-9)
    np.testing.assert_allclose(identified.com, [q["mean"] for q in body["com"]], atol=0.1 * body["com"][0]["sd"])
    beside = json.loads((tmp_path / "identified-uncertainty.json").read_text())
    assert beside["bodies"]["base_link"] == body
    assert beside["covariance"] == content["covariance"]
    data = open_datatree(tmp_path / "posterior.nc")
    assert {"posterior", "log_likelihood", "posterior_predictive", "observed_data"} <= set(data.children)
    assert data["posterior"]["base_link.mass"].attrs["unit"] == "kg"
    assert data["posterior"]["inertial"].attrs["frame"] == "link axes, about the origin of the link"
    assert data["posterior"]["initial-rate"].attrs["frame"] == "base axes"
    assert "frame" not in data["posterior"]["z"].attrs
    report = PdfText.read(tmp_path / "report.pdf")
    assert "Servicer" in report
    assert "command: bayesid identify study.toml --seed 0" in report
    for key, unit in (("mass", "kg"), ("com", "m"), ("inertia", "kg m²")):
        items = {f"{key}.xx": body[key]["xx"]} if key == "inertia" else {key: body[key]}
        items = {f"com.{axis}": item for axis, item in zip("xyz", body[key], strict=True)} if key == "com" else items
        for name, item in items.items():
            assert f"base_link.{name}{unit}" in report
            assert format_quantity(item["mean"], item["sd"]) in report


@pytest.mark.slow
def test_what_is_not_a_body_is_identified_where_no_body_is_unknown(study: Path, tmp_path: Path) -> None:
    file = copy(study, tmp_path)
    edit(file, lambda text: text.replace('bodies = ["base_link"]', "bodies = []"))
    status, output = run("identify", file, "--output", tmp_path / "out", "--samples", 100)
    assert status == 0, output
    content = json.loads((tmp_path / "out" / "identification.json").read_text())
    assert content["covariance"] == {"names": [], "matrix": []}
    assert content["bodies"] == {}
    report = PdfText.read(tmp_path / "out" / "report.pdf")
    assert "initial rate" in report
    assert "Posterior correlations" not in report


def test_simulated_recordings_do_not_replace_those_of_the_study(study: Path, tmp_path: Path) -> None:
    file = copy(study, tmp_path)
    before = {item.name: item.read_bytes() for item in tmp_path.iterdir()}
    status, output = run("simulate", file, "--output", tmp_path)
    assert status == 2
    assert "Choose another output folder" in output
    assert {item.name: item.read_bytes() for item in tmp_path.iterdir()} == before


def test_an_interruption_waits_for_the_end_of_an_evaluation_of_emcee() -> None:
    code = """
import os, signal, sys, typer, emcee, numpy as np
from bayesid.app.command_line import _command

def density(x):
    if not calls:
        os.kill(os.getpid(), signal.SIGINT)
    calls.append(1)
    return -0.5 * np.sum(np.asarray(x) ** 2)

calls = []
def run():
    sampler = emcee.EnsembleSampler(8, 2, density)
    sampler.run_mcmc(np.random.default_rng(0).normal(size=(8, 2)), 100_000)
    yield "not interrupted"

typer.run(_command(run))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 130, done.stderr
    assert done.stderr.startswith("Interrupted.")
    assert "emcee" not in done.stdout + done.stderr


@pytest.mark.slow
def test_check_and_simulate(study: Path, tmp_path: Path) -> None:
    status, output = run("check", study, "--output", tmp_path / "check")
    assert status == 0, output
    assert sorted(item.name for item in (tmp_path / "check").iterdir()) == ["check.json", "report.pdf"]
    checked = json.loads((tmp_path / "check" / "check.json").read_text())["recordings"][0]
    assert {"rate", "accel", "position.joint1"} <= {channel["name"] for channel in checked["channels"]}
    status, output = run("simulate", study, "--output", tmp_path / "simulate", "--seed", 5)
    assert status == 0, output
    for name, result in (("check", bayesid.check(study)), ("simulate", bayesid.simulate(study, seed=5))):
        file = "simulation" if name == "simulate" else name
        assert json.loads((tmp_path / name / f"{file}.json").read_text()) == as_json(result)
    report = PdfText.read(tmp_path / "check" / "report.pdf")
    assert "command: bayesid check study.toml" in report
    assert "Check of the study and its recordings" in report
    for channel in checked["channels"]:
        assert report.row(
            channel["name"],
            str(channel["samples"]),
            format_number(channel["interval"], 4),
            format_number(channel["longest_gap"], 4),
        )
    assert {joint["name"] for joint in checked["joints"]} == {f"joint{k}" for k in (1, 2, 3, 4)}
    for joint in checked["joints"]:
        span = f"{format_fixed(joint['lowest'], 3)} to {format_fixed(joint['highest'], 3)} {joint['unit']}"
        assert report.row(joint["name"], span, f"{format_number(joint['speed'])} {joint['unit']}/s")
    names = sorted(item.name for item in (tmp_path / "simulate").iterdir())
    assert "simulation.json" in names
    largest = json.loads((tmp_path / "simulate" / "simulation.json").read_text())["recordings"][0]["largest"]
    report = PdfText.read(tmp_path / "simulate" / "report.pdf")
    assert "command: bayesid simulate study.toml --seed" in report
    for kind, unit in (("rate", "rad/s"), ("accel", "m/s²")):
        assert report.row(kind, unit, *(format_number(value, 4) for value in largest[kind]))
    assert sum(name.endswith(".csv") for name in names) == 1
    again = tmp_path / "again"
    run("simulate", study, "--output", again, "--seed", 5)
    csv = next(name for name in names if name.endswith(".csv"))
    assert (again / csv).read_bytes() == (tmp_path / "simulate" / csv).read_bytes()


def edit(file: Path, change) -> None:
    file.write_text(change(file.read_text()))


def recording_of(folder: Path) -> Path:
    return next(iter(sorted(folder.glob("*.csv"))))


def cell(row: int, column: str, value: str):
    """Change one cell of a CSV file; rows count from the first data line."""

    def change(text: str) -> str:
        lines = text.splitlines()
        at = lines[0].split(",").index(column)
        cells = lines[1 + row].split(",")
        cells[at] = value
        lines[1 + row] = ",".join(cells)
        return "\n".join(lines) + "\n"

    return change


def drop(column: str):
    def change(text: str) -> str:
        rows = [line.split(",") for line in text.splitlines()]
        at = rows[0].index(column)
        return "\n".join(",".join(cells[:at] + cells[at + 1 :]) for cells in rows) + "\n"

    return change


def scale(prefix: str, factor: float):
    def change(text: str) -> str:
        rows = [line.split(",") for line in text.splitlines()]
        for at, name in enumerate(rows[0]):
            if name.startswith(prefix):
                for cells in rows[1:]:
                    if cells[at]:
                        cells[at] = repr(float(cells[at]) * factor)
        return "\n".join(",".join(cells) for cells in rows) + "\n"

    return change


BAD = {
    "NaN": ("recording", cell(4, "rate.x", "nan"), ["rate.x", "nan", "line 6"]),
    "not monotonic": ("recording", cell(5, "time", "0.0"), ["time", "line 7"]),
    "missing column": ("recording", drop("rate.y"), ["rate.y"]),
    "missing joint": ("recording", drop("position.joint3"), ["joint3", "Record exactly the robot's moving joints"]),
    "empty file": ("recording", lambda text: "", ["empty"]),
    "joints in degrees": ("recording", scale("position.", 57.29577951308232), ["position.joint", "radians"]),
    "rate in degrees": ("recording", scale("rate.", 57.29577951308232), ["rate", "degrees per second"]),
    "acceleration in mm/s2": ("recording", scale("accel.", 1000.0), ["accel", "m/s2"]),
    "unknown key": (
        "study",
        lambda text: text.replace("[orbit]", "[orbit]\nradios = 1.0"),
        ["orbit", "radios", "radius"],
    ),
    "orbit in km": ("study", lambda text: re.sub(r"radius = .*", "radius = 6916.0", text), ["radius", "metres"]),
    "unknown effect": (
        "study",
        lambda text: text.replace("gravity-gradient", "gravity-gradiant"),
        ["model.effects #", "gravity-gradiant", "Did you mean 'gravity-gradient'?"],
    ),
    "a verdict that is no effect": (
        "study",
        lambda text: text.replace('"gravity-gradient"', '"gravity-gradient", "rate-noise"'),
        ["model.effects #2", "rate-noise", "State it under [model.noise]"],
    ),
    "effect without what it needs": (
        "study",
        lambda text: text.replace('"gravity-gradient"', '"gravity-gradient", "attitude-misalignment"'),
        ["attitude-misalignment", "requires [sensors.attitude]"],
    ),
    "position in millimetres": (
        "study",
        lambda text: re.sub(r"position = .*", "position = [72.0, -15.1, -37.2]", text),
        ["sensors.accel.position", "82.44 m", "Give it in metres"],
    ),
    "unknown body": (
        "study",
        lambda text: text.replace('bodies = ["base_link"]', 'bodies = ["base"]'),
        ["'base'", "base_link"],
    ),
    "wrong robot": ("robot", lambda text: text.replace('name="joint2"', 'name="elbow"'), ["elbow", "joint2"]),
    "negative mass": (
        "robot",
        lambda text: re.sub(r'mass value="[^"]*"', 'mass value="-3.0"', text, count=1),
        ["mass >= 0", "link"],
    ),
    "unphysical inertia": (
        "robot",
        lambda text: re.sub(r'izz="[^"]*"', 'izz="1e6"', text, count=1),
        ["triangle inequality", "link"],
    ),
    "not XML": ("robot", lambda text: text[:-20], ["XML"]),
}


@pytest.mark.parametrize("option", [("--seed", "-1"), ("--samples", "0")])
def test_options_out_of_range_are_refused_at_once(option: tuple[str, str], study: Path, tmp_path: Path) -> None:
    status, text = run("identify", study, "--output", tmp_path / "out", *option)
    assert status == 2, text
    assert option[0] in text
    assert not (tmp_path / "out").exists()


def test_one_recording_under_two_names_does_not_count_twice(study: Path, tmp_path: Path) -> None:
    file = copy(study, tmp_path)
    first = recording_of(tmp_path)
    first.with_name("again.csv").write_bytes(first.read_bytes())
    section = re.compile(r"\[\[recordings\]\].*?(?=\n\[)", re.DOTALL)
    edit(file, lambda text: section.sub(lambda own: f"{own[0]}\n{own[0].replace(first.name, 'again.csv')}", text))
    status, text = run("identify", file, "--output", tmp_path / "out")
    assert status == 2, text
    assert "recordings #2.file: 'again.csv' has the same content as" in text


@pytest.mark.parametrize("kind", BAD)
def test_bad_input_gives_one_clear_error_and_nothing_half_written(kind: str, study: Path, tmp_path: Path) -> None:
    where, change, words = BAD[kind]
    folder = tmp_path / "study"
    folder.mkdir()
    file = copy(study, folder)
    edit({"recording": recording_of(folder), "study": file, "robot": folder / "robot.urdf"}[where], change)
    output = tmp_path / "out"
    status, text = run("identify", file, "--output", output)
    assert status == 2, text
    assert text.count("Error:") == 1
    assert "Traceback" not in text
    for word in words:
        assert word in text, text
    assert not output.exists() or not list(output.iterdir())


HEAVY = (
    "jax",
    "pinocchio",
    "arviz_base",
    "arviz_stats",
    "scipy",
    "matplotlib",
    "emcee",
    "h5py",
    "pandas",
    "pyarrow",
    "typst",
)
"""Packages that take seconds to import; help and errors in a study file do without."""

WITH_STUDY = ("check", "design", "diagnose", "identifiability", "identify", "loop", "predict", "simulate")
WITHOUT_STUDY = ("catalogue", "demo", "import", "init", "schema")


def imported(code: str, packages: tuple[str, ...] = HEAVY) -> list[str]:
    """Return which of some packages a fresh interpreter holds after running code."""
    ending = f"\nimport sys\nprint('LOADED', *[name for name in {packages!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code + ending], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()[1:]


def test_the_heavy_packages_exist_and_are_seen():
    assert all(importlib.util.find_spec(name) for name in HEAVY)
    assert imported("import scipy") == ["scipy"]


@pytest.mark.parametrize(
    "code",
    [
        "import bayesid",
        "import bayesid; bayesid.Study, bayesid.InputError, bayesid.InertialParameters, bayesid.White",
        "import bayesid.app.command_line",
    ],
)
def test_importing_is_light(code: str):
    assert imported(code) == []


def test_help_version_and_errors_in_a_study_are_light(tmp_path: Path):
    bad = {"key.toml": "[robot]\nurdff = 'x'\n", "type.toml": SHORT.replace("1e-5", "'small'"), "syntax.toml": "[robot"}
    for name, text in bad.items():
        (tmp_path / name).write_text(text)
    calls = [[], ["--help"], ["--version"], *([name, "--help"] for name in (*WITH_STUDY, *WITHOUT_STUDY))]
    for name in (*bad, "absent.toml"):
        calls += [[command, str(tmp_path / name), "--output", str(tmp_path / "out")] for command in WITH_STUDY]
    code = f"""
from typer.testing import CliRunner
import bayesid
from bayesid import app as app_room
from bayesid.app.command_line import app
for call in {calls!r}:
    result = CliRunner().invoke(app, call)
    wrong = any(".toml" in word for word in call)
    assert result.exit_code == (2 if wrong or not call else 0), (call, result.output)
    assert ("Error: " in result.output) == wrong, (call, result.output)
"""
    assert imported(code) == []

    assert not (tmp_path / "out").exists()


SHORT = """
[robot]
urdf = "robot.urdf"
[sensors.rate]
sigma = 1e-5
[unknowns]
bodies = []
"""


def test_the_version_is_that_of_the_package():
    status, text = run("--version")
    assert status == 0
    assert text == f"bayesid {version('bayesid')} "
    assert bayesid.__version__ == version("bayesid")


def test_every_command_is_one_file_and_shows_its_first_sentence():
    files = sorted(
        file.name.removesuffix("_command.py") for file in Path(app_room.__file__).parent.glob("*_command.py")
    )
    assert files == sorted((*WITH_STUDY, *WITHOUT_STUDY))
    for name in files:
        status, text = run(name, "--help")
        assert status == 0
        sentence = importlib.import_module(f"bayesid.app.{name}_command").run.__doc__
        assert re.sub(r"\s+", " ", sentence)[:40] in text
        assert "progress" not in text


def test_an_output_that_is_a_file_is_an_error(study: Path, tmp_path: Path):
    (tmp_path / "out").write_text("")
    for command in ("check", "identify", "diagnose"):
        status, text = run(command, study, "--output", tmp_path / "out")
        assert status == 2, text
        assert "cannot create the folder" in text
        assert text.count("Error:") == 1


def test_a_missing_study_is_an_error(tmp_path: Path) -> None:
    status, text = run("check", tmp_path / "none.toml", "--output", tmp_path / "out")
    assert status == 2
    assert "none.toml" in text


@pytest.mark.slow
def test_a_users_effect_joins_a_study(study: Path, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    folder.mkdir()
    file = copy(study, folder)
    (folder / "mine.py").write_text(PLUGIN)
    edit(
        file,
        lambda text: (
            text.replace('["gravity-gradient"]', '["gravity-gradient", "test-steady-torque"]')
            + '\nplugins = ["mine.py"]\n'
        ),
    )
    status, text = run("check", study, "--output", tmp_path / "without")
    assert status == 0, text
    without = int(re.search(r"(\d+) unknowns", text)[1])
    status, text = run("check", file, "--output", tmp_path / "out")
    assert status == 0, text
    assert f"{without + 3} unknowns" in text
    assert f"and {without + 3} unknowns." in PdfText.read(tmp_path / "out" / "report.pdf")


PLUGIN = '''
import jax.numpy as jnp
from bayesid.simulation.effects import Effect, Parameter, Wrench, register


@register
class SteadyTorque(Effect):
    """A torque that never changes, in base axes."""

    name = "test-steady-torque"
    summary = "Something pushes steadily."
    parameters = tuple(Parameter(axis, "N m", 1e-3) for axis in "xyz")

    def wrench(self, values, instant, inner):
        """Return the torque."""
        return Wrench(jnp.zeros(3), values)
'''
