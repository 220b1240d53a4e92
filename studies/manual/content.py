"""Reference read from the code: commands, keys of the study file, effects, criteria, packages and public names.

Text is given as pieces, of which every other one is code: Typst sets those apart.
"""

from __future__ import annotations

import importlib
import inspect
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

import typer

import bayesid
from bayesid.app.command_line import app
from bayesid.app.schema.editor_schema import editor_schema
from bayesid.design import known_criteria
from bayesid.report.effect_catalogue import CatalogueEntry, catalogue
from bayesid.report.numbers import format_text
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.register import known_effects
from studies.manual import interface

Pieces = list[str]  # a text in pieces: plain, code, plain, and so on

TABLE = re.compile(r'"[^"]+" = \{[^}]*\}')  # a line of a study in a description, which is code

# description of the package, which states its version and the order of its packages
PROJECT = Path(__file__).resolve().parents[2] / "pyproject.toml"

VALUES = {int: "N", float: "X", str: "TEXT", Path: "PATH"}  # words for the value of an option that names none


def content() -> dict[str, Any]:
    """Return all that the manual takes from the code."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))
    return {
        "version": project["project"]["version"],
        "description": project["project"]["description"],
        "commands": [_command(name, made) for name, made in _commands()],
        "sections": list(_sections()),
        "effects": [_effect(entry) for entry in catalogue()],
        "criteria": [{"name": kind.name, "paragraphs": _paragraphs(kind)} for kind in known_criteria().values()],
        "packages": list(_packages(project["tool"]["importlinter"]["contracts"][0]["layers"])),
        "names": [{"name": name, "text": _first(getattr(bayesid, name))} for name in sorted(bayesid.__all__)],
        "hooks": [
            {"name": name, "arguments": _arguments(value), "text": _first(value)}
            for name, value in vars(Effect).items()
            if not name.startswith("_")
            and name != "uses"
            and (callable(value) or isinstance(value, (property, classmethod)))
        ],
        "studies": list(_studies()),
        "functions": [_in_pieces(entry) for entry in interface.functions()],
        "classes": [_in_pieces(entry) for entry in interface.classes()],
    }


def _commands() -> Iterator[tuple[str, Any]]:
    group: Any = typer.main.get_command(app)
    return iter(group.commands.items())


def _command(name: str, made: Any) -> dict[str, Any]:
    arguments = [parameter for parameter in made.params if parameter.param_type_name == "argument"]
    options = [parameter for parameter in made.params if parameter.param_type_name == "option"]
    words = ["bayesid", name, *(_word(parameter) for parameter in arguments)]
    words += [f"{parameter.opts[0]} {_value(parameter)}" for parameter in options if parameter.required]
    return {
        "name": name,
        "text": _pieces(made.help),
        "usage": " ".join(words),
        "options": [
            {"option": _option(parameter), "text": _pieces(parameter.help), "default": _default(parameter.default)}
            for parameter in (*arguments, *options)
        ],
    }


def _option(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        return _word(parameter).strip("[]")
    return " ".join([", ".join([*parameter.opts, *parameter.secondary_opts]), _value(parameter)]).strip()


def _word(argument: Any) -> str:
    word = argument.metavar or argument.name.upper()
    return str(word) if argument.required else f"[{word}]"


def _value(parameter: Any) -> str:
    if parameter.is_flag:
        return ""
    kind = parameter.type_descriptor.annotation
    kinds = [kind, *get_args(kind)]
    return str(parameter.metavar or next(word for key, word in VALUES.items() if key in kinds))


def _default(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_default, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _sections() -> Iterator[dict[str, Any]]:
    """Yield the sections of a study file, each before those within it."""
    schema = editor_schema()
    seen: set[str] = set()

    def visit(made: Mapping[str, Any], name: str) -> Iterator[dict[str, Any]]:
        if name in seen:
            return
        seen.add(name)
        required = made.get("required", ())
        keys: list[dict[str, Any]] = []
        for key, value in made["properties"].items():
            text = _pieces(TABLE.sub("`\\g<0>`", value.get("description", "")))
            default = value.get("default")
            default = str(default).lower() if isinstance(default, bool) else _default(default)
            row = {"value": _type(value), "default": default, "text": text}
            row["default"] = "required" if key in required else row["default"]
            if keys and {**row, "keys": keys[-1]["keys"]} == keys[-1]:
                keys[-1]["keys"].append(key)
            else:
                keys.append({**row, "keys": [key]})
        yield {"name": name, "text": _pieces(made["description"]), "keys": keys}
        for value in made["properties"].values():
            for reference in re.findall(r"#/\$defs/(\w+)", str(value)):
                yield from visit(schema["$defs"][reference], reference)

    return visit(schema, "Study")


def _type(value: Mapping[str, Any]) -> str:
    """Return what a value of the study file must be, in words."""
    if "$ref" in value:
        return "section"
    for key in ("anyOf", "oneOf"):
        if key in value:
            return " or ".join(map(_type, value[key]))
    if "enum" in value:
        return " or ".join(f'"{entry}"' for entry in value["enum"])
    match value["type"]:
        case "array":
            entry = value["prefixItems"][0] if "prefixItems" in value else value["items"]
            if any("enum" in one for one in entry.get("anyOf", [entry])):
                return "list of text"
            if "$ref" in entry:
                return "sections"
            size = f"{value['minItems']} " if value.get("minItems") == value.get("maxItems", -1) else ""
            return f"list of {size}{_plural(entry)}"
        case "object":
            inner = value["additionalProperties"]
            return "sections by name" if "$ref" in inner else f"table of {_plural(inner)}"
        case "string":
            return "path" if value.get("format") == "path" else "text"
        case "integer":
            return "whole number"
        case "boolean":
            return "true or false"
        case _:
            return "number" + {"exclusiveMinimum": " > 0", "minimum": " ≥ 0"}.get(_lower(value), "")


def _lower(value: Mapping[str, Any]) -> str:
    return next((key for key in ("exclusiveMinimum", "minimum") if value.get(key) == 0), "")


def _plural(value: Mapping[str, Any]) -> str:
    word = _type(value)
    return re.sub(r"^(number|whole number|path|table)", r"\1s", word)


def _effect(entry: CatalogueEntry) -> dict[str, Any]:
    kind = known_effects().get(entry.name.partition(":")[0])
    printed = set(re.findall(r"[\w.]+", " ".join(entry.parameters)))
    return {
        "name": entry.name,
        "names": sorted({name.partition(".")[0] for name in entry.names if name in printed}),  # vectors as one
        "summary": _pieces(entry.summary),
        "notes": [] if kind is None else _paragraphs(kind),
        "separated_by": _pieces(entry.separated_by),
        "parameters": [_pieces(line) for line in entry.parameters],
        "sizes": [_pieces(line) for line in entry.sizes],
        "needs": [_pieces(line) for line in entry.needs],
    }


def _packages(layers: Sequence[str]) -> Iterator[dict[str, Any]]:
    for layer in layers:
        for package in layer.split(" | "):
            yield {"name": package, "text": _first(importlib.import_module(f"bayesid.{package}"))}


def _studies() -> Iterator[dict[str, Any]]:
    """Yield the studies, which are the packages that can be run."""
    for file in sorted(PROJECT.with_name("studies").glob("*/__main__.py")):
        name = file.parent.name
        if name != "manual":
            yield {"name": name, "text": _first(importlib.import_module(f"studies.{name}"))}


def _in_pieces(entry: Any) -> Any:
    """Return an entry of the interface whose texts, wherever they stand in it, are in pieces."""
    if isinstance(entry, list):
        return [_in_pieces(part) for part in entry]
    return {
        key: _pieces(value) if key == "text" else _in_pieces(value) if isinstance(value, list) else value
        for key, value in entry.items()
    }


def _arguments(hook: Any) -> str:
    """Return the arguments of a method as it is called, nothing for a property."""
    if isinstance(hook, property):
        return ""
    names = list(inspect.signature(getattr(hook, "__func__", hook)).parameters)
    return f"({', '.join(names[1:])})"


def _first(described: Any) -> Pieces:
    return (_paragraphs(described) or [[""]])[0]


def _paragraphs(described: Any) -> list[Pieces]:
    """Return the prose of a docstring, without the lists of parameters, attributes and errors."""
    prose = re.split(r"\n\n[A-Z]\w+\n-+\n", inspect.getdoc(described) or "")[0]
    return [_pieces(paragraph) for paragraph in prose.split("\n\n")]


def _pieces(text: str) -> Pieces:
    parts = re.split("`+", " ".join(text.split()))
    return [part if index % 2 else format_text(part) for index, part in enumerate(parts)]
