"""Rules that every study's report keeps, checked on the built PDF."""

from __future__ import annotations

import io
import re
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import typst
from PIL import Image

from tests.pdf_text import PdfText

__all__ = ["badly_written", "broken_rules"]

CELL = 2.0
"""Size of a pixel of the pages that are looked at [mm]."""

TOP, BOTTOM = 20.0, 275.0
"""Where the text of a page begins and ends, from the top of the sheet [mm]."""

FOOT = 24.0
"""Height that small print may take at the foot of the first page [mm]; it does not count."""

STYLES = {
    "a power of ten as computers print it": re.compile(r"\d[eE][+-]?\d"),
    "a hyphen as a minus sign": re.compile(r"(?<![\w.,)/=^\]-])-\d"),
    "a unit with a power that is not raised": re.compile(
        r"(?<![A-Za-z0-9_.])(?:N |k?g |rad/)?(?:m|s|rad)[23](?![0-9A-Za-z])"
    ),
}
"""What is not written in a report -> pattern that finds it."""

CAPTION = re.compile(r"^Table \d+\. ", re.MULTILINE)

HEXADECIMAL = re.compile(r"\b(?=[0-9a-f]*\d)[0-9a-f]{12}\b")
"""Hashes and commits, which may hold what looks like a power of ten."""


def broken_rules(file: Path, *, full: bool = True) -> list[str]:
    """Return a sentence for every rule that a report breaks; the last page of a run that is not full may be emptier."""
    return [*_written(file), *_captioned(file), *_filled(file, full)]


def badly_written(text: str) -> Iterator[str]:
    """Yield what a text has of `STYLES`, with the words around it."""
    text = HEXADECIMAL.sub("", text)
    for title, pattern in STYLES.items():
        for match in pattern.finditer(text):
            yield f"{title}: {text[max(0, match.start() - 20) : match.end() + 20]!r}"


def _written(file: Path) -> Iterator[str]:
    for number, page in enumerate(PdfText.read(file).pages, start=1):
        yield from (f"page {number} has {found}" for found in badly_written(page))


def _captioned(file: Path) -> Iterator[str]:
    """Every caption of a table has its table on the same page: more lines than a caption alone has."""
    for number, page in enumerate(PdfText.read(file).pages, start=1):
        for match in CAPTION.finditer(page):
            after = page[match.end() :].strip().splitlines()
            if len(after) < 3:
                yield f"page {number} ends with the caption of a table: {match[0]}"


def _filled(file: Path, full: bool) -> Iterator[str]:
    """Every page is filled to one half at least."""
    count = len(PdfText.read(file).pages)
    for number in range(1, count + int(full)):
        end = _lowest_ink(file, number, FOOT if number == 1 else 0.0)
        share = (end - TOP) / (BOTTOM - TOP)
        if share < 0.5:
            yield f"page {number} of {count} is filled to {100.0 * share:.0f} % only"


def _lowest_ink(file: Path, page: int, foot: float) -> float:
    """Return how far down a page something stands above the foot [mm]; Typst draws the page."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(file, folder / "report.pdf")
        source = folder / "page.typ"
        source.write_text(
            f'#set page(width: 210mm, height: 297mm, margin: 0mm)\n#image("report.pdf", page: {page}, width: 100%)\n',
            encoding="utf-8",
        )
        drawn = typst.compile(str(source), root=name, format="png", ppi=2.0 * 25.4 / CELL)
    ink = np.asarray(Image.open(io.BytesIO(drawn)).convert("L")) < 240
    rows = 297.0 / len(ink) * np.flatnonzero(ink.any(axis=1))
    above = rows[rows < BOTTOM - foot]
    return float(above.max(initial=0.0))
