"""Sources of the manual for Typst: its prose, and the reference that is read from the code."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from studies.manual.content import content
from studies.manual.pictures.store import STORED

__all__ = ["sources"]

PROSE = Path(__file__).with_name("manual.typ")  # includes the other files of Typst in its folder


def sources(folder: Path) -> Path:
    """Write all sources into a folder, and return the file that Typst compiles.

    Parameters
    ----------
    folder : path
        Is made where it is absent.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for file in PROSE.parent.glob("*.typ"):
        shutil.copy(file, folder)
    shutil.copytree(STORED, folder / "pictures", dirs_exist_ok=True)
    (folder / "content.json").write_text(json.dumps(content()), encoding="utf-8")
    return folder / PROSE.name
