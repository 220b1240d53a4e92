"""The house shows itself: few rooms, one meaning per name, and nothing that imports upward."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "bayesid"
FILES = sorted(PACKAGE.rglob("*.py"))


def test_few_rooms_at_the_top():
    entries = [item.name for item in PACKAGE.iterdir() if item.name != "__pycache__"]
    assert len(entries) <= 12, sorted(entries)


def test_no_two_files_have_one_name():
    places = defaultdict(list)
    for file in FILES:
        if file.name != "__init__.py":
            places[file.name].append(str(file.relative_to(PACKAGE)))
    assert len(places) > 100
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


def test_no_two_public_classes_have_one_name():
    places = defaultdict(list)
    for file in FILES:
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(str(file.relative_to(PACKAGE)))
    assert len(places) > 100
    assert {name: where for name, where in places.items() if len(where) > 1} == {}


@pytest.mark.parametrize("folder", ["bayesid", "studies", "tests"])
def test_no_path_is_tampered_with(folder):
    files = [file for file in (ROOT / folder).rglob("*.py") if file.name != Path(__file__).name]
    assert files
    guilty = [str(file.relative_to(ROOT)) for file in files if "sys.path" in file.read_text(encoding="utf-8")]
    assert guilty == []


def test_truths_share_no_code_with_the_package():
    files = sorted((ROOT / "studies" / "truth").rglob("*.py"))
    assert len(files) >= 5
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not [name for name in names if name.split(".")[0] == "bayesid"], file
