"""Python files of the user, with effects for a study or a spacecraft that executes the plans of ``bayesid loop``."""

from __future__ import annotations

import importlib.util
import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from bayesid._io.errors import InputError
from bayesid.design import NotFlown, Spacecraft
from bayesid.recording.recording import Recording

__all__ = ["load_spacecraft", "run_user_file"]


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
    from bayesid._math.double_precision import (
        in_double_precision,  # JAX, which a study without such files need not load
    )

    name = f"bayesid_user_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if not file.is_file() or spec is None or spec.loader is None:
        raise InputError("no such Python file", file=file, place=place, remedy=remedy)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look up the types of their fields there
    with _blamed(file):
        in_double_precision(spec.loader.exec_module)(module)
    return module


@contextmanager
def _blamed(file: Path, what: str = "it", allowed: tuple[type[Exception], ...] = ()) -> Iterator[None]:
    """Turn an exception of the user's code into an error that names its file, unless it is an allowed one."""
    try:
        yield
    except allowed:
        raise
    except Exception as error:
        problem = f"{what} fails: {type(error).__name__}: {error}"
        raise InputError(problem, file=file, remedy="Correct the file") from error


def load_spacecraft(file: Path) -> Spacecraft:
    """Run a user's file, and return its function ``execute`` or an instance of its class ``Spacecraft``.

    Raises
    ------
    InputError
        If there is no such file, it fails, or it defines neither of the two.
    """
    remedy = "Define a function execute(plan) that returns a Recording, or a class Spacecraft with that method"
    module = run_user_file(file, "--spacecraft", remedy)
    with _blamed(file):
        made: Any = module.Spacecraft() if inspect.isclass(getattr(module, "Spacecraft", None)) else module
    if not callable(getattr(made, "execute", None)):
        raise InputError("it defines no spacecraft", file=file, remedy=remedy)
    return _Checked(made, file)


class _Checked:
    """Spacecraft of the user whose results are checked."""

    def __init__(self, inner: Any, file: Path) -> None:
        self.inner, self.file = inner, file

    def execute(self, plan: Recording) -> Recording:
        """Execute a plan, and refuse a result that is not a recording."""
        with _blamed(self.file, "execute", (InputError, NotFlown)):
            recording = self.inner.execute(plan)
        if not isinstance(recording, Recording):
            problem = f"execute returned a {type(recording).__name__}"
            raise InputError(problem, file=self.file, remedy="Return a bayesid.Recording; Recording.read reads a file")
        return recording
