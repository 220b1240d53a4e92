"""Errors in a study file, explained in the user's terms."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from bayesid._io.errors import InputError
from bayesid.app.schema.value_types import Section

# required values by pydantic's type of error; other types use pydantic's message
_WANTED = {
    "model_type": "a table",
    "dict_type": "a table",
    "mapping_type": "a table",
    "tuple_type": "a list",
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text in quotes",
    "path_type": "a path in quotes",
    "string_too_short": "a name",
}


def suggest(name: str, known: Sequence[str]) -> str | None:
    """Return a hint at the most similar known name, None if there is no similar one.

    Parameters
    ----------
    name : str
        Unknown name.
    known : sequence of str
        Names that exist.
    """
    near = difflib.get_close_matches(name, known, n=1)
    return f"Did you mean '{near[0]}'?" if near else None


def syntax_error(error: tomllib.TOMLDecodeError, file: Path) -> InputError:
    """Return the parser's message as an error whose place is the line.

    Parameters
    ----------
    error : tomllib.TOMLDecodeError
    file : Path
        Study file.
    """
    text = str(error)
    match = re.search(r"\s*\(at (line \d+, column \d+|end of document)\)", text)
    place = match.group(1) if match else None
    problem = text.replace(match.group(0), "") if match else text
    return InputError(f"not valid TOML: {problem}", file=file, place=place, remedy="Correct the syntax there")


def explain(error: ValidationError, data: Mapping[str, Any], study: type[Section]) -> InputError:
    """Return the first error in the user's terms, with the number of further errors in its remedy.

    A misspelt key comes first, because it is usually the reason why another key is missing, then what stands first in
    the file.

    Parameters
    ----------
    error : pydantic.ValidationError
    data : mapping of str to object
        Content of the study file.
    study : type of Section
        Section of the whole file.
    """
    errors = error.errors(include_url=False)
    faults = sorted(errors, key=lambda fault: (fault["type"] != "extra_forbidden", _order(fault, data)))
    first = _one_error(faults[0], data, study)
    # an error in one number that stands for three axes counts once
    others = len({_path_of(fault, data) for fault in faults}) - 1
    if not others:
        return first
    remedy = f"{first.remedy or ''} ({others} more error{'s' if others > 1 else ''} in this file)".lstrip()
    return InputError(first.problem, place=first.place, remedy=remedy)


def _order(fault: ErrorDetails, data: Any) -> tuple[int, ...]:
    """Return the place of a fault in the file, by the order of its keys; what is missing comes last."""
    order: list[int] = []
    for part in _path_of(fault, data):
        keys: list[str | int] = list(data) if isinstance(data, Mapping) else list(range(len(data)))
        order.append(keys.index(part) if part in keys else len(keys))
        data = data[part] if part in keys else {}
    return tuple(order)


def _path_of(fault: ErrorDetails, data: Any) -> tuple[str | int, ...]:
    """Return pydantic's location without the parts that are not in the file, such as union branches and "[key]"."""
    path: list[str | int] = []
    last = len(fault["loc"]) - 1
    for position, part in enumerate(fault["loc"]):
        is_key = isinstance(data, Mapping) and part in data
        is_entry = isinstance(data, list) and isinstance(part, int) and part < len(data)
        if is_key or is_entry:
            data = data[part]
            path.append(part)
        elif fault["type"] == "missing" and position == last:
            path.append(part)
    return tuple(path)


def _one_error(fault: ErrorDetails, data: Mapping[str, Any], study: type[Section]) -> InputError:
    kind = fault["type"]
    path = _path_of(fault, data)
    place = _place(path)
    if kind == "extra_forbidden":
        known = _table_at(study, path[:-1]).key_names()
        remedy = f"{suggest(str(path[-1]), known) or ''} Allowed: {', '.join(known)}".lstrip()
        return InputError(f"unknown key '{path[-1]}'", place=place, remedy=remedy)
    if kind == "missing":
        is_section = _section_in(_table_at(study, path[:-1]).model_fields[str(path[-1])].annotation) is not None
        problem, remedy = ("section", f"Add [{place}]") if is_section else ("key", f"Add {path[-1]} = ...")
        return InputError(f"the {problem} is missing", place=place, remedy=remedy)
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        within = ".".join(part for part in (place, cause.place) if part)
        return InputError(cause.problem, place=within or None, remedy=cause.remedy)
    expected = fault["msg"].removeprefix("Input should be ")
    if kind.startswith(("greater_than", "less_than")):
        expected = f"a value {expected}"
    return InputError(f"got {fault['input']!r}", place=place, remedy=f"Give {_WANTED.get(kind, expected)}")


def _place(path: Sequence[str | int]) -> str:
    """Return a path as text, with the entries of lists counted from 1."""
    text = ""
    for part in path:
        text += f" #{part + 1}" if isinstance(part, int) else f".{part}" if text else part
    return text


def _table_at(section: type[Section], path: Sequence[str | int]) -> type[Section]:
    """Return the class of the table at a path, relative to the class of another table."""
    for part in path:
        if isinstance(part, str) and part in section.model_fields:
            section = _section_in(section.model_fields[part].annotation) or section
    return section


def _section_in(annotation: Any) -> type[Section] | None:
    """Return the section class in an annotation such as ``tuple[LoadSection, ...]`` or ``OrbitSection | None``."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    return next(filter(None, map(_section_in, get_args(annotation))), None)
