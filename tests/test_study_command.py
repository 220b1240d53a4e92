"""The one command line of the studies."""

from __future__ import annotations

import importlib
from pathlib import Path

import pytest

from studies.common.study import Command

STUDIES = sorted(file.parent.name for file in (Path(__file__).resolve().parents[1] / "studies").glob("*/__main__.py"))
PLAIN = Command("load", "Identify a load.")
RICH = Command("load", "Identify a load.", full="more", seed=3, extra={"--quiet": {"action": "store_true"}})


def test_a_report_goes_to_its_file_or_into_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert PLAIN.parse([]).output == Path("reports/load.pdf")
    assert Path("reports").is_dir()
    assert PLAIN.parse(["--output", "deep/other.pdf"]).output == Path("deep/other.pdf")
    assert Path("deep").is_dir()
    assert PLAIN.parse(["--output", "deep"]).output == Path("deep/load.pdf")
    assert PLAIN.parse(["--output", "new"]).output == Path("new/load.pdf")


def test_options_are_those_that_a_study_has(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    options = RICH.parse(["--full", "--seed", "5", "--quiet"])
    assert options.full
    assert options.quiet
    assert options.seed == 5
    assert RICH.parse([]).seed == 3
    with pytest.raises(SystemExit):
        PLAIN.parse(["--full"])
    assert "python -m studies.load: error: unrecognized arguments: --full" in capsys.readouterr().err


def test_a_store_is_not_the_file_of_the_summary(tmp_path, capsys):
    own = Command("planning", "Plan.", extra={"--store": {"type": Path}})
    with pytest.raises(SystemExit, match="2"):
        own.parse(["--output", str(tmp_path / "x.pdf"), "--store", str(tmp_path / "x.json")])
    assert "give another name" in capsys.readouterr().err
    assert own.parse(["--output", str(tmp_path / "x.pdf"), "--store", str(tmp_path / "y.json")]).store.name == "y.json"


@pytest.mark.parametrize("name", STUDIES)
def test_every_study_has_a_command_of_its_name(name, capsys):
    study = importlib.import_module(f"studies.{name}")
    with pytest.raises(SystemExit, match="0"):
        study.main(["--help"])
    assert f"python -m studies.{name}" in capsys.readouterr().out
