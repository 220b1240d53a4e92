"""What a user reads is plain technical English: words that sound translated are refused wherever they would appear."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from bayesid._io.words import first_sentence
from studies.manual.content import content

ROOT = Path(__file__).resolve().parents[1]

REFUSED = re.compile(
    r"\b(tells?|told|says?|said|shows|of which|besides?|wants?|wanted|due|holds?|held|mend(?:s|ed)?|kept|keeps|leaves"
    r"|found|own|course|ships?|slides?|house|rooms?|star[- ]sensors?|known to \d|loudest|what it would take"
    r"|honest(?:ly)?)\b",
    re.IGNORECASE,
)


# names of cases, by which the stored trials of a campaign know them
STORED = {"base body, arm known to 5 %", "arm known to 5 %", "two arms and a slide"}


def refused(text: str) -> list[str]:
    """Return the refused words of a text, each with what stands around it; code and names of options are left out."""
    text = re.sub(r"`[^`]*`|--[a-z-]+", "`", text)
    return [f"{text[max(hit.start() - 40, 0) : hit.end() + 30]!r}" for hit in REFUSED.finditer(text)]


def literals(tree: ast.AST) -> Iterator[ast.Constant]:
    """Yield the texts of code that are sentences, docstrings apart."""
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in alone
            and " " in node.value
        ):
            yield node


def texts(value: object) -> Iterator[str]:
    """Yield all texts of nested lists and mappings."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        yield from (text for one in value.values() for text in texts(one))
    elif isinstance(value, (list, tuple)):
        yield from (text for one in value for text in texts(one))


@cache
def files() -> list[Path]:
    """Files whose literals reach a user; the truths of the studies write none of the reports."""
    sources = [*(ROOT / "bayesid").rglob("*.py"), *(ROOT / "studies").rglob("*.py")]
    return sorted(file for file in sources if "truth" not in file.relative_to(ROOT).parts)


def test_a_translated_sentence_is_refused():
    assert len(refused("What the simulation leaves belongs to the loudest tone of its own")) == 3
    assert refused("A leak moves the base in each direction; `held` is a key") == []


def test_messages_and_reports_are_plain_english():
    assert len(files()) > 300
    guilty = [
        f"{file.relative_to(ROOT)}:{node.lineno}: {hit}"
        for file in files()
        for node in literals(ast.parse(file.read_text(encoding="utf-8")))
        if node.value not in STORED
        for hit in refused(str(node.value))
    ]
    assert guilty == []


def test_the_reference_of_the_manual_is_plain_english():
    guilty = [hit for text in texts(content()) for hit in refused(text)]
    assert guilty == []


@pytest.mark.parametrize(
    "name",
    [
        "README.md",
        *(f"studies/manual/{name}.typ" for name in ("manual", "start", "tasks", "help", "reports", "figures", "index")),
    ],
)
def test_prose_is_plain_english(name):
    text = re.sub(r"```.*?```", "", (ROOT / name).read_text(encoding="utf-8"), flags=re.DOTALL)
    text = "\n".join(line for line in text.splitlines() if not line.startswith(("    ", "#let", "#show", "//")))
    assert refused(text) == []


@pytest.mark.parametrize(
    ("text", "split"),
    [
        ("It is 0.5 m (1 sigma). With 3 it is more. So.", ("It is 0.5 m (1 sigma).", "With 3 it is more. So.")),
        ("58 of 63 are inside. 4 of 4 are named.", ("58 of 63 are inside.", "4 of 4 are named.")),
        ("Decision. Explained: payload", ("Decision. Explained: payload", "")),
    ],
)
def test_the_first_sentence_is_the_headline(text, split):
    assert first_sentence(text) == split
