"""Wrong inputs and surroundings of a command: spoilt files, mistaken units, a full disk, a closed folder and more."""

from __future__ import annotations

import csv
import fcntl
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn
from unittest.mock import patch

import numpy as np
from hypothesis import strategies as st
from typer.testing import CliRunner

from bayesid._io.errors import InputError
from bayesid.app.command_line import app
from bayesid.app.functions import check_study

# file of a user's effect, but for the method that fails
PLUGIN = '''
import jax.numpy as jnp
from bayesid import Effect, Parameter, Wrench, register


@register
class Mine(Effect):
    """An effect of a user."""

    name = "test-faulty"
    parameters = (Parameter("x", "N m", 1e-3),)

    def {hook}
'''

# failing methods of an effect, by what they stand for
HOOKS = {
    "an effect that returns NaN": (
        "wrench(self, v, i, s):\n        return Wrench(jnp.zeros(3), jnp.sqrt(-v[0]) + jnp.ones(3))"
    ),
    "an effect of a wrong shape": "wrench(self, v, i, s):\n        return Wrench(jnp.zeros(3), v)",
    "an effect that raises": "wrench(self, v, i, s):\n        return Wrench(i.force, v)",
}


def with_plugin(study: Path, hook: str) -> None:
    """Add an effect of a user with one method to a study, in its folder."""
    (study.parent / "mine.py").write_text(PLUGIN.format(hook=hook))
    text = study.read_text().replace('["gravity-gradient"]', '["gravity-gradient", "test-faulty"]')
    study.write_text(text + '\nplugins = ["mine.py"]\n')


def _closed(study: Path, folder: Path) -> list[str]:
    closed = Path("/sys")  # root may write wherever a disk lets it
    if os.geteuid() != 0:
        closed = folder / "closed"
        closed.mkdir(mode=0o500)
    return ["check", str(study), "--output", str(closed / "out")]


def _check(study: Path, folder: Path) -> list[str]:
    return ["check", str(study), "--output", str(folder / "out")]


def _plugin(hook: str) -> Callable[[Path, Path], list[str]]:
    def arguments(study: Path, folder: Path) -> list[str]:
        with_plugin(study, hook)
        return _check(study, folder)

    return arguments


TWICE = "two runs into one folder"  # title of the case whose folder is claimed meanwhile
FULL = "a full disk"  # title of the case whose folder for results lies on a file system of a few kilobytes

# shell command that runs another one where a folder is such a file system, in a name space of its own
FILL = 'mount -t tmpfs -o size=16k tmpfs "$0" && exec "$@"'

# functions of a study and of a folder that prepare a fault and return the command, by what they stand for
SURROUNDINGS: Mapping[str, Callable[[Path, Path], list[str]]] = {
    FULL: lambda study, folder: ["check", str(study), "--output", str(folder / "disk" / "out")],
    "a folder that cannot be written": _closed,
    TWICE: _check,
    **{title: _plugin(hook) for title, hook in HOOKS.items()},
}


def answer_amid(study: Path, title: str, folder: Path) -> tuple[bool, str]:
    """Return whether a command refuses one of `SURROUNDINGS` with one clear message, and what it says."""
    copied = Path(shutil.copytree(study.parent, folder / "study")) / study.name
    arguments = SURROUNDINGS[title](copied, folder)
    if title == FULL:
        done = _on_full_disk(folder / "disk", sys.executable, "-m", "bayesid.app.command_line", *arguments)
        clear, said = _judged(done.returncode, done.stdout + done.stderr)
        return clear and "No space left" in said, said
    if title == TWICE:
        with _claimed(folder / "out"):
            return _answer(arguments)
    return _answer(arguments)


def can_fill_a_disk() -> bool:
    """Return whether this system lets a process have a file system of its own."""
    if shutil.which("unshare") is None:
        return False
    with tempfile.TemporaryDirectory() as name:
        return _on_full_disk(Path(name) / "disk", "true").returncode == 0


