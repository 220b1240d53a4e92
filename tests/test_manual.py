"""The manual names every command, option, key, effect and criterion that the code has."""

import ast
import dataclasses
import importlib
import inspect
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer
from scipy.spatial.transform import Rotation

import bayesid
from bayesid.app.command_line import app
from bayesid.app.schema.editor_schema import editor_schema
from bayesid.design import known_criteria
from bayesid.diagnosis.evidence.verdict import Status
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.inference.recording_check import ChannelSampling, JointCheck, RecordingCheck, SensorCheck
from bayesid.report.effect_catalogue import catalogue
from bayesid.simulation.effects.register import known_effects
from bayesid.simulation.orbit import Orbit
from studies import manual
from studies.manual.sources import PROSE
from tests.pdf_text import PdfText
from tests.report_rules import badly_written

ROOT = Path(__file__).resolve().parents[1]
CONTRACT = ROOT.parent / "shared" / "CONTRACT.md"

WRITERS = (
    "app.functions.check_study",
    "app.functions.design_study",
    "app.functions.identifiability_of_study",
    "app.functions.predict_study",
    "app.functions.simulate_study",
    "app.import_command",
    "design.base_prediction",
    "design.design_result",
    "design.go_no_go",
    "design.loop_goals",
    "design.pose_trajectory",
    "diagnosis.outcome.cause_sizes",
    "diagnosis.outcome.gain",
    "diagnosis.outcome.inseparable_causes",
    "diagnosis.result",
    "identifiability.advice",
    "identifiability.directions",
    "identifiability.parameter_table",
    "identifiability.practical_identifiability",
    "inference.body_quantities",
    "inference.identification",
    "inference.predicted_readings",
)
"""Modules whose dictionaries become JSON files."""


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> PdfText:
    file = tmp_path_factory.mktemp("manual") / "manual.pdf"
    manual.run(file)
    return PdfText.read(file)


def test_names_can_be_copied_out_of_the_manual(text):
    assert not any("invisible" in found for page in text.pages for found in badly_written(page))


def results() -> set[str]:
    """Words set as code in the chapter on results, and the keys in the first column of its tables."""
    chapter = PROSE.read_text(encoding="utf-8").partition("\n= Results\n")[2].partition("\n= ")[0]
    code = re.findall(r"`([^`]+)`", chapter)
    columns = [word for cell in re.findall(r'^  "([\w ]+)", \[', chapter, flags=re.MULTILINE) for word in cell.split()]
    return {*code, *columns, "mean", "sd", "unit"}


def keys_of(module: str) -> set[str]:
    """Texts that are keys of the dictionaries in a module."""
    tree = ast.parse(inspect.getsource(importlib.import_module(f"bayesid.{module}")))
    keys = [key for item in ast.walk(tree) if isinstance(item, ast.Dict) for key in item.keys]
    return {key.value for key in keys if isinstance(key, ast.Constant) and isinstance(key.value, str)}


def test_every_command_and_option_is_in_the_manual(text):
    for name, command in typer.main.get_command(app).commands.items():
        assert f"bayesid {name}" in text
        for option in (word for item in command.params for word in (*item.opts, *item.secondary_opts)):
            assert not option.startswith("-") or option in text, f"{name} {option}"


def test_every_key_of_the_study_file_is_in_the_manual(text):
    schema = editor_schema()
    keys = {key for section in (schema, *schema["$defs"].values()) for key in section["properties"]}
    assert len(keys) > 60
    assert [key for key in keys if key not in text] == []


def test_every_effect_criterion_verdict_and_public_name_is_in_the_manual(text):
    effects = {entry.name for entry in catalogue()} | set(known_effects())
    names = [*effects, *known_criteria(), *(status.value for status in Status), *bayesid.__all__]
    assert [name for name in names if name not in text] == []


@pytest.mark.parametrize("module", WRITERS)
def test_every_key_of_the_results_is_explained(module):
    # words of sentences, units and channels, which are no keys
    others = {"position", "velocity", "torque", "rate", "accel", "rad", "m"}
    others |= {"base_force", "base_torque", "wheel_momentum", *BODY_QUANTITIES}
    assert keys_of(module) - results() - others == set()


