"""Pages of the tutorial: what a command printed, every file that it wrote, and the first page of its report."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import typst
from PIL import Image, ImageOps

__all__ = ["ADOPTED", "PAGES", "Page", "adopt"]

ADOPTED = "adopted.toml"  # study of the demonstration with its cause, which the reader writes

RESOLUTION = 120  # of a page [dots per inch]
COLOURS = 128  # number of colours of a page
SHEET = '#set page(width: 210mm, height: 297mm, margin: 0mm)\n#image("report.pdf", page: 1, width: 210mm)'


def adopt(folder: Path) -> None:
    """Write the study of the demonstration with its cause beside it."""
    study = folder / "out" / "study" / "study.toml"
    before, after = 'effects = ["gravity-gradient"]', 'effects = ["gravity-gradient", "wheel-momentum"]'
    text = study.read_text(encoding="utf-8")
    assert before in text
    study.with_name(ADOPTED).write_text(text.replace(before, after), encoding="utf-8")


@dataclass(frozen=True)
class Page:
    """One command of the tutorial, with the folder that it writes."""

    name: str
    command: str
    folder: str

    def files(self, work: Path) -> list[dict[str, Any]]:
        """Return the files that the command wrote, with their sizes in kB."""
        made = [file for file in sorted((work / self.folder).rglob("*")) if file.is_file() and file.name != ADOPTED]
        return [
            {"file": str(file.relative_to(work)), "size": max(1, round(file.stat().st_size / 1000))} for file in made
        ]

    def drawn(self, work: Path) -> bytes:
        """Return the first page of the report as PNG."""
        folder = work / self.folder
        sheet = folder.with_suffix(".typ")
        sheet.write_text(SHEET.replace("report.pdf", f"{self.folder}/report.pdf"), encoding="utf-8")
        whole = typst.compile(str(sheet), root=str(work), format="png", ppi=RESOLUTION)
        drawn = io.BytesIO()
        page = Image.open(io.BytesIO(whole)).convert("RGB")
        page = page.crop(ImageOps.invert(page).getbbox())  # without its margins
        page.quantize(COLOURS).save(drawn, format="png", optimize=True)
        return drawn.getvalue()


PAGES = (
    Page("demo", "bayesid demo --output out --samples 1000", "out"),
    Page("check", "bayesid check out/study/study.toml --output check", "check"),
    Page("identify", "bayesid identify out/study/adopted.toml --output after --samples 1000", "after"),
    Page("design", "bayesid design plan.toml --output design --starts 2 --iterations 20", "design"),
)
