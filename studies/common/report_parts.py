"""Parts that the reports of several studies share: tables, and the meanings of terms."""

from __future__ import annotations

import re
from collections.abc import Sequence

from bayesid.report import Document

# meanings by term, as reports write it
TERMS = {
    "a-optimal": "smallest sum of the posterior variances",
    "chi-square": "sum of squared residuals in standard deviations, per sample 1 if the model is right",
    "condition number": "largest over smallest singular value of the columns to be identified",
    "d-optimal": "smallest determinant of the posterior covariance",
    "e-optimal": "smallest variance in the worst direction",
    "(26)": "the paper's criterion for manoeuvres",
    "effective samples": "number of independent samples with the same information",
    "emcee": "ensemble sampler of the posterior",
    "family-wise": "for all tests together",
    "importance sampling": "weighted draws from the Laplace approximation",
    "Laplace": "the normal distribution at the posterior's mode",
    "ln B": "logarithm of the ratio of two models' evidences",
    "NUTS": "the No-U-Turn Sampler, Hamiltonian Monte Carlo that ends a path before it turns back",
    "ranks": "positions of the truth among the posterior draws",
    "sd": "standard deviation",
    "rms": "root mean square",
}

# studies by the subject with which reports mention them, as in "the report on excitation"
SUBJECTS = {
    "base parameters": "base_parameters",
    "blind injections": "blind_injections",
    "calibration": "calibration",
    "cost": "cost",
    "excitation": "excitation",
    "sensors": "sensors",
    "the base body": "base_body",
    "the whole system": "whole_system",
}


def link_reports(document: Document) -> None:
    """Make every mention of a study's report a link to it, as a file in the same folder."""
    for subject, study in SUBJECTS.items():
        document.link(f"report on {subject}", f"{study}.pdf")


def glossary(document: Document) -> str:
    """Return the meanings of the terms that a document holds as whole words, in one sentence; nothing without any."""
    meanings = [
        f"{term}: {meaning}" for term, meaning in TERMS.items() if document.mentions(rf"(?<!\w){re.escape(term)}(?!\w)")
    ]
    return f"Terms. {'; '.join(meanings)}." if meanings else ""


def columns(letters: str) -> list[str]:
    """Return the alignment of a table's columns, one letter each: ``l`` for left and ``r`` for right."""
    return [{"l": "left", "r": "right"}[letter] for letter in letters]


def add_number_table(
    document: Document, header: Sequence[str], rows: Sequence[Sequence[str]], caption: str | None = None, words: int = 1
) -> None:
    """Add a table with words in its leading columns, aligned to the left, and numbers in the others, to the right.

    Parameters
    ----------
    document : Document
    header : sequence of str; title of each column
    rows : sequence of sequence of str; cells, row by row
    caption : str, optional
    words : int; number of leading columns that hold words
    """
    document.table(header, rows, caption, ["left"] * words + ["right"] * (len(header) - words))
