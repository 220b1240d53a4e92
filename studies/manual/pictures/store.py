"""Store of the pictures: runs their commands, draws them, and states what made them, so that the build only reads."""

from __future__ import annotations

import hashlib
import io
import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

import bayesid
from bayesid._io.files import write_json
from bayesid.report.figures.figure_style import with_plain_labels
from studies.manual.pictures.pages import PAGES
from studies.manual.pictures.tasks import TASKS

__all__ = ["INPUTS", "STORED", "digest", "made", "make"]

INPUTS = Path(__file__).with_name("inputs")
STORED = Path(__file__).with_name("stored")
SEED = 0  # seed of every command, which is its default
DRAWN: dict[str, Any] = {"svg.fonttype": "path", "svg.hashsalt": "bayesid"}


def make(work: Path, say: Callable[[str], None] = print) -> None:
    """Run all commands in a folder, and store the pictures.

    Parameters
    ----------
    work : Path
        Commands whose folder is already in it are not run again.
    say : callable
        Receives every command that runs.
    """
    for file in INPUTS.iterdir():
        shutil.copy(file, work)
    for step in dict.fromkeys(step for task in TASKS for step in task.steps):
        if callable(step):
            step(work)
        else:
            _run(step, work, say)
    for page in PAGES:
        _run(page.command, work, say)
    STORED.mkdir(exist_ok=True)
    for task in TASKS:
        (STORED / f"{task.name}.svg").write_bytes(_svg(task.draw(work)))
    for page in PAGES:
        (STORED / f"page-{page.name}.png").write_bytes(page.drawn(work))
    pictures = {
        task.name: {
            "file": f"{task.name}.svg",
            "commands": task.commands,
            "inputs": {name: digest(INPUTS / name) for name in task.inputs},
            "reading": task.reading(work),
        }
        for task in TASKS
    }
    pages = {
        page.name: {"file": f"page-{page.name}.png", "command": page.command, "files": page.files(work)}
        for page in PAGES
    }
    origin = {"version": bayesid.__version__, "seed": SEED}
    write_json(STORED / "pictures.json", {**origin, "pictures": pictures, "pages": pages})


def made() -> dict[str, Any]:
    """Return what the stored pictures state."""
    read: dict[str, Any] = json.loads((STORED / "pictures.json").read_text(encoding="utf-8"))
    return read


def digest(file: Path) -> str:
    """Return the beginning of a file's SHA-256."""
    return hashlib.sha256(file.read_bytes()).hexdigest()[:12]


def _run(command: str, work: Path, say: Callable[[str], None]) -> None:
    """Run a command in the folder, unless its output is there."""
    program, *words = shlex.split(command)
    assert program == "bayesid"
    if (work / words[words.index("--output") + 1]).exists():
        return
    say(command)
    root = Path(__file__).resolve().parents[3]
    paths = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    call = [sys.executable, "-m", "bayesid.app.command_line", *words]
    subprocess.run(call, cwd=work, env=os.environ | {"PYTHONPATH": paths}, check=True, stdout=subprocess.DEVNULL)


def _svg(figure: Figure) -> bytes:
    with_plain_labels(figure)
    drawn = io.BytesIO()
    with mpl.rc_context(DRAWN):
        figure.savefig(drawn, format="svg", metadata={"Date": None})
    return drawn.getvalue()
