"""Version of the code that makes a study's figures: release, commit, and a fingerprint that words do not change.

Reports are set anew whenever their words or pictures improve, which changes neither trials nor figures. So the
fingerprint is taken of the code that makes numbers: of its syntax, without docstrings, comments, layout and prose.
"""

from __future__ import annotations

import ast
import gzip
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import bayesid
from studies.common.provenance import ROOT, commit

# what every study calls, and what only words and pictures are made with
NUMBERS = ("bayesid", "studies/common", "studies/truth")
WORDS = ("bayesid/report", "bayesid/_io/words.py", "studies/common/report_parts.py", "studies/common/figures.py")
CODE = (".py", ".urdf", ".xml", ".toml", ".csv")  # endings of files that figures depend on
OF_REPORT = ("report.py", "goals.py", "rows.py")  # files of a study that judge, word and draw what was computed

# what reads options, calls the functions of the package and prints, which changes only the figures of studies of that
COMMANDS = ("bayesid/app/*_command.py", "bayesid/app/command_line.py")
REMEDIES = ("bayesid/app/convention_remedies.py",)
STUDIED = {"faults": (*COMMANDS, *REMEDIES), "conventions": REMEDIES}


class CodeVersion(NamedTuple):
    """Version of the code that made some figures."""

    release: str  # version of the package
    commit: str
    numbers: str  # fingerprint of the code that makes numbers

    @classmethod
    def present(cls, study: str) -> CodeVersion:
        """Return the version of the code of a study, by its name, as it is now."""
        return cls(bayesid.__version__, commit(), fingerprint(study))

    @classmethod
    def of_trials(cls, store: Path) -> list[CodeVersion]:
        """Return the versions that made the trials of a store, each once, the oldest first."""
        data = store.read_bytes()
        lines = (gzip.decompress(data) if store.suffix == ".gz" else data).splitlines()[1:]
        made = (json.loads(line).get("code") or UNRECORDED for line in lines if line.endswith(b"}"))
        return list(dict.fromkeys(cls(*code) for code in made))


UNRECORDED = CodeVersion("before 0.3.0", "not recorded", "not recorded")
"""Version of trials that were stored without one."""


def caution(versions: Iterable[CodeVersion], present: CodeVersion) -> str:
    """Return what a report says of figures that another version of the code made, nothing where none were."""
    others = [version for version in versions if version[::2] != present[::2]]
    if not others:
        return ""
    made = ", ".join(f"{version.release} (commit {version.commit})" for version in others)
    return f"The numbers were made by bayesid {made}; its code has changed since, so the present one may give others."


def refusals(summaries: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Yield what is wrong with the versions of studies' summaries, by the names of the studies."""
    for study, summary in summaries.items():
        said = caution((CodeVersion(**version) for version in summary["versions"]), CodeVersion.present(study))
        if said or not summary["versions"]:
            yield f"{study}: {said or 'no version is stated.'} Run python -m studies.{study} --full"


def study_of(module: str) -> str:
    """Return the study that a module belongs to, or what all studies share for a module of none."""
    first, _, rest = module.partition(".")
    return rest.partition(".")[0] if first == "studies" else "common"


@cache
def fingerprint(study: str) -> str:
    """Return the fingerprint of the code that makes the numbers of a study, a dozen digits."""
    return hashlib.sha256("\n".join(_pieces(study)).encode()).hexdigest()[:12]


def _pieces(study: str) -> Iterator[str]:
    """Yield name and content of every file that makes numbers, in the order of their names."""
    own = ROOT / "studies" / study
    folders = [*(ROOT / name for name in NUMBERS), own]
    words = [*(ROOT / name for name in WORDS), *(own / name for name in OF_REPORT)]
    apart = {*COMMANDS, *REMEDIES} - {*STUDIED.get(study, ())}
    words += [file for pattern in apart for file in ROOT.glob(pattern)]
    for file in sorted(file for folder in folders for file in folder.rglob("*")):
        if file.suffix in CODE and not any(file.is_relative_to(word) for word in words):
            yield f"{file.relative_to(ROOT)} {_content(file)}"


@cache
def _content(file: Path) -> str:
    """Return the fingerprint of one file."""
    data = file.read_bytes()
    return hashlib.sha256("".join(_syntax(ast.parse(data))).encode() if file.suffix == ".py" else data).hexdigest()


def _syntax(node: object) -> Iterator[str]:
    """Yield a syntax tree in a form that every version of Python gives alike, prose left out.

    Prose is text with a blank in it; names, keys and units of which figures depend have none.
    """
    match node:
        case ast.Expr(value=ast.Constant(value=str())):  # a docstring
            return
        case ast.Constant(value=str(text)):
            yield repr(text) if text and " " not in text else ""  # some versions end formats with an empty text
        case ast.Constant(value=value):
            yield repr(value)
        case ast.AST():
            yield f"({type(node).__name__}"
            for name, value in ast.iter_fields(node):
                if value not in (None, []) and name not in ("kind", "ctx", "type_comment"):
                    yield f" {name}="
                    yield from _syntax(value)
            yield ")"
        case list():
            for item in node:
                yield "".join(_syntax(item))
        case _:
            yield repr(node)
