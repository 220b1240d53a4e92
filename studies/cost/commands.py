"""Commands of the package in processes of their own: time by phase, processor time and memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

__all__ = ["AFTER_VERDICT", "Run", "run_command"]

PROGRAM = "from bayesid.app.command_line import main; main()"

AFTER_VERDICT = ("consequences", "sample", "design", "report")
"""Phases of a diagnosis that follow the verdict."""

STATING = ("diagnosis.json", "identification.json")
"""Files that state the time by phase."""


class Run(NamedTuple):
    """One command.

    Attributes
    ----------
    wall, processor : float
        Time from its start to its end, and processor time of all its threads [s].
    memory : float
        Largest resident memory [GB].
    phases : dict of str to float
        Time by phase, where the command states it [s]; "start" is what comes before the first, import and files.
    """

    wall: float
    processor: float
    memory: float
    phases: dict[str, float]

    @property
    def to_verdict(self) -> float:
        """Time of a diagnosis from its start to the verdict [s]."""
        return self.wall - sum(self.phases.get(name, 0.0) for name in AFTER_VERDICT)


def run_command(words: Sequence[str], study: Path, output: Path, cache: Path) -> Run:
    """Run a command on a study and measure it.

    Parameters
    ----------
    words : sequence of str
        Name of the command and its options.
    study : Path
        Study file.
    output : Path
        Folder of the results, which must not exist.
    cache : Path
        Folder of compiled code; an empty one makes the run a cold one.

    Raises
    ------
    RuntimeError
        If the command fails.
    """
    command = [sys.executable, "-c", PROGRAM, words[0], str(study), "--output", str(output), *words[1:]]
    environment = os.environ | {"BAYESID_CACHE": str(cache)}
    began = time.perf_counter()
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        said = process.stderr.read() if process.stderr else ""
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - began
    if process.returncode:
        raise RuntimeError(f"{' '.join(words)} of {study} failed: {said.strip()[-500:]}")
    phases: dict[str, float] = {}
    for name in STATING:
        if (output / name).is_file():
            phases = json.loads((output / name).read_text(encoding="utf-8"))["seconds"]
            phases = {"start": max(wall - sum(phases.values()), 0.0), **phases}
    return Run(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 2.0**20, phases)
