"""Python files of the user, with effects for a study or a spacecraft that executes plans."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

from bayesid._io.errors import InputError

__all__ = ["run_user_file"]


def run_user_file(file: Path, place: str, remedy: str) -> ModuleType:
    """Run a Python file and return it as a module.

    Parameters
    ----------
    file : Path
        Python file to run.
    place : str
        Key or option that names the file, for errors.
    remedy : str
        Remedy where there is no such file, for errors.

    Raises
    ------
    InputError
        If there is no such Python file, or it fails.
    """
    name = f"bayesid_user_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if not file.is_file() or spec is None or spec.loader is None:
        raise InputError("no such Python file", file=file, place=place, remedy=remedy)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look up the types of their fields there
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"it fails: {type(error).__name__}: {error}", file=file, remedy="Correct the file") from error
    return module
