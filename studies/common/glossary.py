"""Terms of the field that reports use without explaining them where they stand."""

from __future__ import annotations

import re

from bayesid.report import Document

__all__ = ["TERMS", "glossary"]

TERMS = {
    "a-optimal": "smallest sum of the posterior variances",
    "chi-square": "sum of squared residuals in standard deviations, per sample 1 where the model is right",
    "condition number": "largest over smallest singular value of the columns to be identified",
    "d-optimal": "smallest determinant of the posterior covariance",
    "e-optimal": "smallest variance in the worst direction",
    "(26)": "the paper's criterion for manoeuvres",
    "effective samples": "independent samples that would tell as much",
    "emcee": "ensemble sampler of the posterior",
    "family-wise": "for all tests together",
    "importance sampling": "weighted draws from the Laplace approximation",
    "Laplace": "the normal distribution at the posterior's mode",
    "ln B": "logarithm of the ratio of two models' evidences",
    "NUTS": "Hamiltonian Monte Carlo without U-turns",
    "rank": "place of the truth among posterior draws",
    "sd": "standard deviation",
    "rms": "root mean square",
}
"""Meanings by term, as reports write it."""


def glossary(document: Document) -> str:
    """Return the meanings of the terms that a document holds, in one sentence; nothing where it holds none."""
    found = [f"{term}: {meaning}" for term, meaning in TERMS.items() if document.mentions(_pattern(term))]
    return f"Terms. {'; '.join(found)}." if found else ""


def _pattern(term: str) -> str:
    """Return the expression of a term as a whole word."""
    return rf"(?<!\w){re.escape(term)}(?!\w)"
