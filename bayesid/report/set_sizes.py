"""Sizes of the causes of a set beside their physical bounds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid.diagnosis import CauseSet, Diagnosis
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.evidence.scales import AmplitudeGroup

__all__ = ["GroupSize", "set_sizes"]

SAME = 1e-9
"""Relative difference up to which the bound of a group of amplitudes is that of a unit."""


class GroupSize(NamedTuple):
    """Size of the amplitudes of a cause that share one scale.

    Attributes
    ----------
    cause : str
    size : float or None
        Root mean square of the amplitudes, each relative to its own width at a scale of one; of a fault of the noise
        its first quantity. None where physics fixes them, and of something without a form.
    unit : str or None
        Unit; None where the amplitudes have none in common.
    largest : float or None
        Bound of the scale; None of a fault of the noise, and where physics fixes the amplitudes.
    """

    cause: str
    size: float | None = None
    unit: str | None = None
    largest: float | None = None

    @property
    def share(self) -> float | None:
        """Size relative to its bound; None where it has none."""
        return None if self.size is None or self.largest is None else self.size / self.largest

    @property
    def plausible(self) -> bool:
        """Whether the size lies within its bound."""
        return self.share is None or self.share <= 1.0


def set_sizes(result: Diagnosis, item: CauseSet) -> list[GroupSize]:
    """Return the sizes of all causes of a set, at its most probable forms and scales, by cause and group."""
    state = result.weighed.state(item.causes)
    evidence = state.point.evidence
    ordered = sorted(name for name in item.names if name in evidence.causes)
    found = [_of_fault(fault.label, fault.mean[0], fault.quantities[0]) for fault in state.faults]
    rest = [GroupSize(name) for name in item.names if name not in evidence.causes and name not in state.names]
    if not ordered:
        return found + rest
    forms = evidence.forms(ordered)
    columns, deviations = evidence.most_probable(ordered, forms)
    block = GaussianBlock.of(evidence.gram.matrix[np.ix_(columns, columns)], deviations)
    mean = block.mean(evidence.score_beside(ordered)[columns])
    amplitude = dict(zip(columns.tolist(), mean.tolist(), strict=True))
    for name in ordered:
        cause = evidence.causes[name]
        if cause.fixed:
            found.append(GroupSize(name))
            continue
        for group in cause.variants[forms[name]].groups:
            own = group.columns(evidence.gram)
            values = np.array([amplitude[place] for place in own.tolist()]) / group.roots(evidence.gram)
            found.append(GroupSize(name, float(np.sqrt(np.mean(values**2))), _unit_of(result, name, group), group.high))
    return found + rest


def _of_fault(label: str, mean: float, quantity: tuple[str, str]) -> GroupSize:
    name, unit = quantity
    return GroupSize(label, float(mean), name if unit == "1" else unit)


def _unit_of(result: Diagnosis, name: str, group: AmplitudeGroup) -> str | None:
    """Return the unit of the bound that a group has, or of all quantities of a candidate without stated bounds."""
    for bound in result.bounds.get(name, ()):
        if abs(bound.largest - group.high) <= SAME * group.high:
            return bound.unit
    units = {quantity.unit for row in result.candidates if row.name == name for quantity in row.quantities}
    return units.pop() if len(units) == 1 and name not in result.bounds else None