def _on_full_disk(disk: Path, *command: str) -> subprocess.CompletedProcess[str]:
    """Run a command that finds a new folder to be a file system of a few kilobytes."""
    disk.mkdir()
    words = ["unshare", "--map-root-user", "--mount", "sh", "-c", FILL, str(disk), *command]
    return subprocess.run(words, capture_output=True, text=True, check=False)


def _answer(arguments: list[str]) -> tuple[bool, str]:
    done = CliRunner().invoke(app, arguments)
    return _judged(done.exit_code, done.output)


def _judged(status: int, output: str) -> tuple[bool, str]:
    """Return whether a command has refused with one clear message, and what it says, in one line."""
    said = " ".join(output.split())
    return status == 2 and len(re.findall(r"(?:^|\s)Error: ", said)) == 1, said


@contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """Claim a folder as a run in another process does."""
    folder.mkdir()
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(handle)


# texts that take the place of a value
JUNK = (
    *("nan", "inf", "-inf", "-1.0", "0", "0.0", "1e-300", "1e300", "1e400", "9" * 400, "-0.0", "1_000", "0x10", "1,5"),
    *("true", "''", '""', '"x"', "'..'", "'/'", '"\\u0000"', "[]", "[1.0]", "[nan, nan, nan]", "[[]]", "{}", "{x = 1}"),
    *("1979-05-27", "", " ", ",", '"', "'", "\x00", "\ufeff", "é", "\u202e", "<", ">", "&", "#", "=", "[", "]"),
)

ACCEPTED = "the files are accepted"  # message of what ends a command after it has read its files


@dataclass(frozen=True)
class Spoilt:
    """One change of one file."""

    file: str  # ending of the name of the file
    kind: str  # name of the change, one of `KINDS`
    place: float  # where in the file, from 0 at its start to 1 at its end
    text: str  # what is put there

    def apply(self, folder: Path) -> None:
        """Change the file in a folder."""
        file = min(folder.glob(f"*{self.file}"))
        content = file.read_bytes()
        at = min(int(self.place * len(content)), len(content) - 1)
        new = self.text.encode("utf-8", "surrogatepass")
        start, end = _word(content, at)
        line_start, line_end = content.rfind(b"\n", 0, at) + 1, (content.find(b"\n", at) + 1) or len(content)
        line = content[line_start:line_end]
        changed = {
            "replace a value": content[:start] + new + content[end:],
            "insert": content[:at] + new + content[at:],
            "cut off": content[:at],
            "drop a line": content[:line_start] + content[line_end:],
            "repeat a line": content[:line_end] + line + content[line_end:],
            "another byte": content[:at] + bytes([content[at] ^ 0x80]) + content[at + 1 :],
        }
        file.write_bytes(changed[self.kind])


KINDS = ("replace a value", "insert", "cut off", "drop a line", "repeat a line", "another byte")  # changes of a file


def _word(content: bytes, at: int) -> tuple[int, int]:
    """Return where the value about a place begins and ends: it holds no separator of any of the formats."""
    separators = b' ,\n"=<>[]'
    start = end = at
    while start and content[start - 1] not in separators:
        start -= 1
    while end < len(content) and content[end] not in separators:
        end += 1
    return start, end


def spoilt() -> st.SearchStrategy[Spoilt]:
    """Return the strategy of changes."""
    text = st.one_of(st.sampled_from(JUNK), st.floats().map(repr), st.text(max_size=8))
    places = st.floats(0.0, 1.0)
    return st.builds(Spoilt, st.sampled_from([".toml", ".csv", ".urdf"]), st.sampled_from(KINDS), places, text)


@dataclass(frozen=True)
class Answer:
    """What a command answers to a study."""

    status: int  # exit status
    message: str  # what it says
    accepted: bool  # whether it accepts the files
    # what is wrong with the answer: a traceback, another status than 2, no message or several; empty if nothing is
    fault: str


