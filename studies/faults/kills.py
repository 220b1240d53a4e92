"""Commands killed at random moments and called again, and a cache of compiled code that another version has filled."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import bayesid
from bayesid.robot.robot import Robot

# keys of what differs between two runs of one command: times, and keys of files that say when they were made
DECIDED_BY_CLOCKS = ("seconds", "sha256")

# study of which manoeuvres are designed and flown
STUDY = """
[robot]
urdf = "planar.urdf"
[sensors.rate]
sigma = 1e-5
[sensors.encoder]
sigma = 1e-6
[unknowns]
bodies = ["base_link"]
spread = 0.05
[model]
initial_rate = "zero"
[design]
duration = 30.0
functions = 2
criteria = ["d-optimal"]
[design.limits]
tip_speed = 0.15
"""

SPACECRAFT = """
from bayesid import SensorKind, Model, Robot, Sensor, White
from bayesid.design import SimulatedSpacecraft

execute = SimulatedSpacecraft(
    Model(Robot.shipped("planar"), (Sensor(SensorKind.RATE, White(1e-5)),), (), rate_sigma=0.0), encoder_sigma=1e-6
).execute
"""

# a trial of a campaign, which takes a while
TRIAL = """
import time

def draw(task, rng):
    time.sleep(0.15)
    return [task, *rng.random(3).tolist()]
"""

CAMPAIGN = """
import site
import sys

site.addsitedir(sys.argv[1])
from studies.common.monte_carlo import run_trials
from trial import draw

