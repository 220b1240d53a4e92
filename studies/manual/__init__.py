"""The manual: prose together with a reference that is read from the code, so that the two cannot disagree.

Commands, keys of the study file, effects, criteria, packages and public names are read from the code (`content`); the
prose that explains them is `manual.typ`, a document of Typst, with the chapters that it includes. An effect without a
formula stops the build.
``python -m studies.manual`` writes ``reports/manual.pdf``.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

import typst

from bayesid._io.files import complete_file
from studies.common.study import Command
from studies.manual.content import content

__all__ = ["main", "run"]

PROSE = Path(__file__).with_name("manual.typ")  # text of the manual; it includes the other files of Typst in its folder


def run(output: Path) -> None:
    """Write the manual as PDF, whole or not at all."""
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / PROSE.name
        for file in PROSE.parent.glob("*.typ"):
            shutil.copy(file, folder)
        (Path(folder) / "content.json").write_text(json.dumps(content()), encoding="utf-8")
        pdf = typst.compile(str(source), root=folder, format="pdf", pdf_tags=False)  # tags triple the size
    with complete_file(output) as part:
        part.write_bytes(pdf)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the manual as the command line says."""
    run(Command("manual", "Write the manual from the code and its prose.").parse(arguments).output)
