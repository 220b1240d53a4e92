"""Short forms of a result: text at a prompt and HTML in a notebook, both of the same sentences and table."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from math import floor, isfinite, log10
from typing import NamedTuple

__all__ = ["ShortForm", "Summary", "format_probability", "format_spread"]


class Summary(NamedTuple):
    """What the short form of a result says.

    Attributes
    ----------
    sentences : sequence of str
    header : sequence of str
        Names of the columns.
    rows : sequence of sequences of str
        Table beneath the sentences, which may be empty.
    """

    sentences: Sequence[str]
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()


class ShortForm:
    """Result that is shown by its `summary`, and not by its fields, which may hold thousands of numbers."""

    def summary(self) -> Summary:
        """Return what the short form says."""
        raise NotImplementedError

    def __str__(self) -> str:
        sentences, header, rows = self.summary()
        table = [header, *rows] if rows else []
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table]
        return "\n".join([*sentences, *(line.rstrip() for line in lines)])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        sentences, header, rows = self.summary()
        text = "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)
        table = [("th", header), *(("td", row) for row in rows)] if rows else []
        lines = ("".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in row) for tag, row in table)
        return text + (f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>" if rows else "")


def format_probability(probability: float) -> str:
    """Return a probability to three decimals, and of one that rounds to 0 or 1 that it is less or more."""
    if probability > 0.999:
        return "> 0.999"
    return "< 0.001" if probability < 0.001 else f"{probability:.3f}"


def format_spread(mean: float, sd: float, unit: str) -> str:
    """Return a mean with its standard deviation to two digits, and the mean to as many decimals.

    Parameters
    ----------
    mean, sd : float
    unit : str
    """
    places = 1 - floor(log10(sd)) if isfinite(sd) and sd > 0.0 else 3
    shown = (f"{mean:.{places}f}", f"{sd:.{places}f}") if 0 <= places <= 6 else (f"{mean:.3g}", f"{sd:.2g}")
    return f"{' ± '.join(shown)} {unit}".removesuffix(" 1")
