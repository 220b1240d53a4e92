"""Every task of the manual has a stored picture, which states the commands and the inputs that made it."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from studies.manual.pictures.pages import PAGES
from studies.manual.pictures.store import INPUTS, STORED, digest, made
from studies.manual.pictures.tasks import TASKS
from tests.test_words import refused

MANUAL = INPUTS.parents[1]
LARGEST = 1_500_000
"""Of all stored files together [bytes]."""


def chapters() -> str:
    return "\n".join(file.read_text(encoding="utf-8") for file in sorted(MANUAL.glob("*.typ")))


def test_every_picture_is_stored_and_stands_in_the_manual_once():
    pictures, text = made()["pictures"], chapters()
    assert list(pictures) == [task.name for task in TASKS]
    assert sorted(re.findall(r'#picture\("(\w+)"\)', text)) == sorted(pictures)
    assert sorted(re.findall(r'#written\("(\w+)"', text)) == sorted(made()["pages"])
    files = {one["file"] for one in (*pictures.values(), *made()["pages"].values())}
    assert {file.name for file in STORED.iterdir()} == {*files, "pictures.json"}
    assert sum(file.stat().st_size for file in STORED.iterdir()) < LARGEST


def test_every_task_that_runs_a_command_has_a_picture():
    """A section of the chapter on tasks that names a command, or keys of the study, ends with a picture."""
    text = (MANUAL / "tasks.typ").read_text(encoding="utf-8")
    begun = text.index("== Importing a bag")
    sections = {part.partition("\n")[0]: part for part in text[begun + 3 :].split("\n== ")}
    assert len(sections) >= 8
    assert [name for name, part in sections.items() if "#picture(" not in part] == ["Writing an effect"]
    effects = (MANUAL / "manual.typ").read_text(encoding="utf-8").partition("== User-defined effects")[2]
    assert '#picture("effect")' in effects.partition("\n== ")[0]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.name)
def test_a_picture_states_its_commands_and_inputs(task):
    stored = made()["pictures"][task.name]
    assert stored["commands"] == task.commands
    assert all(command.startswith("bayesid ") and " --output " in command for command in task.commands)
    # a changed input asks for a new picture
    assert stored["inputs"] == {name: digest(INPUTS / name) for name in task.inputs}
    named = {word for command in task.commands for word in command.split() if word.endswith(".toml")}
    made_before = {name for name in named if name.startswith("out/")}  # by the demonstration, or from its study
    assert named - made_before == set(task.inputs)


def test_every_input_is_read_and_valid():
    files = {file.name for file in INPUTS.iterdir()}
    assert files == {name for task in TASKS for name in task.inputs}
    for name in files:
        assert tomllib.loads((INPUTS / name).read_text(encoding="utf-8"))["title"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_of_the_tutorial_lists_the_files_of_its_command(page):
    stored = made()["pages"][page.name]
    assert stored["command"] == page.command
    files = [Path(one["file"]) for one in stored["files"]]
    assert all(file.parts[0] == page.folder for file in files)
    assert "report.pdf" in {file.name for file in files}
    assert all(one["size"] > 0 for one in stored["files"])


def test_the_version_and_the_seed_are_stated():
    project = tomllib.loads((INPUTS.parents[3] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert made()["version"] == project["version"]
    assert made()["seed"] == 0


def test_readings_are_plain_english_with_numbers():
    for name, one in made()["pictures"].items():
        assert refused(one["reading"]) == [], name
        assert re.search(r"\d", one["reading"]), name
        assert len(one["reading"].split()) < 90, name
