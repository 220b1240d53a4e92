"""Files of results that are complete or absent, because they are written elsewhere and then moved into place."""

from __future__ import annotations

import json
import math
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError

if sys.platform != "win32":
    import fcntl

__all__ = ["claimed_folder", "complete_file", "complete_folder", "create_folder", "write_json", "write_text"]


@contextmanager
def complete_file(file: str | Path) -> Iterator[Path]:
    """Yield a temporary path to write to; its file replaces the given one, unless the block fails."""
    target = Path(file)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)


def write_text(file: str | Path, text: str) -> None:
    """Write text as UTF-8, whole or not at all.

    Parameters
    ----------
    file : str or Path
    text : str
    """
    with complete_file(file) as part:
        part.write_text(text, encoding="utf-8")


def write_json(file: str | Path, content: dict[str, Any]) -> None:
    """Write JSON with arrays as lists and numbers that are not finite as null, whole or not at all.

    Parameters
    ----------
    file : str or Path
    content : dict of str to object
    """
    write_text(file, json.dumps(_finite(content), indent=1, allow_nan=False))


def _finite(value: Any) -> Any:
    match value:
        case dict():
            return {key: _finite(part) for key, part in value.items()}
        case list() | tuple():
            return [_finite(part) for part in value]
        case np.ndarray() | np.generic():
            return _finite(value.tolist())
        case float() if not math.isfinite(value):
            return None
        case _ if value is None or isinstance(value, (str, bool, int, float)):
            return value
        case _:  # an array of another library
            return _finite(np.asarray(value))


def create_folder(folder: Path) -> None:
    """Create a folder for results, unless it exists.

    Raises
    ------
    InputError
        If the folder cannot be created.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot create the folder: {error.strerror}", file=folder, remedy="Choose another output"
        ) from None


_claimed: set[Path] = set()


@contextmanager
def claimed_folder(folder: Path) -> Iterator[None]:
    """Create a folder for results and keep other processes out of it; what a killed run left unfinished is removed.

    A new folder in which nothing was written is removed again. The system ends the claim of a process that is killed. A
    block within another one of the same process is part of it.

    Raises
    ------
    InputError
        If the folder cannot be created, or another process has claimed it.
    """
    existed = folder.exists()
    create_folder(folder)
    key = folder.resolve()
    if key in _claimed or sys.platform == "win32":
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        _lock(handle, folder)
        _claimed.add(key)
        for leftover in [*folder.glob(".part-*"), *folder.glob(".*.part")]:
            shutil.rmtree(leftover) if leftover.is_dir() else leftover.unlink()
        yield
    finally:
        _claimed.discard(key)
        os.close(handle)
        if not existed:
            with suppress(OSError):  # something was written
                folder.rmdir()


def _lock(handle: int, folder: Path) -> None:
    """Lock an open folder until it is closed, where the file system has locks."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        problem = "another run is writing into this folder"
        raise InputError(problem, file=folder, remedy="Wait until it ends, or choose another output folder") from None
    except OSError:
        pass


@contextmanager
def complete_folder(output: Path) -> Iterator[Path]:
    """Yield a temporary folder whose files are moved to the output together, unless the block fails."""
    with claimed_folder(output), tempfile.TemporaryDirectory(dir=output, prefix=".part-") as name:
        yield Path(name)
        for entry in sorted(Path(name).iterdir()):
            shutil.move(str(entry), output / entry.name)