run_trials(draw, range(40), sys.argv[2] + "/trials.json", seed=5, workers=2)
"""


@dataclass(frozen=True)
class Killed:
    """What became of one command that was killed and called again."""

    command: str  # name of the command
    kills: int  # number of kills that found it running
    half_written: tuple[str, ...]  # results that were there but not whole after a kill
    same: bool  # whether the results in the end, and the names of all files, are those of the command left alone
    message: str  # last line of what the last call said


def _campaign(folder: Path, output: Path) -> list[str]:
    return ["-c", CAMPAIGN, str(folder), str(output)]


def _bayesid(name: str, *options: str) -> Callable[[Path, Path], list[str]]:
    study = "design.toml" if name in ("design", "loop") else "study.toml"

    def arguments(folder: Path, output: Path) -> list[str]:
        where = [str(folder / option) if option.endswith(".py") else option for option in options]
        return ["-m", "bayesid.app.command_line", name, str(folder / study), "--output", str(output), *where]

    return arguments


# functions of the folder of the studies and of the output that return what follows ``python``
COMMANDS: Mapping[str, Callable[[Path, Path], list[str]]] = {
    "campaign": _campaign,
    "design": _bayesid("design", "--starts", "4", "--iterations", "10"),
    "loop": _bayesid("loop", "--spacecraft", "craft.py", "--at-most", "2", "--samples", "300", "--no-diagnose"),
    "identify": _bayesid("identify", "--samples", "300"),
    "diagnose": _bayesid("diagnose", "--no-sample"),
}


def kill_and_resume(command: str, folder: Path, rng: np.random.Generator, kills: int) -> Killed:
    """Run a command alone, then again with kills at random moments, and compare.

    Parameters
    ----------
    command : str; one of `COMMANDS`
    folder : Path; folder with the study ``study.toml``, in which both runs are made
    rng : numpy.random.Generator; source of the moments, uniform over the time that the command takes alone
    kills : int; number of calls that are killed before the last one, which runs to its end

    Raises
    ------
    RuntimeError
        If the command fails where it is left alone.
    """
    Robot.shipped("planar").write_urdf(folder / "planar.urdf")
    (folder / "design.toml").write_text(STUDY)
    (folder / "craft.py").write_text(SPACECRAFT)
    (folder / "trial.py").write_text(TRIAL)
    alone, killed = folder / "alone", folder / "killed"
    began = time.monotonic()
    first = _run(COMMANDS[command](folder, alone))
    taken = time.monotonic() - began
    if first.returncode:
        raise RuntimeError(f"{command} fails even without a kill: {first.stderr}")
    running, broken = 0, []
    for moment in rng.uniform(0.0, taken, size=kills):
        running += _run_and_kill(COMMANDS[command](folder, killed), float(moment))
        broken += half_written(killed)
    last = _run(COMMANDS[command](folder, killed))
    same = last.returncode == 0 and content_of(killed) == content_of(alone)
    text = (last.stdout + last.stderr).strip().splitlines()
    return Killed(command, running, tuple(broken), same, text[-1] if text else "")


def content_of(folder: Path) -> dict[str, Any]:
    """Return the results of a command by the names of their files, without what a clock decides.

    Reports and posterior files say when they were made; of them the names alone count.
    """
    return {file.name: _content(file) for file in sorted(folder.iterdir())}


def _content(file: Path) -> Any:
    if file.suffix == ".csv":
        return file.read_text()
    if file.suffix != ".json":
        return None
    lines = file.read_text().splitlines()
    if file.name == "trials.json":  # a store, whose lines are in the order in which the trials ended
        return sorted(lines)
    return _without_clocks(json.loads("\n".join(lines)))


def half_written(folder: Path) -> list[str]:
    """Return the names of reports and results in JSON that are there but not whole."""
    files = sorted(folder.iterdir()) if folder.is_dir() else []
    return [file.name for file in files if not file.name.startswith((".", "trials")) and not _whole(file)]


def _whole(file: Path) -> bool:
    if file.suffix == ".json":
        try:
            json.loads(file.read_text())
        except ValueError:
            return False
    return file.suffix != ".pdf" or file.read_bytes().rstrip().endswith(b"%%EOF")


def _without_clocks(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _without_clocks(value) for key, value in content.items() if key not in DECIDED_BY_CLOCKS}
    return [_without_clocks(part) for part in content] if isinstance(content, list) else content


def _run(arguments: Sequence[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)


def _run_and_kill(arguments: Sequence[str], moment: float) -> bool:
    """Start a command, kill it with SIGKILL after some time [s], and return whether it was still running."""
    nothing = subprocess.DEVNULL
    with subprocess.Popen([sys.executable, *arguments], stdout=nothing, stderr=nothing) as process:
        try:
            process.wait(moment)
        except subprocess.TimeoutExpired:
            process.kill()
            return True
        return False


FILE = "simulation/effects/environment_effects.py"
# what the other version computes differently: a torque of the gravity gradient a hundred times as large
OWN, OTHER = "3.0 * instant.environment.gradient", "300.0 * instant.environment.gradient"


def answers_beside_another_version(study: Path, folder: Path) -> dict[str, bool]:
    """Identify with an empty cache, then with one that another version filled, and compare.

    Parameters
    ----------
    study : Path; study file whose model has the gravity gradient
    folder : Path; folder for results, caches and the other version

    Returns
    -------
    dict of str to bool
        ``"same"``: whether the other version's cache leaves the answer as it is, to the last digit. ``"differs"``:
        whether the other version answers differently, without which the former would say nothing.
    """
    here = Path(bayesid.__file__).parents[1]
    other = folder / "other"
    shutil.copytree(here / "bayesid", other / "bayesid", ignore=shutil.ignore_patterns("__pycache__"))
    changed = other / "bayesid" / FILE
    text = changed.read_text()
    if text.count(OWN) != 1:
        raise RuntimeError(f"{FILE} does not contain {OWN} exactly once: update the difference of the other version")
    changed.write_text(text.replace(OWN, OTHER))
    alone = _identified(here, study, folder / "alone", folder / "empty")
    theirs = _identified(other, study, folder / "theirs", folder / "cache")
    beside = _identified(here, study, folder / "beside", folder / "cache")
    return {"same": beside == alone, "differs": theirs != alone}


def _identified(package: Path, study: Path, output: Path, cache: Path) -> dict[str, Any]:
    """Return the results of an identification by a version of the package, with a cache of its own."""
    arguments = ["-m", "bayesid.app.command_line", "identify", str(study), "--output", str(output), "--samples", "300"]
    surroundings = os.environ | {"BAYESID_CACHE": str(cache), "PYTHONPATH": str(package)}
    subprocess.run([sys.executable, *arguments], env=surroundings, cwd=package, capture_output=True, check=True)
    return content_of(output)
