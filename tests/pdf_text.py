"""Text of a PDF, for tests of what a reader sees."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from pypdf import PdfReader

FOOTER = re.compile(r"\s*\d+\s*/\s*\d+\s*$")
CAPTION_AT_THE_FOOT = re.compile(r"\nFigure \d+\.(?:(?!\nFigure \d+\.).)*$", re.DOTALL)
BREAKABLE = re.compile("[\\s\u00ad\u200b-]+")


@dataclass(frozen=True)
class PdfText:
    """Text of a PDF by page, without page numbers; sentences are looked up whatever the breaks of lines and pages.

    Typst breaks lines at spaces and hyphens and may hyphenate, so spaces and hyphens do not count in a comparison.
    A figure at the foot of a page may stand between two halves of a sentence, so a sentence may also run on without
    the caption that ends a page.
    """

    pages: tuple[str, ...]

    @classmethod
    def read(cls, file: Path) -> PdfText:
        return cls(tuple(FOOTER.sub("", page.extract_text()) for page in PdfReader(file).pages))

    def __contains__(self, text: str) -> bool:
        pages = ("".join(self.pages), "".join(CAPTION_AT_THE_FOOT.sub("", page) for page in self.pages))
        return any(_bare(text) in _bare(version) for version in pages)

    def row(self, *cells: str) -> bool:
        """Whether these cells of a table stand beside each other."""
        return "".join(cells) in self


def links_of(file: Path) -> set[str]:
    """Return the targets of all links of a PDF to files and pages of the web."""
    pages = PdfReader(file).pages
    actions = (entry.get_object()["/A"] for page in pages for entry in page.get("/Annots", []))
    return {action["/URI"] for action in actions if "/URI" in action}


def _bare(text: str) -> str:
    return BREAKABLE.sub("", text)
