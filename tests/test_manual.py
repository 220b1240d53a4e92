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
import typst
from scipy.spatial.transform import Rotation

import bayesid
from bayesid import Sensor, SensorKind, White
from bayesid.app.command_line import app
from bayesid.app.schema.editor_schema import editor_schema
from bayesid.design import known_criteria
from bayesid.diagnosis.evidence.verdict import Status
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.inference.recording_check import ChannelSampling, JointCheck, RecordingCheck, SensorCheck
from bayesid.report.effect_catalogue import catalogue
from bayesid.robot.inertial_parameters import mass_com_inertia, parameters_from_pseudo_inertia
from bayesid.simulation.effects.register import known_effects
from bayesid.simulation.orbit import Orbit
from studies import manual
from studies.manual.sources import PROSE, sources
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
    assert [part for message in messages for part in re.split(" ?… ?", message) if part not in code] == []


REPORTS = ("check", "convention", "design", "identification", "loop")


def trees_of_reports() -> list[ast.AST]:
    """Syntax trees of the reports that the manual explains."""
    folder = ROOT / "bayesid" / "report"
    files = [*(folder / f"{name}_report.py" for name in REPORTS), folder / "model_assumptions.py"]
    files += sorted((folder / "diagnosis").glob("*.py"))
    return [ast.parse(file.read_text(encoding="utf-8")) for file in files]


def text_of(node: ast.AST) -> str:
    """Text of an expression, with three dots for what it computes."""
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=parts):
            return "".join(map(text_of, parts))
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return text_of(left) + text_of(right)
        case ast.IfExp(body=body, orelse=other):
            return f"{text_of(body)} … {text_of(other)}"
    return "…"


def titles_of_reports() -> tuple[set[str], set[str]]:
    """Titles of sections, and captions of figures and tables."""
    calls = [node for tree in trees_of_reports() for node in ast.walk(tree) if isinstance(node, ast.Call)]
    titles, captions = set(), set()
    for call in calls:
        match call.func:
            case ast.Attribute(attr="section"):
                titles |= set(text_of(call.args[0]).split(" … "))
            case ast.Attribute(attr="table") if len(call.args) > 2:
                captions.add(text_of(call.args[2]))
            case ast.Attribute(attr="figure") if len(call.args) > 1:
                captions.add(text_of(call.args[1]))
            case ast.Name(id="add_changes"):
                captions.add(text_of(call.args[3]))
    return titles, captions


def chapter_on_reports() -> tuple[list[str], list[str], list[str]]:
    """Sections, captions and rows of boxes that the chapter on reports names."""
    chapter = (ROOT / "studies" / "manual" / "reports.typ").read_text(encoding="utf-8")
    sections = [name for cell in re.findall(r'section\("([^"]+)"', chapter) for name in cell.split(" or ")]
    captions = re.findall(r'^  "([^"]+)", \[', chapter, flags=re.MULTILINE)
    boxes = re.findall(r"^  \[([^]]+)\], \[", chapter, flags=re.MULTILINE)
    return sections, captions, boxes


def test_every_title_that_the_chapter_on_reports_quotes_is_in_a_report():
    sections, captions, boxes = chapter_on_reports()
    assert len(sections) > 25
    assert len(captions) > 50
    assert len(boxes) == 15
    constants = [node.value for tree in trees_of_reports() for node in ast.walk(tree) if isinstance(node, ast.Constant)]
    code = "\n".join(text for text in constants if isinstance(text, str))
    quoted = [part for name in (*sections, *captions) for part in name.removesuffix(" NAME").split("…")]
    assert [part for part in quoted if part.strip() not in code] == []
    assert [name for name in boxes if name not in constants] == []


def test_every_section_and_caption_of_the_reports_is_in_the_chapter_on_reports():
    sections, captions, _ = chapter_on_reports()
    titles, written = titles_of_reports()
    named = {name.replace("NAME", "…") for name in sections}
    assert {title for title in titles if title != "…"} - named - {"Measured and simulated"} == set()
    quoted = [re.compile(".*?".join(map(re.escape, name.split("…"))), re.DOTALL) for name in captions]
    known = [text for text in written if text.strip("… ")]
    assert len(known) > 45
    assert [text for text in known if not any(words.search(text) for words in quoted)] == []


