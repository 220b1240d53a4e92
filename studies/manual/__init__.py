"""The manual: prose together with a reference that is read from the code, so that the two cannot disagree.

Commands, keys of the study file, effects, criteria, packages and public names are read from the code (`content`); the
prose that explains them is `manual.typ`, a document of Typst, with the chapters that it includes. An effect without a
formula stops the build. ``python -m studies.manual`` writes ``reports/manual.pdf``, and with ``--site FOLDER`` the same
as a web site.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import typst

from bayesid._io.files import complete_file
from studies.common.study import Command
from studies.manual.site import write_site
from studies.manual.sources import sources

__all__ = ["main", "run"]


def run(output: Path) -> None:
    """Write the manual as PDF, whole or not at all."""
    with tempfile.TemporaryDirectory() as folder:
        source = sources(Path(folder))
        pdf = typst.compile(str(source), root=folder, format="pdf", pdf_tags=False)  # tags triple the size
    with complete_file(output) as part:
        part.write_bytes(pdf)


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the manual according to the command line."""
    site = {"--site": {"type": Path, "metavar": "FOLDER", "help": "also write the manual as a web site into a folder"}}
    options = Command("manual", "Write the manual from the code and its prose.", extra=site).parse(arguments)
    run(options.output)
    if options.site is not None:
        write_site(options.site)
