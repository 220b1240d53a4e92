"""A cache of compiled functions that another version of the package filled."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import bayesid
from studies.faults.kills import content_of

__all__ = ["answers_beside_another_version"]

FILE = "simulation/effects/environment_effects.py"
OWN, OTHER = "3.0 * instant.environment.gradient", "300.0 * instant.environment.gradient"
"""What the other version computes differently: a torque of the gravity gradient a hundred times as large."""


def answers_beside_another_version(study: Path, folder: Path) -> dict[str, bool]:
    """Identify with an empty cache, then with one that another version filled, and compare.

    Parameters
    ----------
    study : Path
        Study file whose model has the gravity gradient.
    folder : Path
        Folder for results, caches and the other version.

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
        raise RuntimeError(f"{FILE} has no single {OWN}: say anew what the other version computes differently")
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
