"""The functions of the package's top level: complete, lazy, and those of the command line."""

import ast
import importlib
import inspect
import json
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import PLANAR
from test_cli import as_json, run
from test_identifiability_command import study

import bayesid
from bayesid.robot.robot import Robot

assert study  # the fixture of a small study

COMMANDS = ("check", "identify", "diagnose", "identifiability", "design", "predict", "simulate", "loop")

OF_THE_COMMAND = {"file", "output", "progress", "scheduler"}
"""Parameters of the commands alone, or that have another form in Python."""


def test_every_name_is_loaded_and_known_to_type_checkers():
    tree = ast.parse(Path(bayesid.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    stated = {alias.name: line.module for line in tree.body if isinstance(line, ast.ImportFrom) for alias in line.names}
    assert sorted(stated) == bayesid.__all__ == dir(bayesid)
    assert {*COMMANDS, "TorqueSensor", "Filter", "Coloured", "Diagnosis", "plot_verdict"} <= set(stated)
    for name, module in stated.items():
        assert getattr(bayesid, name) is getattr(importlib.import_module(module), name)
    with pytest.raises(AttributeError, match="no attribute 'banana'"):
        _ = bayesid.banana


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_has_the_defaults_of_its_function(name):
    command = inspect.signature(importlib.import_module(f"bayesid.app.{name}_command").run).parameters
    function = inspect.signature(getattr(bayesid, name)).parameters
    shared = set(command) - OF_THE_COMMAND
    assert shared <= set(function)
    assert {key: command[key].default for key in shared} == {key: function[key].default for key in shared}


@pytest.mark.parametrize("name", COMMANDS)
def test_what_is_no_study_is_an_error_that_says_so(name, tmp_path):
    more = (tmp_path / "loop",) if name == "loop" else ()
    with pytest.raises(bayesid.InputError, match="a dict is not a study"):
        getattr(bayesid, name)({"robot": "robot.urdf"}, *more)


def test_what_reads_a_study_takes_its_path(study):
    model = bayesid.load_model(study)
    assert repr(model) == repr(bayesid.load_model(bayesid.Study.load(study)))
    (manoeuvre,) = bayesid.load_manoeuvres(str(study), model.robot)
    assert repr(manoeuvre.recording) in repr(bayesid.load_posterior(str(study)).manoeuvres)
    assert bayesid.load_problem(study).plan.model.robot.name == model.robot.name


@pytest.mark.parametrize("name", ["design", "identifiability"])
def test_a_function_with_the_name_of_a_room_stays_one(name):
    function, room = getattr(bayesid, name), importlib.import_module(f"bayesid.{name}")
    assert inspect.isfunction(function)
    assert function is getattr(bayesid, name)
    assert inspect.ismodule(room)


@pytest.mark.slow
def test_the_order_of_imports_does_not_matter():
    code = "import bayesid.design.criteria, bayesid.identifiability; from bayesid import design, identifiability; "
    code += "import bayesid; assert bayesid.design is design and callable(design) and callable(identifiability); "
    code += (
        "from bayesid.design import Problem; from bayesid.design.criteria import DOptimal; import bayesid.design.plan; "
    )
    code += "assert bayesid.design is design and bayesid.Problem is Problem"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def written(file: Path) -> dict:
    return json.loads(file.read_text(encoding="utf-8"))


@pytest.mark.slow  # of check and simulate, tests of the command line show the same
@pytest.mark.parametrize(
    ("name", "file", "options"),
    [
        ("predict", "prediction.json", {"seed": 4, "draws": 20}),
        ("identify", "identification.json", {"seed": 4, "effective_samples": 100.0}),
    ],
)
def test_a_command_writes_what_its_function_returns(name, file, options, study, tmp_path):
    words = {"effective_samples": "samples"}
    given = [word for key, value in options.items() for word in (f"--{words.get(key, key)}", value)]
    status, output = run(name, study, "--output", tmp_path, *given)
    assert status == 0, output
    content, result = written(tmp_path / file), as_json(getattr(bayesid, name)(study, **options))
    if name == "identify":  # the command adds what the study states of the noise, and measures times
        assert content.pop("noise") == {}
        assert content.pop("seconds").keys() >= {"fit", "sample"}
        assert content["sampler"].pop("seconds") > 0.0
        assert result["sampler"].pop("seconds") > 0.0
    assert content == result


def test_a_robot_alone_has_a_structure(tmp_path):
    robot = Robot.from_urdf(PLANAR)
    result = bayesid.identifiability(robot)
    assert (len(result.structure.standard), len(result.structure.independent)) == (30, 24)
    assert result.practical is None
    assert "Practical identifiability is not evaluated: no recordings are given." in str(result)


@pytest.mark.slow
def test_objects_do_as_well_as_a_study(study):
    posterior = bayesid.load_posterior(bayesid.Study.load(study))
    assert as_json(bayesid.simulate(posterior, seed=4)) == as_json(bayesid.simulate(study, seed=4))
    (recording,) = bayesid.predict(posterior.model, posterior.manoeuvres, 4, draws=20).recordings
    assert recording.to_dict() == bayesid.predict(study, seed=4, draws=20).recordings[0].to_dict()


@pytest.mark.slow
def test_the_session_of_the_readme_runs(study, tmp_path, monkeypatch, capsys):
    text = Path(__file__).parents[1].joinpath("README.md").read_text(encoding="utf-8")
    code = text.partition("## In Python")[2].partition("```python\n")[2].partition("```")[0]
    for file in study.parent.glob("*.*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    monkeypatch.chdir(tmp_path)
    session: dict[str, object] = {}
    exec(code, session)
    assert capsys.readouterr().out.startswith("Verdict: ")
    assert session["base"] is session["diagnosis"].identification.bodies["base_link"]
    assert "sample_stats" in session["tree"].children
    assert Robot.from_urdf("identified.urdf").base == "base_link"
    assert Path("verdict.png").stat().st_size > 10_000