@pytest.fixture(scope="module")
def index(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[list[str], list[int]]]:
    """Kinds and pages of the names in the index."""
    folder = tmp_path_factory.mktemp("sources")
    found = typst.query(str(sources(folder)), "<index>", field="value", one=True, root=str(folder))
    return {name: (kinds, pages) for name, kinds, pages in json.loads(found)}


def test_the_index_has_every_command_effect_verdict_criterion_and_key(index):
    schema = editor_schema()
    names = [f"bayesid {name}" for name in typer.main.get_command(app).commands]
    names += [entry.name for entry in catalogue()] + [*known_criteria(), *bayesid.__all__]
    names += [status.value for status in Status]
    names += [key for section in (schema, *schema["$defs"].values()) for key in section["properties"]]
    names += [
        "quaternions",
        "products of inertia",
        "chi-square per sample",
        "position.<joint>",
        "convention:unit:CHANNEL",
    ]
    assert len(index) > 120
    assert [name for name in names if name not in index] == []


def test_what_the_index_names_is_on_its_page(index, text):
    wrong = []
    for name, (_, pages) in index.items():
        for page in pages:
            there = PdfText(text.pages[page - 1 : page + 1])
            if not all(part.strip() in there for part in name.split("…")):
                wrong.append((name, page))
    # names of frames, which stand in a table there
    assert [name for name, _ in wrong if not name.endswith(" axes") and name != "products of inertia"] == []


def test_the_index_is_at_the_end_of_the_pdf(index, text):
    first = next(number for number, page in enumerate(text.pages) if re.search(r"(?m)^\d+ Index$", page))
    assert len(text.pages) - 4 <= first
    last = PdfText(text.pages[first:])
    assert [name for name in index if name not in last] == []


def test_the_figure_of_the_files_has_every_command_and_only_files_that_are_written(text):
    drawn = (ROOT / "studies" / "manual" / "figures.typ").read_text(encoding="utf-8").partition("#let lanes")[2]
    code = "\n".join(file.read_text(encoding="utf-8") for file in sorted((ROOT / "bayesid").rglob("*.py")))
    files = re.findall(r"`([\w.-]+\.(?:json|csv|nc|urdf|pdf))`", drawn)
    assert len(files) > 15
    ends = [re.sub(r"^(?:NAME\.?|step-N-)", "", file) for file in files]
    assert [file for file in ends if file not in code] == []
    page = next(
        page for page in text.pages if "Which command reads and writes which file\n" in page and "ROS bag" in page
    )
    commands = set(typer.main.get_command(app).commands)
    assert [name for name in commands if name not in page] == []


def test_the_figure_of_the_frames_is_right():
    orbit, quarter = Orbit(radius=7e6), np.sqrt(0.5)
    start = orbit.state([0.0], 0.0)
    zenith, along, normal = start.zenith[0], start.velocity[0], [0.0, 0.0, 1.0]
    np.testing.assert_allclose([zenith, along], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-12)
    np.testing.assert_allclose(np.cross(zenith, along), normal, atol=1e-12)
    # an eighth of a turn later, the zenith has turned from x to y
    later = orbit.state([np.pi / 4.0 / orbit.mean_motion], 0.0).zenith[0]
    np.testing.assert_allclose(later, [quarter, quarter, 0.0], atol=1e-6)
    attitude = Rotation.from_quat([0.0, 0.0, quarter, quarter])
    np.testing.assert_allclose(attitude.apply([1.0, 0.0, 0.0]), along, atol=1e-12)
    mounted = Sensor(SensorKind.RATE, White(1.0), mounting=attitude.as_quat())
    np.testing.assert_allclose(mounted.rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-12)
    # two masses in the first and third quadrant
    second = np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) + 0.1 * np.eye(3)
    pseudo = np.block([[second, np.zeros((3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])
    xy = list(BODY_QUANTITIES).index("inertia.xy")
    assert mass_com_inertia(parameters_from_pseudo_inertia(pseudo))[xy] == pytest.approx(-1.0)


def test_the_sources_have_no_invisible_characters():
    for file in sorted(PROSE.parent.glob("*.typ")):
        assert not re.search("[\u200b-\u200d\u2060\ufeff]", file.read_text(encoding="utf-8")), file.name


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
