"""Spacecraft in a Python file of the user, which executes the plans of ``bayesid loop``."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from bayesid._io.errors import InputError
from bayesid.app.user_files import run_user_file
from bayesid.design import NotFlown, Spacecraft
from bayesid.recording.recording import Recording

__all__ = ["Nobody", "load_spacecraft"]


def load_spacecraft(file: Path) -> Spacecraft:
    """Run a user's file, and return its function ``execute`` or an instance of its class ``Spacecraft``.

    Raises
    ------
    InputError
        If there is no such file, it fails, or it defines neither of the two.
    """
    remedy = "Define a function execute(plan) that returns a Recording, or a class Spacecraft with that method"
    module = run_user_file(file, "--spacecraft", remedy)
    try:
        made: Any = module.Spacecraft() if inspect.isclass(getattr(module, "Spacecraft", None)) else module
    except Exception as error:
        raise InputError(f"it fails: {type(error).__name__}: {error}", file=file, remedy="Correct the file") from error
    if not callable(getattr(made, "execute", None)):
        raise InputError("it defines no spacecraft", file=file, remedy=remedy)
    return _Checked(made, file)


class _Checked:
    """Spacecraft of the user whose results are checked."""

    def __init__(self, inner: Any, file: Path) -> None:
        self.inner, self.file = inner, file

    def execute(self, plan: Recording) -> Recording:
        """Execute a plan, and refuse a result that is not a recording."""
        try:
            recording = self.inner.execute(plan)
        except (InputError, NotFlown):
            raise
        except Exception as error:
            raise InputError(
                f"execute fails: {type(error).__name__}: {error}", file=self.file, remedy="Correct the file"
            ) from error
        if not isinstance(recording, Recording):
            raise InputError(
                f"execute returned a {type(recording).__name__}",
                file=self.file,
                remedy="Return a bayesid.Recording; Recording.read reads a file",
            )
        return recording


class Nobody:
    """Spacecraft in place of a robot that is flown elsewhere."""

    def execute(self, plan: Recording) -> Recording:
        """Raise `NotFlown`, because the recording will come later."""
        raise NotFlown
