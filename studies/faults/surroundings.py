"""Faults around a run: a full disk, a closed folder, two runs into one folder, and failing effects of a user."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from typer.testing import CliRunner

from bayesid.app.command_line import app

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
