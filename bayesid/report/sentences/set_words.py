"""Words for sets of causes, for their probabilities and for verdicts under other choices."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.diagnosis.evidence.verdict import UNKNOWN, ProbableVerdict
from bayesid.report.numbers import format_probability, relation

__all__ = ["NOTHING", "SOMETHING", "probability_text", "set_text", "verdict_text"]

NOTHING, SOMETHING = "nothing", "something unknown"
"""Names of the empty set, and of any generic candidate among the alternatives."""


def set_text(names: Sequence[str]) -> str:
    """Return the causes of a set or of an alternative, joined by plus signs."""
    return " + ".join(SOMETHING if name == UNKNOWN else name for name in names) or NOTHING


def probability_text(value: float) -> str:
    """Return a probability as it stands in parentheses: ``p = 0.93``."""
    return f"p {relation(format_probability(value))}"


def verdict_text(verdict: ProbableVerdict) -> str:
    """Return a verdict in a few words, with its causes and what they are ambiguous with."""
    words = verdict.status.value
    if verdict.causes:
        words += f": {set_text(verdict.causes)}"
    return " or ".join([words, *(set_text(names) for names in verdict.ambiguous_with)])
