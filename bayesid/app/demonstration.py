"""The demonstration study: shipped recordings of MuJoCo with a hidden cause."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

from bayesid._io.files import create_folder, write_text

__all__ = ["copy_demonstration"]


def copy_demonstration(folder: Path) -> dict[str, dict[str, float]]:
    """Copy the shipped study into a folder.

    Returns
    -------
    dict
        True values of the effects hidden in its recordings, by effect and key, in SI units.
    """
    create_folder(folder)
    shipped = files("bayesid.app") / "demonstration_data"
    answer: dict[str, dict[str, float]] = {}
    for item in shipped.iterdir():
        text = item.read_text(encoding="utf-8")
        if item.name == "hidden.json":
            answer = json.loads(text)
        else:
            write_text(folder / item.name, text)
    return answer
