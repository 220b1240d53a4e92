"""Commands killed at random moments and called again, against the same commands left alone."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

__all__ = ["Killed", "content_of", "half_written", "kill_and_resume"]

RESULTS = (".json", ".pdf", ".nc", ".csv", ".urdf")
"""Endings of the files that a command leaves; what it goes on from has other names."""

CLOCKS = ("seconds", "evaluations_per_second", "created")
"""Keys of what a clock decides, which differs between two runs of the same command."""

RESUMED = ("search.json", "samples.h5")
"""Files that an interrupted command goes on from, which it removes at its end."""


@dataclass(frozen=True)
class Killed:
    """What became of one command that was killed and called again.

    Attributes
    ----------
    command : str
        Name of the command.
    kills : int
        Number of kills that found it running.
    half_written : tuple of str
        Results that were there but not whole after a kill.
    same : bool
        Whether the results in the end are those of the command left alone.
    message : str
        Last line of what the last call said.
    """

    command: str
    kills: int
    half_written: tuple[str, ...]
    same: bool
    message: str


def kill_and_resume(
    name: str,
    arguments: Callable[[Path], Sequence[str]],
    folder: Path,
    rng: np.random.Generator,
    kills: int,
    prepare: Callable[[Path], None] = lambda output: None,
) -> Killed:
    """Run a command alone, then again with kills at random moments, and compare.

    Parameters
    ----------
    name : str
        Name for the table.
    arguments : callable
        Function of the output folder that returns what follows ``python``.
    folder : Path
        Empty folder for both runs.
    rng : numpy.random.Generator
        Source of the moments, uniform over the time that the command takes alone.
    kills : int
        Number of kills before the last call, which runs to its end.
    prepare : callable
        Function of the output folder that is called before the first run into it.
    """
    alone, killed = folder / "alone", folder / "killed"
    for output in (alone, killed):
        prepare(output)
    # the first run compiles, which a later one need not
    for _ in range(2):
        shutil.rmtree(alone, ignore_errors=True)
        prepare(alone)
        began = time.monotonic()
        first = _run(arguments(alone))
        taken = time.monotonic() - began
        if first.returncode:
            raise RuntimeError(f"{name} fails when it is left alone: {first.stderr}")
    found, broken = 0, []
    for moment in rng.uniform(0.0, taken, size=kills):
        found += _run_and_kill(arguments(killed), float(moment))
        broken += half_written(killed)
    last = _run(arguments(killed))
    same = last.returncode == 0 and content_of(killed) == content_of(alone)
    text = (last.stderr + last.stdout).strip().splitlines()
    return Killed(name, found, tuple(broken), same, text[-1] if text else "")


def content_of(folder: Path) -> dict[str, Any]:
    """Return the results of a command by the names of their files, without what a clock decides.

    Reports and posterior files state when they were made; of them only the names count.
    """
    readers = {".json": lambda file: _without_clocks(json.loads(file.read_text())), ".csv": Path.read_text}
    return {file.name: readers.get(file.suffix, lambda file: None)(file) for file in sorted(folder.iterdir())}


def half_written(folder: Path) -> list[str]:
    """Return the names of results that are there but not whole."""
    files = [file for file in folder.iterdir() if file.suffix in RESULTS] if folder.is_dir() else []
    return [file.name for file in files if not _whole(file)]


def _whole(file: Path) -> bool:
    content = file.read_bytes()
    if file.suffix == ".json":
        try:
            json.loads(content)
        except ValueError:
            return False
    if file.suffix == ".pdf":
        return content.startswith(b"%PDF") and content.rstrip().endswith(b"%%EOF")
    return bool(content)


def _without_clocks(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _without_clocks(value) for key, value in content.items() if key not in CLOCKS}
    return [_without_clocks(item) for item in content] if isinstance(content, list) else content


def _run(arguments: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)


def _run_and_kill(arguments: Sequence[str], moment: float) -> bool:
    """Start a command, kill it with SIGKILL after some time [s], and return whether it was still running."""
    process = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(moment)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
        return True
    return False
