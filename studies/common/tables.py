"""Tables of reports whose first columns hold words and whose other columns hold numbers."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.report import Document

__all__ = ["add_number_table"]


def add_number_table(
    document: Document,
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    caption: str | None = None,
    words: int = 1,
) -> None:
    """Add a table to a document, with words aligned to the left and numbers to the right.

    Parameters
    ----------
    document : Document
    header : sequence of str
        Title of each column.
    rows : sequence of sequence of str
        Cells, row by row.
    caption : str, optional
    words : int
        Number of leading columns that hold words.
    """
    document.table(header, rows, caption, ["left"] * words + ["right"] * (len(header) - words))
