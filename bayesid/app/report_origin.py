"""Where a report comes from: the files with their hashes, version, seed and command."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from bayesid._io.store import file_key
from bayesid.app.schema import Study

__all__ = ["origin_text", "report_origin"]

DIGITS = 12
"""Digits of a hash that are printed."""


def report_origin(study: Study, command: str, seed: int, options: Sequence[str] = ()) -> str:
    """Return the files of a study with the beginnings of their SHA-256, the version, the seed and the whole command.

    Parameters
    ----------
    study : Study
    command : str
        Name of the command.
    seed : int
    options : sequence of str
        Further words of the command.
    """
    files = [study.robot.urdf, *(recording.file for recording in study.recordings)]
    if study.file is not None:
        files.insert(0, study.file)
    place = [] if study.file is None else [study.file.name]
    return origin_text(files, ["bayesid", command, *place, "--seed", str(seed), *options], seed)


def origin_text(files: Sequence[Path], words: Sequence[str], seed: int | None) -> str:
    """Return the hashes of files, the version, the seed, if there is one, and the words of a command."""
    hashes = ", ".join(f"{file.name} {file_key(file)[:DIGITS]}" for file in files)
    sown = "" if seed is None else f", seed {seed}"
    return f"SHA-256: {hashes}. bayesid {version('bayesid')}{sown}, command: {shlex.join(words)}"
