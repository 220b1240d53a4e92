"""Terms of the field that reports use without explaining them where they stand."""

from __future__ import annotations

import re

from bayesid.report import Document

__all__ = ["TERMS", "add_glossary"]

TERMS = {
    "a-optimal": "the manoeuvre with the smallest sum of variances, each relative to its prior",
    "arm exact": "the links' inertial parameters are taken as known",
    "chi-square": "the sum of squared residuals in standard deviations, one per sample where the model is right",
    "condition number": "largest over smallest singular value of the identification's columns",
    "d-optimal": "the manoeuvre with the smallest determinant of the posterior covariance",
    "e-optimal": "the manoeuvre with the smallest variance in the worst direction",
    "(26)": "the paper's criterion, the smallest singular value of its identification matrix",
    "effective samples": "independent samples that would give a mean of the same error",
    "emcee": "the package of ensemble samplers that draws the posterior",
    "family-wise": "the probability of any false rejection among all tests together",
    "importance sampling": "draws from the Laplace approximation, weighted to the posterior",
    "Laplace": "the normal distribution at the posterior's mode with its curvature",
    "ln B": "the logarithm of the Bayes factor, the ratio of two models' evidences",
    "NUTS": "the no-U-turn sampler, Hamiltonian Monte Carlo",
    "rank": "the place of the truth among posterior draws, uniform where the posterior is right",
    "sd": "standard deviation",
    "rms": "root mean square",
}
"""Meanings by term, as reports write it."""


def add_glossary(document: Document) -> None:
    """Add the meanings of the terms that a document holds, in one paragraph at its end."""
    found = [f"{term}, {meaning}" for term, meaning in TERMS.items() if document.mentions(_pattern(term))]
    if found:
        document.paragraph(f"Terms: {'; '.join(found)}.")


def _pattern(term: str) -> str:
    """Return the expression of a term as a whole word."""
    return rf"(?<!\w){re.escape(term)}(?!\w)"
