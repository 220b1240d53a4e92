"""The picture of the README: the head of a diagnosis report.

``python -m studies.picture out/report.pdf`` writes ``reports/demo.png`` from what ``bayesid demo --output out`` made.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import typst

from bayesid._io.files import complete_file

SHOWN = "176mm"  # height of what is shown of the first page: decision, figure and first table
RESOLUTION = 100  # resolution of the picture [dots per inch]


def run(report: Path, output: Path) -> None:
    """Draw the head of the first page of a report."""
    page = f'image("{report.name}", page: 1, width: 210mm, height: 297mm)'
    source = (
        "#set page(width: 180mm, height: auto, margin: 0mm)\n"
        f"#box(clip: true, height: {SHOWN}, width: 180mm, place(top + left, dx: -15mm, dy: -16mm, {page}))"
    )
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / report.name).write_bytes(report.read_bytes())
        main = Path(folder) / "main.typ"
        main.write_text(source, encoding="utf-8")
        picture = typst.compile(main, root=Path(folder), format="png", ppi=RESOLUTION)
    with complete_file(output) as part:
        part.write_bytes(picture)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.picture", description="Draw the picture of the README.")
    parser.add_argument("report", type=Path, help="report.pdf of a diagnosis")
    parser.add_argument("--output", type=Path, default=Path("reports/demo.png"))
    given = parser.parse_args()
    run(given.report, given.output)
