"""Causes that the recordings can hardly tell from those that a verdict names."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.report.class_probabilities import alternatives, class_of

__all__ = ["CausePair", "cause_cosines", "inseparable_pairs"]

MOST_PROBABLE = 3
"""Causes that are compared with all others where the verdict names none."""


class CausePair(NamedTuple):
    """Two causes and how well they imitate each other.

    Attributes
    ----------
    first, second : str
    largest, smallest : float
        Largest and smallest canonical correlation of their signals, apart from what the model's unknowns explain. Where
        the smallest is one, too, the recordings cannot tell the two apart, whatever the noise.
    equivalent : bool
        Whether they are one class.
    """

    first: str
    second: str
    largest: float
    smallest: float
    equivalent: bool


def cause_cosines(result: Diagnosis, first: str, second: str) -> tuple[float, float]:
    """Return the largest and the smallest canonical correlation of two causes, each in its most probable form."""
    evidence = result.evidence
    groups = {}
    for name in (first, second):
        form = evidence.forms([name])[name]
        groups[name] = np.concatenate(
            [evidence.gram.groups[group.name] for group in evidence.causes[name].variants[form].groups]
        )
    found = Gram(evidence.gram.matrix, evidence.gram.score, groups).cosines(first, second)
    return (float(found[0]), float(found[-1])) if len(found) else (0.0, 0.0)


def inseparable_pairs(result: Diagnosis, most: int) -> list[CausePair]:
    """Return the pairs of a named cause, or of the most probable ones, with another that imitate each other best.

    Equivalents come first, then the pairs with the largest smallest correlation.
    """
    named = [name for names in alternatives(result) for name in names if name in result.evidence.catalogue]
    inclusion = result.probabilities.inclusion
    catalogue = [name for name in result.evidence.catalogue if name not in result.evidence.invisible]
    if not named:
        named = sorted(catalogue, key=lambda name: -inclusion[name])[:MOST_PROBABLE]
    pairs, seen = [], set()
    for first in dict.fromkeys(named):
        for second in catalogue:
            key = frozenset((first, second))
            if second == first or key in seen:
                continue
            seen.add(key)
            equivalent = second in class_of(result, first)
            pairs.append(CausePair(first, second, *cause_cosines(result, first, second), equivalent))
    pairs.sort(key=lambda pair: (not pair.equivalent, -pair.smallest, -pair.largest, pair.first, pair.second))
    return pairs[:most]
