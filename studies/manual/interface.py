"""The interface in Python, read from the docstrings: functions with their parameters, classes with what they hold."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import bayesid
from bayesid.inference.body_quantities import BodyDraws, QuantityDraws

# classes whose members the manual lists: results of the functions, and what a sampler needs
RESULTS = (
    *("StudyCheck", "Identification", "Diagnosis", "Identifiability"),
    *("Designs", "Predictions", "Simulation", "LoopResult"),
)
SAMPLING = ("Posterior", "Emcee", "Sampler", "SamplingTarget", "PosteriorDraws")


def functions() -> Iterator[dict[str, Any]]:
    """Yield the functions of the package with their calls, prose and parameters."""
    for name in bayesid.__all__:
        function = getattr(bayesid, name)
        if inspect.isfunction(function):
            yield {"name": name, "call": _call(name, function), "text": _prose(function), "rows": _rows(function)}


def classes() -> Iterator[dict[str, Any]]:
    """Yield the results and what a sampler needs, with their fields, properties and methods."""
    for kind in (*(getattr(bayesid, name) for name in (*RESULTS, *SAMPLING)), BodyDraws, QuantityDraws):
        members = [
            {"name": f"{name}()" if callable(getattr(kind, name)) else name, "text": _prose(value)}
            for name, value in vars(kind).items()
            if not name.startswith("_")
            and (inspect.isfunction(value) or isinstance(value, (property, cached_property, classmethod)))
        ]
        yield {"name": kind.__name__, "text": _prose(kind), "rows": _rows(kind), "members": members}


def _call(name: str, function: Any) -> str:
    """Return how a function is called, with its defaults, and what it returns."""
    parts, starred = [], False
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind is parameter.KEYWORD_ONLY and not starred:
            parts.append("*")
            starred = True
        default = parameter.default
        if default is parameter.empty:
            parts.append(parameter.name)
        else:
            plain = default is None or isinstance(default, (bool, int, float, str))
            parts.append(f"{parameter.name}={default!r}" if plain else f"{parameter.name}=...")
    result = inspect.signature(function).return_annotation
    return f"bayesid.{name}({', '.join(parts)}) -> {result}"


def _prose(described: Any) -> str:
    """Return the first paragraph of a docstring."""
    return " ".join((inspect.getdoc(described) or "").split("\n\n")[0].split())


def _rows(described: Any) -> list[dict[str, str]]:
    """Return the entries of a docstring's lists of parameters and attributes: names, type and text."""
    rows: list[dict[str, str]] = []
    for section in re.findall(
        r"^(?:Parameters|Attributes)\n-+\n(.*?)(?=\n\n[A-Z]\w+\n-+\n|\Z)", inspect.getdoc(described) or "", re.S | re.M
    ):
        for line in section.splitlines():
            if line and not line.startswith(" "):
                names, _, kind = line.partition(" : ")
                rows.append({"names": names, "kind": kind, "text": ""})
            elif line:
                rows[-1]["text"] = f"{rows[-1]['text']} {line.strip()}".strip()
    return rows
