"""Few entries at the top of the package, one meaning per name, and names of the field."""

from __future__ import annotations

import ast
from collections import Counter, defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "bayesid"
FILES = sorted(PACKAGE.rglob("*.py"))

# identifiers that say nothing in this field, or something else than meant
REFUSED = {
    *("Engine", "Kind", "Nobody", "Side", "Unexplained", "Unread", "designed", "encoder_shadow", "house", "learnt"),
    *("left_over", "polish", "precision_roots", "settled", "ship", "trace_less", "yielding"),
}

# vague identifiers with the number of places that may still bind each, by part of the package: none may grow
VAGUE: dict[str, dict[str, int]] = {
    "held": {"diagnosis": 3},
    "own": {"diagnosis": 24, "report": 2},
    "found": {"diagnosis": 21, "report": 8},
    "item": {"diagnosis": 39, "report": 56},
    "wanted": {"app": 1, "diagnosis": 1, "report": 1},
    "push": {"diagnosis": 5},
    "tone": {"diagnosis": 10},
}


def test_few_entries_at_the_top():
    entries = {entry.stem for entry in PACKAGE.iterdir() if entry.name != "__pycache__"}  # a stub is no other entry
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


def bound_names(tree: ast.AST) -> Iterator[str]:
    """Yield the identifiers that code binds: variables and fields, parameters, functions and classes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name


@cache
def counted_names() -> dict[str, Counter[str]]:
    """Return how often each part of the package binds each identifier."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for file in FILES:
        part = file.relative_to(PACKAGE).parts[0]
        for name in bound_names(ast.parse(file.read_text(encoding="utf-8"))):
            counts[name][part] += 1
    return counts


def test_all_that_binds_a_name_is_seen():
    code = "class A:\n    b: int\n    def c(self, d, *, e=0):\n        f, g = 1, [h for h in ()]\n        return i\n"
    assert sorted(bound_names(ast.parse(code))) == ["A", "b", "c", "d", "e", "f", "g", "h", "self"]


def test_refused_identifiers_are_absent():
    counts = counted_names()
    assert {name: dict(counts[name]) for name in REFUSED if name in counts} == {}


@pytest.mark.parametrize("name", VAGUE)
def test_vague_identifiers_become_fewer(name):
    counts = counted_names().get(name, Counter())
    more = {part: count for part, count in counts.items() if count > VAGUE[name].get(part, 0)}
    assert more == {}, f"{name!r} is bound in more places than before: name what it holds"
