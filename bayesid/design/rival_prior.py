"""Prior of size and direction of a rival effect, the one by which a diagnosis weighs the cause.

The amplitudes of one unit are normal, ``a ~ N(0, tau^2)`` in units of the largest plausible size, and their common
scale ``tau`` is log-uniform between a floor that no manoeuvre resolves and one (`bayesid.diagnosis.evidence.scales`).
A payload is weighed with first and second moments for one of three distances from the link's origin. The prior does
not depend on the manoeuvre, so that manoeuvres are compared under the same one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.design.plan import Plan
from bayesid.simulation.effects.effect import Effect, bounds_by_label

__all__ = ["MOMENT_REACHES", "RivalPrior", "ScaleGrid", "effect_of", "relative_floors"]

UNRESOLVED = 0.01
"""Square of a signal-to-noise ratio below which the data do not resolve an amplitude, as in a diagnosis."""

MOMENT_REACHES = (1.0, 0.25, 0.0625)
"""Distances of a missing body from the origin of its link, relative to the longest, as in a diagnosis."""

POWERS = {"kg": 0.0, "kg m": 1.0, "kg m2": 2.0}  # of the distance, in the moments of a body

PER_DECADE = 4.0  # nodes per decade of a scale; the log evidence is then within some hundredths of the exact one


class ScaleGrid(NamedTuple):
    """Nodes for averages over the scales of a rival.

    Attributes
    ----------
    deviations : (t, k) array
        Standard deviations of the amplitudes, relative to their largest plausible sizes.
    log_weights : (t,) array
        Logarithms of the prior probabilities of the nodes.
    """

    deviations: Floats
    log_weights: Floats


@dataclass(frozen=True)
class RivalPrior:
    """Prior of the k amplitudes of a rival, in units of their largest plausible sizes.

    Attributes
    ----------
    spreads : (F, k) array
        Standard deviations at the largest scale, for each of F equally probable forms.
    scale_of : (k,) array of int
        Scale that each amplitude shares with those of its unit.
    floors : (F, S) array
        Smallest values of the S scales, relative to the largest.
    """

    spreads: Floats
    scale_of: Integers
    floors: Floats

    @classmethod
    def of(cls, effect: Effect, floors: Sequence[Sequence[float]] | None = None) -> RivalPrior:
        """Return the prior of an effect, with scales that are not yet bounded below where no floors are given."""
        units = [quantity.unit for quantity in effect.amplitude_quantities]
        is_body = effect.amplitude_units == tuple(POWERS)
        scale_of = np.zeros(len(units), dtype=int)
        spreads = np.array(effect.amplitude_shapes)
        if is_body:
            spreads = np.array([[reach ** POWERS[unit] for unit in units] for reach in MOMENT_REACHES])
        else:
            scale_of = np.array([effect.amplitude_units.index(unit) for unit in units])
        shape = len(spreads), int(scale_of.max()) + 1
        return cls(spreads, scale_of, np.ones(shape) if floors is None else np.array(floors))

    @cached_property
    def grid(self) -> ScaleGrid:
        """Nodes of the trapezoidal rule in the logarithms of all scales, over all forms."""
        deviations, log_weights = [], []
        for spread, floors in zip(self.spreads, self.floors, strict=True):
            axes = [_nodes(floor) for floor in floors]
            scales = np.array(list(product(*(scales for scales, _ in axes))))
            weights = np.array(list(product(*(weights for _, weights in axes))))
            deviations.append(scales[:, self.scale_of] * spread)
            log_weights.append(np.log(weights).sum(axis=1) - np.log(len(self.spreads)))
        return ScaleGrid(np.concatenate(deviations), np.concatenate(log_weights))

    @property
    def dimensions(self) -> int:
        """Number of uniform numbers from which `amplitudes` makes one draw."""
        return 1 + self.floors.shape[1] + len(self.scale_of)

    def amplitudes(self, uniform: Floats) -> Floats:
        """Return draws (d, k) of the amplitudes from uniform numbers, shape (d, `dimensions`)."""
        form = np.minimum((uniform[:, 0] * len(self.spreads)).astype(int), len(self.spreads) - 1)
        count = self.floors.shape[1]
        scales = self.floors[form] ** uniform[:, 1 : 1 + count]
        return scales[:, self.scale_of] * self.spreads[form] * ndtri(uniform[:, 1 + count :])


def _nodes(floor: float) -> tuple[Floats, Floats]:
    """Return nodes of a log-uniform scale between a floor and one, with their weights."""
    if floor >= 1.0:
        return np.ones(1), np.ones(1)
    count = int(np.ceil(-PER_DECADE * np.log10(floor))) + 2
    weights = np.full(count, 1.0 / (count - 1))
    weights[[0, -1]] *= 0.5
    return np.geomspace(floor, 1.0, count), weights


def relative_floors(prior: RivalPrior, information: Floats) -> Floats:
    """Return the smallest scales worth considering, (F, S): those at which the data do not resolve any direction.

    Parameters
    ----------
    prior : RivalPrior
    information : (k, k) array
        Information about the amplitudes, in units of their largest plausible sizes.
    """
    floors = np.ones_like(prior.floors)
    for form, spread in enumerate(prior.spreads):
        for scale in range(floors.shape[1]):
            columns = np.flatnonzero(prior.scale_of == scale)
            block = information[np.ix_(columns, columns)] * np.outer(spread[columns], spread[columns])
            largest = float(np.linalg.eigvalsh(block)[-1])
            floors[form, scale] = min(1.0, np.sqrt(UNRESOLVED / largest)) if largest > 0.0 else 1.0
    return floors


def effect_of(plan: Plan, label: str) -> tuple[Effect, Floats]:
    """Return a rival with the largest plausible sizes of its amplitudes, shape (k,).

    Raises
    ------
    InputError
        If the model of the plan lacks it, or nothing says how large it may be.
    """
    effect = next((effect for effect in plan.model.effects if effect.label == label), None)
    if effect is None or not effect.parameters:
        problem = f"the model has no effect {label!r}" if effect is None else f"effect {label!r} has no parameters"
        raise InputError(problem, place="design.rivals", remedy="Extend the model by the rivals")
    stated = {label: plan.bounds[label]} if label in plan.bounds else None
    sizes = {bound.unit: bound.largest for bound in bounds_by_label([effect], plan.model, stated)[label]}
    return effect, np.array([sizes[quantity.unit] for quantity in effect.amplitude_quantities])