@pytest.mark.parametrize("kind", [RecordingCheck, JointCheck, SensorCheck, ChannelSampling])
def test_every_key_of_a_check_is_explained(kind):
    assert {field.name for field in dataclasses.fields(kind)} <= results()


def test_the_manual_explains_messages_that_the_program_has():
    chapter = (ROOT / "studies" / "manual" / "help.typ").read_text(encoding="utf-8")
    tables = chapter[chapter.index("== Warnings") : chapter.index("== Questions")]
    messages = re.findall(r"^  \[`([^`]*)`\],", tables, flags=re.MULTILINE)
    code = "\n".join(file.read_text(encoding="utf-8") for file in sorted((ROOT / "bayesid").rglob("*.py")))
    code = re.sub(r'"\s*\n\s*f?"', "", code)  # literals over several lines
    assert len(messages) >= 12
    assert [part for message in messages for part in message.split(" … ") if part not in code] == []


@pytest.mark.parametrize("chapter", ["start", "tasks"])
def test_every_key_of_an_example_exists(chapter):
    prose = PROSE.with_name(f"{chapter}.typ").read_text(encoding="utf-8")
    known = json.dumps(editor_schema())
    for block in re.findall(r"```toml\n(.*?)```", prose, flags=re.DOTALL):
        assert [key for key in keys_of_table(tomllib.loads(block)) if f'"{key}"' not in known] == []


def keys_of_table(table):
    """Yield the keys of a table of TOML and of those in it, but for names of bodies."""
    for key, value in table.items():
        yield key
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, dict) and key != "spread":
                yield from keys_of_table(one)


@pytest.mark.parametrize("argument_of_latitude", [-2.8, 0.0, 0.7, 3.0])
def test_an_ephemeris_is_converted_as_the_orbit_has_it(argument_of_latitude):
    chapter = (ROOT / "studies" / "manual" / "tasks.typ").read_text(encoding="utf-8")
    names = {}
    exec(chapter.partition("```python\n")[2].partition("```")[0], names)
    draw = np.random.default_rng(3)
    inertial_of_node = Rotation.from_euler("ZX", [1.1, 0.9])  # right ascension of the node, then inclination
    cos, sin = np.cos(argument_of_latitude), np.sin(argument_of_latitude)
    position = 7e6 * inertial_of_node.apply([cos, sin, 0.0])
    velocity = 7.5e3 * inertial_of_node.apply([-sin, cos, 0.0])
    base, sun = Rotation.random(rng=draw), draw.standard_normal(3)
    sun /= np.linalg.norm(sun)
    values = names["study_values"](position, velocity, base.as_quat(), sun)
    orbit = Orbit(radius=7e6, inclination=float(values["inclination"]), sun=tuple(values["sun"].tolist()))
    state = orbit.state([0.0], float(values["argument_of_latitude"]))
    assert values["argument_of_latitude"] == pytest.approx(argument_of_latitude)
    assert values["inclination"] == pytest.approx(0.9)
    # what is fixed in space is seen from the base in the same direction, by the study and by the inertial attitude
    to_base = Rotation.from_quat(values["attitude"]).inv()
    for orbit_axes, inertial in [
        (state.sun[0], sun),
        (state.north[0], [0.0, 0.0, 1.0]),
        (state.zenith[0], position / 7e6),
        (state.velocity[0], velocity / 7.5e3),
    ]:
        np.testing.assert_allclose(to_base.apply(np.array(orbit_axes)), base.inv().apply(inertial), atol=1e-12)


def test_the_release_notes_have_the_version(text):
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert f"Manual of bayesid {version}" in text
    assert f"\n== {version}\n" in PROSE.read_text(encoding="utf-8").partition("= Release notes")[2]


PLANNED: set[str] = set()
"""Causes that the contract names and the catalogue does not have yet."""


@pytest.mark.skipif(not CONTRACT.is_file(), reason="the contract lies beside the repository")
def test_every_name_of_the_contract_is_in_the_manual(text):
    catalogue_of_names = (
        CONTRACT.read_text(encoding="utf-8").partition("## The catalogue's names")[2].partition("\n## ")[0]
    )
    cells = re.findall(r"^\| ([^|]+) \|", catalogue_of_names, flags=re.MULTILINE)[1:]
    names = [name for cell in cells for name in cell.split(", ")]
    assert len(names) > 30
    assert {name for name in names if name not in text} == PLANNED
