"""The JSON Schema of the study file: editors accept what the package accepts, and describe every key."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from bayesid.app.command_line import app
from bayesid.app.schema.editor_schema import editor_schema

ROOT = Path(__file__).resolve().parents[1]
DEMONSTRATION = ROOT / "bayesid" / "app" / "demonstration_data" / "study.toml"


def errors(study: dict[str, Any]) -> list[str]:
    validator = pytest.importorskip("jsonschema").Draft202012Validator
    validator.check_schema(editor_schema())
    return [error.message for error in validator(editor_schema()).iter_errors(study)]


def shipped() -> dict[str, Any]:
    return tomllib.loads(DEMONSTRATION.read_text(encoding="utf-8"))


def printed(place: str) -> dict[str, Any]:
    blocks = (ROOT / place).read_text(encoding="utf-8").split("```toml\n")[1:]
    text = next(block.partition("```")[0] for block in blocks if block.startswith("title"))
    return tomllib.loads(text)


@pytest.mark.parametrize(
    "study",
    [shipped(), printed("README.md"), printed("studies/manual/manual.typ")],
    ids=["demonstration", "README", "manual"],
)
def test_studies_that_the_package_accepts_are_valid(study):
    assert errors(study) == []


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("robot", "mesh", "robot.stl"),
        ("robot", "urdf", 1),
        ("orbit", "eccentricity", 1.5),
        ("sensors", "gyro", {"sigma": 1.0}),
        ("unknowns", "bodies", "base_link"),
        ("model", "initial_rate", "none"),
    ],
)
def test_wrong_keys_and_values_are_refused(section, key, value):
    study = shipped()
    study[section][key] = value
    assert len(errors(study)) == 1


def test_a_noise_is_one_number_or_one_per_axis():
    for sigma, faults in ((1e-5, 0), ([1e-5, 2e-5, 1e-5], 0), ([1e-5, 2e-5], 1), (-1.0, 1), ("small", 1)):
        study = shipped()
        study["sensors"]["rate"]["sigma"] = sigma
        assert len(errors(study)) == faults, sigma


def test_every_key_has_a_description():
    schema = editor_schema()
    sections = {"Study": schema, **schema["$defs"]}
    assert len(sections) > 15
    bare = [
        f"{name}.{key}"
        for name, section in sections.items()
        for key, value in section.get("properties", {}).items()
        if not value.get("description")
    ]
    assert bare == []
    assert "[rad/s]" in sections["RateSensor"]["properties"]["sigma"]["description"]
    assert sections["LoadSection"]["properties"]["mass"]["description"] == "Mass [kg]."


def test_the_schema_is_printed_or_written_to_a_file(tmp_path):
    printed = subprocess.run(
        [sys.executable, "-m", "bayesid.app.command_line", "schema"], capture_output=True, text=True, check=True
    )
    result = CliRunner().invoke(app, ["schema", "--output", str(tmp_path / "new" / "study.schema.json")])
    assert result.exit_code == 0, result.output
    written = json.loads((tmp_path / "new" / "study.schema.json").read_text(encoding="utf-8"))
    assert json.loads(printed.stdout) == written == json.loads(json.dumps(editor_schema()))
    for folder in (tmp_path / "new", "."):
        result = CliRunner().invoke(app, ["schema", "--output", str(folder)])
        assert (result.exit_code, result.output.count("Error: ")) == (2, 1), result.output
        assert "Give the name of the file to write" in result.output
