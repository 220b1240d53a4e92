"""Sizes of the causes of a set beside their physical bounds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.scale_prior import AmplitudeGroup
from bayesid.diagnosis.set_evidence import precision_roots
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["GroupSize", "set_sizes"]

SAME = 1e-9
"""Relative difference up to which the bound of a group of amplitudes is that of a unit."""


class GroupSize(NamedTuple):
    """Size of the amplitudes of a cause that share one scale.

    Attributes
    ----------
    cause : str
    size : float or None
        Root mean square of the amplitudes, each relative to its own width at a scale of one; None where physics fixes
        them.
    bound : PhysicalBound or None
        Bound of the scale with its unit; None where none is stated in one unit.
    share : float or None
        Size relative to the bound; None where physics fixes it.
    """

    cause: str
    size: float | None
    bound: PhysicalBound | None
    share: float | None

    @property
    def plausible(self) -> bool:
        """Whether the size lies within its bound."""
        return self.share is None or self.share <= 1.0


def set_sizes(result: Diagnosis, names: Sequence[str]) -> list[GroupSize]:
    """Return the sizes of all causes of a set, at its most probable forms and scales, by cause and group."""
    evidence = result.evidence
    ordered = sorted(names)
    if not ordered:
        return []
    forms = evidence.forms(ordered)
    columns, deviations = evidence.most_probable(ordered, forms)
    roots, _ = precision_roots(evidence.gram.matrix[np.ix_(columns, columns)], deviations[None])
    mean = -roots[0].T @ (roots[0] @ evidence.score_beside(ordered)[columns])
    amplitude = dict(zip(columns.tolist(), mean.tolist(), strict=True))
    found = []
    for name in ordered:
        cause = evidence.causes[name]
        if cause.fixed:
            found.append(GroupSize(name, None, None, None))
            continue
        for group in cause.variants[forms[name]].groups:
            own = evidence.gram.groups[group.name]
            values = np.array([amplitude[place] for place in own.tolist()]) / group.roots(len(own))
            size = float(np.sqrt(np.mean(values**2)))
            found.append(GroupSize(name, size, _bound_of(result, name, group), size / group.high))
    return found


def _bound_of(result: Diagnosis, name: str, group: AmplitudeGroup) -> PhysicalBound | None:
    bounds = result.bounds.get(name, ())
    return next((bound for bound in bounds if abs(bound.largest - group.high) <= SAME * group.high), None)
