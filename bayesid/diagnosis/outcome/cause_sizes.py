"""Sizes of causes: magnitude and direction of a cause that is a vector, and each scale beside its physical bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis.evidence.cause_sets import CauseSet
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.evidence.scales import AmplitudeGroup
from bayesid.diagnosis.outcome.candidate_table import Candidate, reported_normal
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.diagnosis.search.relinearise import SetSearch
from bayesid.simulation.effects.effect_parameters import PhysicalBound

__all__ = ["Z95", "GroupSize", "VectorSize", "group_sizes", "vector_size"]

Z95 = float(stats.norm.ppf(0.975))
"""Standard deviations to either side that hold 95 % of a normal distribution."""

CIRCLE95 = float(np.sqrt(stats.chi2.ppf(0.95, 2)))  # the same to all sides in a plane

SEEN = 3.0  # standard deviations that a magnitude must be from zero for its direction to be known
SAME = 1e-9  # relative difference up to which the bound of a group of amplitudes is that of a unit


@dataclass(frozen=True)
class VectorSize:
    """Magnitude and direction of a vector.

    Attributes
    ----------
    unit : str
    vector : (3,) array
        Mean.
    magnitude, sd : float
        Length of the mean, and standard deviation along it.
    angle : float
        Half the angle of a cone about the direction that holds it with at least 95 % [rad], to first order.
    """

    unit: str
    vector: Floats
    magnitude: float
    sd: float
    angle: float

    @classmethod
    def of_normal(cls, unit: str, mean: Floats, covariance: Floats) -> VectorSize:
        """Return the size of a vector with a normal distribution.

        Parameters
        ----------
        unit : str
        mean : (3,) array
        covariance : (3, 3) array
        """
        magnitude = float(np.linalg.norm(mean))
        if magnitude == 0.0:
            return cls(unit, mean, 0.0, float(np.sqrt(np.trace(covariance))), np.pi)
        along = mean / magnitude
        across = np.eye(3) - np.outer(along, along)
        widest = max(float(np.linalg.eigvalsh(across @ covariance @ across)[-1]), 0.0)
        sd = float(np.sqrt(max(float(along @ covariance @ along), 0.0)))
        return cls(unit, mean, magnitude, sd, CIRCLE95 * float(np.sqrt(widest)) / magnitude)

    @property
    def directed(self) -> bool:
        """Whether the magnitude is far enough from zero for a direction."""
        return self.magnitude > SEEN * self.sd and self.angle < 0.5 * np.pi

    @property
    def direction(self) -> Floats:
        """Unit vector along the mean, shape (3,)."""
        return self.vector / self.magnitude

    def to_dict(self) -> dict[str, Any]:
        """Return magnitude, and direction where it is known, in the form that they have in JSON."""
        size = {"magnitude": self.magnitude, "sd": self.sd, "unit": self.unit}
        if not self.directed:
            return {**size, "direction": None, "cone_95": None}
        return {**size, "direction": self.direction.tolist(), "cone_95": self.angle}


def vector_size(hypothesis: Hypothesis, label: str) -> VectorSize | None:
    """Return magnitude and direction of the first vector among the quantities of an effect; None if it has none.

    A vector is three quantities in a row that share a unit and end in x, y and z. Of an effect with values for each
    recording, the first recording's stand for all.

    Parameters
    ----------
    hypothesis : Hypothesis
    label : str
        Name of the cause.
    """
    effects = hypothesis.fit.effects
    index = next((place for place, effect in enumerate(effects) if effect.candidate == label), None)
    if index is None:
        return None
    effect = effects[index]
    start = _first_vector([(quantity.name, quantity.unit) for quantity in effect.quantities])
    if start is None:
        return None
    vector = slice(start, start + 3)
    mean, covariance = reported_normal(hypothesis, index)
    return VectorSize.of_normal(effect.quantities[start].unit, mean[vector], covariance[vector, vector])


def _first_vector(quantities: Sequence[tuple[str, str]]) -> int | None:
    for start in range(len(quantities) - 2):
        three = quantities[start : start + 3]
        stems = {name[:-1] for name, _ in three}
        if [name[-1:] for name, _ in three] == ["x", "y", "z"] and len({unit for _, unit in three}) == len(stems) == 1:
            return start
    return None


@dataclass(frozen=True)
class GroupSize:
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

    def to_dict(self) -> dict[str, Any]:
        """Return the size in the form that it has in JSON."""
        return {"cause": self.cause, "size": self.size, "unit": self.unit, "bound": self.largest, "share": self.share}


def group_sizes(
    cause_set: CauseSet,
    search: SetSearch,
    bounds: Mapping[str, Sequence[PhysicalBound]],
    candidates: Sequence[Candidate],
) -> list[GroupSize]:
    """Return the sizes of all causes of a set, at its most probable forms and scales, by cause and group.

    Parameters
    ----------
    cause_set : CauseSet
    search : SetSearch
        Under the noise of the set.
    bounds : mapping of str to sequence of PhysicalBound
        Bounds of each cause, for their units.
    candidates : sequence of Candidate
        All candidates, for the units of those without stated bounds.
    """
    evidence = search.point.evidence
    ordered = sorted(name for name in cause_set.names if name in evidence.causes)
    sizes = [_of_fault(fault.label, fault.mean[0], fault.quantities[0]) for fault in search.noise.faults]
    rest = [
        GroupSize(name) for name in cause_set.names if name not in evidence.causes and name not in search.noise.names
    ]
    if not ordered:
        return sizes + rest
    forms = evidence.forms(ordered)
    columns, deviations = evidence.most_probable(ordered, forms)
    block = GaussianBlock.of(evidence.gram.matrix[np.ix_(columns, columns)], deviations)
    mean = block.mean(evidence.score_beside(ordered)[columns])
    amplitude = dict(zip(columns.tolist(), mean.tolist(), strict=True))
    for name in ordered:
        cause = evidence.causes[name]
        if cause.fixed:
            sizes.append(GroupSize(name))
            continue
        for group in cause.variants[forms[name]].groups:
            places = group.columns(evidence.gram).tolist()
            values = np.array([amplitude[place] for place in places]) / group.roots(evidence.gram)
            unit = _unit_of(name, group, bounds, candidates)
            sizes.append(GroupSize(name, float(np.sqrt(np.mean(values**2))), unit, group.high))
    return sizes + rest


def _of_fault(label: str, mean: float, quantity: tuple[str, str]) -> GroupSize:
    name, unit = quantity
    return GroupSize(label, float(mean), name if unit == "1" else unit)


def _unit_of(
    name: str,
    group: AmplitudeGroup,
    bounds: Mapping[str, Sequence[PhysicalBound]],
    candidates: Sequence[Candidate],
) -> str | None:
    """Return the unit of the bound that a group has, or of all quantities of a candidate without stated bounds."""
    for bound in bounds.get(name, ()):
        if abs(bound.largest - group.high) <= SAME * group.high:
            return bound.unit
    units = {quantity.unit for row in candidates if row.name == name for quantity in row.quantities}
    return units.pop() if len(units) == 1 and name not in bounds else None
