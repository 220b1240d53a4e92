"""Where a report comes from: the files with their hashes, version, seed and command."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

from bayesid._io.store import file_key
from bayesid.app.schema import Study

__all__ = ["origin_text", "report_origin"]

Option = bool | str | int | float | Path | list[str] | tuple[str, ...] | None  # value of an option of a command
DIGITS = 12  # digits of a hash that are printed


def report_origin(study: Study, command: str, seed: int | None, **options: Option) -> str:
    """Return the files of a study with the beginnings of their SHA-256, the version, the seed and the whole command.

    Parameters
    ----------
    study : Study
    command : str
        Name of the command.
    seed : int or None
        None of a command without random numbers.
    options : object
        Further options of the command, with underscores for dashes, and their values: whether a switch is on, or what
        is given; a list for an option that is repeated, a tuple for one of several words, None for one not given.
    """
    files = [*study.defining_files, *(recording.file for recording in study.recordings)]
    place = [] if study.file is None else [study.file.name]
    words = ["bayesid", command, *place, *_words({"seed": seed, **options})]
    return origin_text([file for file in files if file is not None], words, seed)


def _words(options: Mapping[str, Option]) -> list[str]:
    """Return options as they are typed."""
    words = []
    for key, value in options.items():
        name = key.replace("_", "-")
        if isinstance(value, bool):
            words.append(f"--{'' if value else 'no-'}{name}")
        else:
            arguments = value if isinstance(value, list) else [] if value is None else [value]
            for argument in arguments:
                words += [f"--{name}", *(argument if isinstance(argument, tuple) else [_typed(argument)])]
    return words


def _typed(value: str | float | Path) -> str:
    return value.name if isinstance(value, Path) else f"{value:g}" if isinstance(value, float) else str(value)


def origin_text(files: Sequence[Path], words: Sequence[str], seed: int | None) -> str:
    """Return the hashes of files, the version, the seed, if there is one, and the words of a command.

    Parameters
    ----------
    files : sequence of Path
        Files whose hashes are stated.
    words : sequence of str
        Command as it is typed.
    seed : int or None
    """
    hashes = ", ".join(f"{file.name} {file_key(file)[:DIGITS]}" for file in files)
    sown = "" if seed is None else f", seed {seed}"
    return f"SHA-256: {hashes}. bayesid {version('bayesid')}{sown}, command: {shlex.join(words)}"
