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

TOP, BOTTOM, LEFT, RIGHT = 20.0, 275.0, 20.0, 190.0
"""Where the text of a page begins and ends, from the top and the left of the sheet [mm]."""

FOOT = 24.0
"""Height that small print may take at the foot of the first page [mm]; it does not count."""

TERMS = "Terms. "
"""How the small print at the foot of the last page begins, which stands under a line and does not count either."""

STYLES = {
    "an invisible character": re.compile("[\u200b-\u200d\u2060\ufeff]"),
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
    pages = PdfText.read(file).pages
    count = len(pages)
    for number in range(1, count + int(full)):
        ink = _ink(file, number)
        foot = FOOT if number == 1 else BOTTOM - _lowest_line(ink) if TERMS in pages[number - 1] else 0.0
        end = float((at := _rows(ink, ink.any(axis=1)))[at < BOTTOM - foot].max(initial=0.0))
        share = (end - TOP) / (BOTTOM - TOP)
        if share < 0.5:
            yield f"page {number} of {count} is filled to {100.0 * share:.0f} % only"


def _lowest_line(ink: np.ndarray) -> float:
    """Return how far down a page the lowest line over the whole width stands, a little above it [mm]."""
    left, right = (round(edge / 210.0 * ink.shape[1]) for edge in (LEFT, RIGHT))
    return float(_rows(ink, ink[:, left + 1 : right - 1].all(axis=1)).max(initial=BOTTOM)) - 2.0 * CELL


def _rows(ink: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return how far down the sheet chosen rows of pixels are [mm]."""
    return 297.0 / len(ink) * np.flatnonzero(chosen)


def _ink(file: Path, page: int) -> np.ndarray:
    """Return where a page is not white; Typst draws it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(file, folder / "report.pdf")
        source = folder / "page.typ"
        source.write_text(
            f'#set page(width: 210mm, height: 297mm, margin: 0mm)\n#image("report.pdf", page: {page}, width: 100%)\n',
            encoding="utf-8",
        )
        drawn = typst.compile(str(source), root=name, format="png", ppi=2.0 * 25.4 / CELL)
    return np.asarray(Image.open(io.BytesIO(drawn)).convert("L")) < 240
