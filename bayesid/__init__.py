"""Bayesian identification of the inertial parameters of free-flying space robots.

A study names a robot, its sensors and recordings. Each command of the command line is a function of its name, which
takes a study and a seed and returns the result::

    found = bayesid.diagnose("study.toml", seed=1)
    print(found)
    print(found.identification.bodies["base_link"].mass)

Names are those of ``__init__.pyi``, and loaded when they are first used (PEP 562), so that the import costs nothing.
"""

from __future__ import annotations

import ast
import importlib
import sys
from pathlib import Path
from types import ModuleType

_STUB = Path(__file__).with_suffix(".pyi")
"""Imports of all public names, which type checkers read too."""

_PLACES = {
    alias.name: line.module
    for line in ast.parse(_STUB.read_text(encoding="utf-8")).body
    if isinstance(line, ast.ImportFrom) and line.module is not None
    for alias in line.names
}

__all__ = sorted(_PLACES)


class _Package(ModuleType):
    """The package, whose functions `design` and `identifiability` have the names of rooms.

    Importing a room would put it in place of the function. It does not, so that the name means the function whatever is
    imported and when; ``from bayesid.design import Problem`` finds the room all the same.
    """

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _PLACES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> object:
    """Load a public name, or read the version from the package's metadata."""
    if name == "__version__":
        from importlib.metadata import version

        return version("bayesid")
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_PLACES[name]), name)


def __dir__() -> list[str]:
    return __all__
