"""A PDF document, built piece by piece and set by Typst with the fonts that Typst and, for figures, matplotlib bring.

Text that callers give is never read as markup: it reaches Typst as string literals.
"""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

import matplotlib as mpl
import typst
from matplotlib.figure import Figure

from bayesid._io.errors import InputError
from bayesid._io.files import complete_file
from bayesid._io.words import first_sentence
from bayesid._math.threads import in_threads
from bayesid.report.vector_figure import VectorFigure

__all__ = ["Document", "LinkedText", "Rows"]

Rows = list[list[str]]
"""Cells of a table, row by row."""

LONG_WORD = 14  # number of characters from which on a word in a table may break at its punctuation

WHOLE = 12
"""Number of lines of a table above which it may break between two pages; the caption stays with the first of them."""

LINE = 60  # number of characters of a table's cell that fill about one line

HEIGHTS = (1.0, 0.95, 1.05, 0.9, 1.1, 0.85, 1.15, 0.8, 1.2, 0.75, 1.25, 0.7, 1.3)
"""Factors on the heights of figures and on the space in tables, tried in this order until every page is filled."""

TOGETHER = 2  # number of these factors that are tried side by side

FILLED = 0.7  # fraction of its text's height to which every page is then filled, where one of the factors permits

LOOK = "document.typ"  # file beside this one that holds the look of every report

FONTS = [str(Path(mpl.get_data_path()) / "fonts" / "ttf")]
"""Folder of the letters of figures, whose text remains text in the PDF."""

QUANTITY = re.compile(
    r"(?:(?:\b[xyz]|\w+\.\w+) )?(?:[<>] )?\(?[−+]?\d+(?:\.\d+)?(?: ± [\d.]+\)?)?(?: × 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?"
    r"(?: (?:%|(?:N|A|kg|mm|m|s|rad|Hz)[²³]?(?:/\w+[²³]?)?)(?![\w.]\w))*"
)
"""A number with its axis, its uncertainty, its power of ten and its unit, in which no line is broken."""

_MARK = """
#context {
  let at = here().position()
  [#metadata((at.page, (at.y - 20mm) / 255mm)) <%s>]
}
"""
_END, _FLOAT = _MARK % "end", _MARK % "float"
"""Marks at the end of a part and at the top of a floating figure: their page, and how far down the text's height."""


class LinkedText(str):
    """Text of a table's cell that links to a file, whose path is relative to the report's, or to a web page."""

    target: str

    def __new__(cls, text: str, target: str) -> LinkedText:
        """Return the text with its target."""
        link = super().__new__(cls, text)
        link.target = target
        return link


