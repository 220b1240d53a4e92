"""Units that users mistake, one at a time, and what ``bayesid check`` says of them."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from bayesid.app.command_line import app

__all__ = ["SLIPS", "refused"]


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

        def scaled(found: re.Match[str]) -> str:
            return found[1] + number.sub(lambda text: repr(float(text[0]) * factor), found[2])

        file.write_text(re.sub(rf"({pattern} = )(.*)", scaled, file.read_text()))

    return change


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
"""Changes of the folder of a study, by what they stand for."""


def refused(study: Path, slip: str, folder: Path) -> tuple[bool, str]:
    """Return whether ``bayesid check`` refuses a study with one wrong unit with exit status 2, and what it says."""
    copied = folder / "study"
    shutil.copytree(study.parent, copied)
    SLIPS[slip](copied)
    done = CliRunner().invoke(app, ["check", str(copied / study.name), "--output", str(folder / "out")])
    clear = done.exit_code == 2 and done.output.startswith("Error: ") and not (folder / "out").exists()
    return clear, " ".join(done.output.split())