def answer_to(study: Path, change: Spoilt, folder: Path) -> Answer:
    """Copy the folder of a study, change it, and return what ``bayesid check`` answers once it has read the files."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(study.parent, folder)
    change.apply(folder)
    with _reading_alone():
        done = CliRunner().invoke(app, ["check", str(folder / study.name), "--output", str(folder / "out")])
    fault = ""
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        fault = f"{type(done.exception).__name__}: {done.exception}"
    elif done.exit_code != 2:
        fault = f"exit status {done.exit_code}"
    elif not re.search(r"^Error: ", done.output, re.MULTILINE):  # a slow machine shows its progress before
        fault = "no message"
    elif {file.name for file in (folder / "out").glob("*")} - {
        "check.json"
    }:  # which says of unreadable files what is wrong
        fault = "something is written"
    return Answer(done.exit_code, done.output, ACCEPTED in done.output, fault)


@contextmanager
def _reading_alone() -> Iterator[None]:
    """End a command when it has read all files, before anything is compiled."""

    def accept(*read: object) -> NoReturn:
        raise InputError(ACCEPTED)

    with patch.object(check_study, "find_conventions", accept):
        yield


def _columns(prefix: str, factor: float) -> Callable[[Path], None]:
    """Return a change that multiplies all columns of the recordings whose names begin alike."""

    def change(folder: Path) -> None:
        for file in folder.glob("*.csv"):
            with file.open(newline="") as stream:
                header, *rows = csv.reader(stream)
            scaled = [at for at, name in enumerate(header) if name.startswith(prefix)]
            for row in rows:
                for at in scaled:
                    row[at] = repr(float(row[at]) * factor) if row[at] else ""
            with file.open("w", newline="") as stream:
                csv.writer(stream).writerows([header, *rows])

    return change


def _key(pattern: str, factor: float) -> Callable[[Path], None]:
    """Return a change that multiplies the numbers of the study after a pattern, to the end of the line."""

    def change(folder: Path) -> None:
        file = folder / "study.toml"
        number = re.compile(r"-?\d+\.?\d*(e-?\d+)?")

        def scaled(match: re.Match[str]) -> str:
            return match[1] + number.sub(lambda text: repr(float(text[0]) * factor), match[2])

        file.write_text(re.sub(rf"({pattern} = )(.*)", scaled, file.read_text()))

    return change


# changes of the folder of a study, by what they stand for
SLIPS: Mapping[str, Callable[[Path], None]] = {
    "joint positions in degrees": _columns("position.", 180.0 / np.pi),
    "rate in degrees per second": _columns("rate.", 180.0 / np.pi),
    "rate in arcseconds per second": _columns("rate.", 648000.0 / np.pi),
    "acceleration in mm/s²": _columns("accel.", 1000.0),
    "acceleration in g": _columns("accel.", 1.0 / 9.80665),
    "acceleration in mg": _columns("accel.", 1000.0 / 9.80665),
    "time in milliseconds": _columns("time", 1000.0),
    "time in minutes": _columns("time", 1.0 / 60.0),
    "radius of the orbit in km": _key("radius", 1e-3),
    "place of the accelerometer in mm": _key("position", 1000.0),
}


def answer_to_unit(study: Path, slip: str, folder: Path) -> tuple[bool, str]:
    """Return whether ``bayesid check`` refuses or names one wrong unit, and what it says, in one line.

    It refuses with one message and exit status 2, or names a convention that a unit is among and says what remains.
    """
    copied = folder / "study"
    shutil.copytree(study.parent, copied)
    SLIPS[slip](copied)
    done = CliRunner().invoke(app, ["check", str(copied / study.name), "--output", str(folder / "out")])
    clear, said = _judged(done.exit_code, done.output)
    named = done.exit_code == 0 and bool(re.search(r"^convention:unit:", done.output, re.MULTILINE))
    return clear or named, said