class Document:
    """A report under construction.

    Parameters
    ----------
    title, subtitle : str
    date : str, optional
        Date printed under the title. Where it is left out, the document does not depend on when it was written.
    """

    def __init__(self, title: str, subtitle: str = "", date: str | None = None) -> None:
        self._parts = [
            (files("bayesid.report") / LOOK).read_text(encoding="utf-8"),
            f"#set document(title: {literal(title)}, date: none)\n",
            f"#title({literal(title)}, {literal(subtitle)}, {literal(date or '')})\n",
        ]
        self._links: list[str] = []
        self._figures: list[VectorFigure] = []

    def section(self, title: str) -> None:
        """Begin a numbered section."""
        self._parts.append(f"#heading(level: 1, {literal(title)})\n")

    def paragraph(self, text: str) -> None:
        """Add a paragraph of plain text."""
        self._parts.append(f"#par({literal(text)})\n")

    def items(self, texts: Sequence[str]) -> None:
        """Add a bulleted list, each entry of which stays on one page."""
        if texts:
            entries = (f"block(breakable: false, {literal(text)})" for text in texts)
            self._parts.append(f"#list({', '.join(entries)})\n")

    def decision(self, title: str, entries: Sequence[tuple[str, str]], picture: Figure | None = None) -> None:
        """Add a framed box with a title, rows of a name and its text, and a picture next to them in its true size.

        The first sentence of the title is in bold; what follows is read as its explanation.
        """
        cells = "".join(f", {literal(text)}" for entry in entries for text in entry)
        image = "none" if picture is None else f"image({self._image(picture)})"
        headline, rest = first_sentence(title)
        self._parts.append(f"#decision({literal(headline)}, {literal(rest)}, {image}{cells})\n")

    def mentions(self, pattern: str) -> bool:
        """Whether a regular expression occurs in the content added so far, except in figures."""
        return any(re.search(pattern, part) for part in self._parts[1:])

    def link(self, text: str, target: str) -> None:
        """Make every occurrence of a text a link to a file, whose path is relative to the report's."""
        self._links.append(f"#show {literal(text)}: it => link({literal(target)}, it)\n")

    def foot(self, first: str, last: str = "") -> None:
        """Put a text in small print at the foot of the first page, and another at that of the last."""
        self._parts.insert(1, f"#set page(footer: foot({literal(first)}, {literal(last)}))\n")

    def page(self) -> None:
        """Start a new page."""
        self._parts.append("#pagebreak(weak: true)\n")

    def formula(self, typst_math: str) -> None:
        """Add a displayed formula in Typst's notation, which is the only text that is read as markup."""
        self._parts.append(f"$ {typst_math} $\n")

    def table(
        self,
        header: Sequence[str],
        rows: Sequence[Sequence[str]],
        caption: str | None = None,
        align: Sequence[str] | None = None,
    ) -> None:
        """Add a table, which may run over several pages and is numbered if it has a caption.

        Parameters
        ----------
        header : sequence of str
            Title of each column; a colon at its end, which is not printed, sets the column flush right.
        rows : sequence of sequence of str
            Cells, as many in each row as there are columns.
        caption : str, optional
        align : sequence of str, optional
            Alignment of each column, ``left``, ``center`` or ``right``, in place of that by the titles.
        """
        if align is None:
            align = ["right" if title.endswith(":") else "left" for title in header]
            header = [title.removesuffix(":") for title in header]
        _check_table(header, rows, align)
        cells = [_cell(text) for row in rows for text in row]
        table = (
            f"table(columns: {len(header)}, align: ({', '.join(align)},), table.hline(stroke: 0.8pt), "
            f"table.header({', '.join(_cell(text) for text in header)}), table.hline(stroke: 0.4pt), "
            f"{', '.join([*cells, 'table.hline(stroke: 0.8pt)'])})"
        )
        numbered = f"#figure(kind: table, caption: {literal(caption or '')}, {table})\n"
        if sum(max(-(-len(text) // LINE) for text in row) for row in rows) > WHOLE:
            numbered = f"#{{ show figure: set block(breakable: true)\n {numbered[1:]} }}\n"
        self._parts.append(numbered if caption is not None else f"#{table}\n")

    def figure(self, fig: Figure, caption: str, width: str = "100%", *, floating: bool = False) -> None:
        """Add a numbered figure.

        Parameters
        ----------
        fig : matplotlib.figure.Figure
        caption : str
        width : str
            Width in percent of the text's width, such as ``80%``.
        floating : bool
            Whether it goes to the head or foot of this page or of the next one, so that what follows fills the page.
        """
        if not re.fullmatch(r"\d+(\.\d+)?%", width):
            raise InputError(f"width {width!r} is not a percentage", remedy='Give the width of a figure as "80%"')
        name = self._image(fig)
        place, top = ("auto", f"place[{_FLOAT}]") if floating else ("none", "none")
        body = f"{top} + image({name}, width: {width})"
        self._parts.append(f"#figure({body}, kind: image, placement: {place}, caption: {literal(caption)})\n")

    def _image(self, fig: Figure) -> str:
        """Keep a figure for the document and return the literal of its file's name."""
        self._figures.append(VectorFigure(fig))
        return literal(f"figure-{len(self._figures)}.svg")

    def write(self, path: str | Path, *, filled: bool = False) -> None:
        """Set the document and write it as PDF, all or nothing.

        Parameters
        ----------
        path : str or Path
        filled : bool
            Whether all figures and tables may be made lower or higher by one of `HEIGHTS`, if that fills the pages.
        """
        look, *content = self._parts
        marked = [part + _END if _sets(part) else part for part in content]
        source = "".join([look, *self._links, *marked])
        factor = self._filling_height(source) if filled else 1.0
        with tempfile.TemporaryDirectory() as folder:
            main = _write_all(Path(folder), source, [figure.svg(factor) for figure in self._figures])
            inputs = {"height": str(factor)}
            pdf = typst.compile(main, root=folder, format="pdf", sys_inputs=inputs, font_paths=FONTS)
        with complete_file(path) as part:
            part.write_bytes(pdf)

    def _filling_height(self, source: str) -> float:
        """Return the first factor with which all pages are filled to `FILLED`, or the one that comes nearest to it."""
        flows = [_flows(part) for part in self._parts[1:] if _sets(part)]

        def least_filled(factor: float) -> float:
            with tempfile.TemporaryDirectory() as folder:
                main = _write_all(Path(folder), source, [figure.blank(factor) for figure in self._figures])
                inputs = {"height": str(factor)}
                ends, tops = (
                    json.loads(typst.query(main, mark, field="value", root=folder, sys_inputs=inputs, font_paths=FONTS))
                    for mark in ("<end>", "<float>")
                )
            return _least_filled(ends, flows, tops)

        fills: dict[float, float] = {}
        for first in range(0, len(HEIGHTS), TOGETHER):
            some = HEIGHTS[first : first + TOGETHER]
            fills |= zip(some, in_threads(least_filled, some), strict=True)
            for factor in some:
                if fills[factor] >= FILLED:
                    return factor
        return max(fills, key=lambda factor: fills[factor])


def _sets(part: str) -> bool:
    """Whether a part of a document sets something on its pages, and is no rule."""
    return not part.startswith("#set")


def _flows(part: str) -> bool:
    """Whether a part of a document may begin on one page and end on the next."""
    return part.startswith(("#par", "#list", "#{"))


def _least_filled(
    ends: Sequence[tuple[int, float]], flows: Sequence[bool], tops: Sequence[tuple[int, float]] = ()
) -> float:
    """Return how far the emptiest page is filled, the only page of a document counting as full.

    Parameters
    ----------
    ends : sequence of (int, float)
        Page on which each part ends, and how far down.
    flows : sequence of bool
        Whether each part may begin on an earlier page, which it then fills.
    tops : sequence of (int, float)
        Page and top of each floating figure, which fills the page to its foot, if it stands below the last part.
    """
    depths = dict(ends)  # by page, that of the last part which ends there
    for (before, _), (after, _), flowing in zip(ends, ends[1:], flows[1:], strict=False):
        if after > before and flowing:
            depths[before] = 1.0
    last = max(depths)
    feet = [(page, top) for page, top in tops if top >= depths.get(page, 0.0)]  # others push parts down, which count
    highest = {page: min(top for there, top in feet if there == page) for page, _ in feet}
    for page, top in highest.items():
        if page in depths or page > last:  # on all other pages a part runs on, which fills them
            depths[page] = min(depths.get(page, 0.0) + 1.0 - top, 1.0)
    return min(depths.values()) if len(depths) > 1 else 1.0


def literal(text: str) -> str:
    """Return plain text as a string literal of Typst, with no line broken within a quantity (`QUANTITY`)."""
    clean = QUANTITY.sub(lambda match: match[0].replace(" ", "\u00a0"), text.encode("utf-8", "replace").decode("utf-8"))
    escaped = clean.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return '"' + re.sub(r"[\x00-\x09\x0b-\x1f\x7f]", " ", escaped) + '"'


def _cell(text: str) -> str:
    """Return the Typst expression of a table's cell, whose long words may break after their punctuation.

    An empty box allows the break: a zero-width space would be copied with the text. Options of commands stay whole.
    """
    if isinstance(text, LinkedText):
        return f"link({literal(text.target)}, {_cell(str(text))})"
    parts = re.sub(
        rf"(?<!\S)(?!--)\S{{{LONG_WORD},}}", lambda word: re.sub(r"([._/:\-])(?=\w)", "\\1\0", word[0]), text
    ).split("\0")
    return f"({', '.join(map(literal, parts))},).join(box())" if len(parts) > 1 else literal(text)


def _check_table(header: Sequence[str], rows: Sequence[Sequence[str]], align: Sequence[str]) -> None:
    lengths = {len(row) for row in rows} | {len(align)}
    if lengths != {len(header)}:
        raise InputError(
            f"a table of {len(header)} columns has rows or alignments of length {sorted(lengths)}",
            remedy="Fill every row",
        )
    if unknown := set(align) - {"left", "center", "right"}:
        raise InputError(f"unknown alignment {', '.join(sorted(unknown))}", remedy="Choose left, center or right")


def _write_all(folder: Path, source: str, figures: Sequence[bytes]) -> str:
    """Write the source of a document and its figures into a folder, and return the source's path."""
    for number, content in enumerate(figures, start=1):
        (folder / f"figure-{number}.svg").write_bytes(content)
    (folder / "main.typ").write_text(source, encoding="utf-8")
    return str(folder / "main.typ")
