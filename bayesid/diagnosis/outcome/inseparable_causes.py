"""Causes that the recordings can hardly tell apart, by the canonical correlations of their signatures."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import norm

from bayesid._math.arrays import Integers
from bayesid.diagnosis.evidence.gram import Gram, independent_directions
from bayesid.diagnosis.evidence.set_evidence import SetEvidence

__all__ = ["CausePair", "cause_cosines", "inseparable_pairs", "parting_ratio"]

DECIDED = 0.95  # share of right decisions where two causes part
NOTHING_LEFT = 1e-8  # share of the information that is rounding
CLOSEST = 10  # pairs of which it is computed where they part
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
    parting : float
        Signal-to-noise ratio from which either is told from the other in 95 % of all cases (`parting_ratio`).
    """

    first: str
    second: str
    largest: float
    smallest: float
    equivalent: bool
    parting: float = np.inf

    def to_dict(self) -> dict[str, Any]:
        """Return the pair in the form that it has in JSON."""
        return {
            "causes": [self.first, self.second],
            "largest_cosine": self.largest,
            "smallest_cosine": self.smallest,
            "equivalent": self.equivalent,
            "parting_signal_to_noise": self.parting if np.isfinite(self.parting) else None,
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


def parting_ratio(evidence: SetEvidence, first: str, second: str) -> float:
    """Return the signal-to-noise ratio from which two causes part, infinite where either imitates the other.

    Where the one is at work with a ratio ``s``, the other in the form that does best leaves ``d = s sqrt(1 - c^2)``, on
    average over its directions with the mean square ``c^2`` of the canonical correlations. The difference of their log
    likelihoods is normal about ``d^2 / 2`` with the deviation ``d``, so that it has the right sign in 95 % of all cases
    from ``d = 3.29`` on.

    Parameters
    ----------
    evidence : SetEvidence
    first, second : str
        Causes; each is taken in its most probable form where it is at work.
    """
    left = min(_left(evidence, first, second), _left(evidence, second, first))
    return float(2.0 * norm.ppf(DECIDED) / np.sqrt(left)) if left > NOTHING_LEFT else np.inf


def _left(evidence: SetEvidence, cause: str, rival: str) -> float:
    """Return the share of the information on a cause that its rival leaves in the form that imitates it best."""
    gram = evidence.gram
    columns = _columns(evidence, cause, evidence.forms([cause])[cause])
    directions = independent_directions(gram.matrix[np.ix_(columns, columns)])
    shares = [1.0]
    for form in range(len(evidence.causes[rival].variants)):
        others = _columns(evidence, rival, form)
        imitated = directions.T @ gram.matrix[np.ix_(columns, others)]
        imitated = imitated @ independent_directions(gram.matrix[np.ix_(others, others)])
        shares.append(1.0 - float((imitated**2).sum()) / max(directions.shape[1], 1))
    return min(shares)


def _columns(evidence: SetEvidence, cause: str, form: int) -> Integers:
    """Return the columns of a cause in one form."""
    groups = evidence.causes[cause].variants[form].groups
    return np.concatenate([group.columns(evidence.gram) for group in groups])


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
    ranked = sorted(
        pairs.values(), key=lambda pair: (not pair.equivalent, -pair.smallest, -pair.largest, pair.first, pair.second)
    )
    closest = [replace(pair, parting=parting_ratio(evidence, pair.first, pair.second)) for pair in ranked[:CLOSEST]]
    return (*closest, *ranked[CLOSEST:])
