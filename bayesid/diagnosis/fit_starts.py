"""Where to start the fit of an effect: vibrations from the frequencies at which the residual asks for them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.omnibus_tests import MODAL, PAIRS
from bayesid.diagnosis.perturbed_fit import Fit
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.instant import Resonance

if TYPE_CHECKING:
    from bayesid.diagnosis.test_suite import TestSuite

__all__ = ["start_coordinates", "starts_of"]

RIDGE = 1.0
"""Prior information on the entries of the coupling matrix, at its scale."""


def start_coordinates(effect: Effect, recordings: int) -> Floats:
    """Return the first of the effect's starts, flat: once, or for each recording where each has values of its own."""
    return np.tile(effect.starts[0], recordings if effect.per_recording else 1)


def starts_of(effect: Effect, fit: Fit, suite: TestSuite) -> Sequence[Floats]:
    """Return the coordinates to start a fit from."""
    if not effect.modes_count:
        return effect.starts
    return effect.starts_near(_resonances(fit, suite), alone=not fit.effects)


def _resonances(fit: Fit, suite: TestSuite) -> list[Resonance]:
    """Return what the residual asks for at each frequency of the suite, the most wanted first."""
    ranked = []
    for frequency, columns in suite.vibrations.items():
        gradient = columns.T @ fit.residual
        entries = np.linalg.solve(fit.project(columns) + RIDGE * np.eye(len(PAIRS)), gradient)
        coupling = np.zeros((6, 6))
        for value, (i, j) in zip(entries, PAIRS, strict=True):
            coupling[i, j] = coupling[j, i] = MODAL**2 * value
        ranked.append((float(gradient @ entries), Resonance(frequency, coupling)))
    ranked.sort(key=lambda item: -item[0])
    return [resonance for _, resonance in ranked]
