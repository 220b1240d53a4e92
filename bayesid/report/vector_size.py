"""Magnitude and direction of a cause that is a vector, with 95 %."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Hypothesis
from bayesid.diagnosis.response.effect_functions import report_of, report_slopes

__all__ = ["Z95", "VectorSize", "vector_size"]

Z95 = float(stats.norm.ppf(0.975))
"""Standard deviations to either side that hold 95 % of a normal distribution."""

CIRCLE95 = float(np.sqrt(stats.chi2.ppf(0.95, 2)))
"""Standard deviations to all sides that hold 95 % of a normal distribution in a plane."""

SEEN = 3.0
"""Standard deviations that a magnitude must be from zero for its direction to be known."""


class VectorSize(NamedTuple):
    """Magnitude and direction of a vector.

    Attributes
    ----------
    axes : tuple of str
        Names of its three quantities.
    unit : str
    vector : (3,) array
        Mean.
    magnitude, sd : float
        Length of the mean, and standard deviation along it.
    angle : float
        Half the angle of a cone about the direction that holds it with at least 95 % [rad], to first order.
    """

    axes: tuple[str, ...]
    unit: str
    vector: Floats
    magnitude: float
    sd: float
    angle: float

    @property
    def directed(self) -> bool:
        """Whether the magnitude is far enough from zero for a direction."""
        return self.magnitude > SEEN * self.sd and self.angle < 0.5 * np.pi

    @property
    def direction(self) -> Floats:
        """Unit vector along the mean, shape (3,)."""
        return self.vector / self.magnitude


def vector_size(hypothesis: Hypothesis, label: str) -> VectorSize | None:
    """Return magnitude and direction of the first vector among the quantities of an effect; None if it has none.

    A vector is three quantities in a row that share a unit and end in x, y and z. Of an effect with values for each
    recording, the first recording's stand for all.
    """
    fit = hypothesis.fit
    index = next((place for place, effect in enumerate(fit.effects) if effect.candidate == label), None)
    if index is None:
        return None
    effect = fit.effects[index]
    start = _first_vector([(quantity.name, quantity.unit) for quantity in effect.quantities])
    if start is None:
        return None
    count = len(effect.parameters)
    point = fit.coordinates[index][:count]
    first = fit.own.shape[1] + sum(columns.shape[1] for columns in fit.added[:index])
    covariance = fit.covariance[first : first + count, first : first + count]
    slope, mean = (found[start : start + 3] for found in (report_slopes(effect, point), report_of(effect, point)))
    names = tuple(quantity.name for quantity in effect.quantities[start : start + 3])
    return of_normal(names, effect.quantities[start].unit, mean, slope @ covariance @ slope.T)


def of_normal(axes: tuple[str, ...], unit: str, mean: Floats, covariance: Floats) -> VectorSize:
    """Return the size of a vector with a normal distribution of mean (3,) and covariance (3, 3)."""
    magnitude = float(np.linalg.norm(mean))
    if magnitude == 0.0:
        return VectorSize(axes, unit, mean, 0.0, float(np.sqrt(np.trace(covariance))), np.pi)
    along = mean / magnitude
    across = np.eye(3) - np.outer(along, along)
    widest = float(np.linalg.eigvalsh(across @ covariance @ across)[-1])
    return VectorSize(
        axes,
        unit,
        mean,
        magnitude,
        float(np.sqrt(max(float(along @ covariance @ along), 0.0))),
        CIRCLE95 * float(np.sqrt(max(widest, 0.0))) / magnitude,
    )


def _first_vector(quantities: list[tuple[str, str]]) -> int | None:
    for start in range(len(quantities) - 2):
        three = quantities[start : start + 3]
        stems = {name[:-1] for name, _ in three}
        if [name[-1:] for name, _ in three] == ["x", "y", "z"] and len({unit for _, unit in three}) == len(stems) == 1:
            return start
    return None
