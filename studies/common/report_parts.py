"""Parts that the reports of several studies share."""

from __future__ import annotations

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report import Document
from bayesid.report.numbers import format_unit

__all__ = ["QUANTITY_TITLES", "columns", "not_evaluated"]

QUANTITY_TITLES = tuple(f"{name} [{format_unit(unit)}]" for name, unit in BODY_QUANTITIES.items())
"""Titles of the ten reported quantities of a body, each with its unit."""


def columns(letters: str) -> list[str]:
    """Return the alignment of a table's columns, one letter each: ``l`` for left and ``r`` for right."""
    return [{"l": "left", "r": "right"}[letter] for letter in letters]


def not_evaluated(document: Document, title: str | None = None) -> None:
    """Say that a section belongs to the full study alone, under its title where that is not yet written."""
    if title is not None:
        document.section(title)
    document.paragraph("This section was not evaluated: only the full study evaluates it.")
