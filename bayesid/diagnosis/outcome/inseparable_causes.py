"""Causes that the recordings can hardly tell apart, by the canonical correlations of their signatures."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.set_evidence import SetEvidence

__all__ = ["CausePair", "cause_cosines", "inseparable_pairs"]

MOST_PROBABLE = 3  # causes that are compared with all others where the verdict names none


@dataclass(frozen=True)
class CausePair:
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

    def to_dict(self) -> dict[str, Any]:
        """Return the pair in the form that it has in JSON."""
        return {
            "causes": [self.first, self.second],
            "largest_cosine": self.largest,
            "smallest_cosine": self.smallest,
            "equivalent": self.equivalent,
        }


def cause_cosines(evidence: SetEvidence, first: str, second: str) -> tuple[float, float]:
    """Return the largest and the smallest canonical correlation of two causes, each in its most probable form.

    Parameters
    ----------
    evidence : SetEvidence
    first, second : str
    """
    groups = {}
    for name in (first, second):
        form = evidence.forms([name])[name]
        groups[name] = np.concatenate(
            [evidence.gram.groups[group.name] for group in evidence.causes[name].variants[form].groups]
        )
    cosines = Gram(evidence.gram.matrix, evidence.gram.score, groups).cosines(first, second)
    return (float(cosines[0]), float(cosines[-1])) if len(cosines) else (0.0, 0.0)


def inseparable_pairs(
    evidence: SetEvidence,
    named: Sequence[str],
    inclusion: Mapping[str, float],
    classes: Sequence[Collection[str]],
) -> tuple[CausePair, ...]:
    """Return the pairs of a named cause, or of the most probable ones, with every other, the closest first.

    Equivalents come first, then the pairs with the largest smallest correlation.

    Parameters
    ----------
    evidence : SetEvidence
    named : sequence of str
        Causes that the verdict names in any of its alternatives.
    inclusion : mapping of str to float
        Probability of each cause.
    classes : sequence of collection of str
        Classes of equivalent causes.
    """
    named = [name for name in named if name in evidence.catalogue]
    catalogue = [name for name in evidence.catalogue if name not in evidence.invisible]
    if not named:
        named = sorted(catalogue, key=lambda name: -inclusion[name])[:MOST_PROBABLE]
    pairs: dict[frozenset[str], CausePair] = {}
    for first in dict.fromkeys(named):
        for second in catalogue:
            key = frozenset((first, second))
            if second != first and key not in pairs:
                equivalent = any(first in members and second in members for members in classes)
                pairs[key] = CausePair(first, second, *cause_cosines(evidence, first, second), equivalent)
    return tuple(
        sorted(
            pairs.values(),
            key=lambda pair: (not pair.equivalent, -pair.smallest, -pair.largest, pair.first, pair.second),
        )
    )
