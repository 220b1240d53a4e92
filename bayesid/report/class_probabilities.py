"""Probabilities of the causes and alternatives of a verdict, each cause with all its equivalents."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.evidence.cause_sets import CauseSet
from bayesid.diagnosis.evidence.verdict import UNKNOWN

__all__ = ["alternative_probability", "alternatives", "cause_probability", "class_of"]


def class_of(result: Diagnosis, cause: str) -> tuple[str, ...]:
    """Return the causes that change the model as one does, as far as the data can tell, itself among them."""
    return next((tuple(members) for members in result.classes if cause in members), (cause,))


def cause_probability(result: Diagnosis, cause: str) -> float:
    """Return the probability that a cause or one of its equivalents is at work, whatever accompanies it."""
    return result.probabilities.of_any(class_of(result, cause))


def alternatives(result: Diagnosis) -> tuple[tuple[str, ...], ...]:
    """Return the explanations that the verdict names, its own causes first; none where it names nothing."""
    verdict = result.verdict
    return (verdict.causes, *verdict.ambiguous_with) if verdict.causes else ()


def alternative_probability(result: Diagnosis, names: Sequence[str]) -> float:
    """Return the probability that all of some causes are at work, whatever accompanies them; of none, that of nothing.

    Parameters
    ----------
    result : Diagnosis
    names : sequence of str
        Causes, each of which stands for its class; ``unknown`` stands for any generic candidate.
    """
    if not names:
        return result.probabilities.nothing
    classes = [set(class_of(result, name)) for name in names if name != UNKNOWN]

    def holds(item: CauseSet) -> bool:
        known = all(not members.isdisjoint(item.causes) for members in classes)
        return known and (UNKNOWN not in names or item.generic is not None)

    return float(sum(item.probability for item in result.probabilities.sets if holds(item)))
