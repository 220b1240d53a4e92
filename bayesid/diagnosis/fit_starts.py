"""Where to start the fit of an effect: vibrations from the frequencies at which the residual asks for them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import erfinv

from bayesid._math.arrays import Floats
from bayesid.diagnosis.omnibus_tests import LIGHT, MODAL, PAIRS
from bayesid.diagnosis.perturbed_fit import Engine, Fit
from bayesid.diagnosis.test_suite import TestSuite
from bayesid.simulation.effects.effect import Effect, Parameter, Prior
from bayesid.simulation.effects.internal_effects import FlexibleAppendage, FuelSlosh

__all__ = ["starts_of"]

BEST = 2
"""Frequencies tried."""

TANK = (0.06, 0.25)
"""Frequencies that the fit of slosh starts from [Hz]."""

SLOSHING = 5.0
"""And its mass [kg]."""

APART, CORNERS = 0.4, np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""And how far from the middle of the spacecraft its tank may be, along axes [m]."""

RIDGE = 1.0
"""Prior information on the entries of the coupling matrix, at its scale."""


def starts_of(effect: Effect, engine: Engine, fit: Fit, suite: TestSuite) -> Sequence[Floats]:
    """Coordinates to start a fit from."""
    if not isinstance(effect, FlexibleAppendage | FuelSlosh):
        return effect.starts
    ranked = []
    for frequency, columns in suite.vibrations.items():
        gram = fit.project(columns)
        gradient = columns.T @ fit.residual
        entries = -np.linalg.solve(gram + RIDGE * np.eye(21), gradient)
        ranked.append((float(-gradient @ entries), frequency, entries))
    ranked.sort(key=lambda item: -item[0])
    chosen: list[Floats] = []
    for _, frequency, entries in ranked[:BEST]:
        matrix = np.zeros((6, 6))
        for value, (i, j) in zip(entries, PAIRS, strict=True):
            matrix[i, j] = matrix[j, i] = MODAL**2 * value
        if isinstance(effect, FlexibleAppendage):
            chosen.append(_appendage(effect, frequency, matrix))
    if isinstance(effect, FuelSlosh):  # the fit converges from afar
        middle = np.array([parameter.mean for parameter in effect.parameters[3:]])
        places = [(frequency, middle) for frequency in TANK]
        if not fit.effects:  # the place may have several optima
            places += [(ranked[0][1], middle + APART * corner) for corner in CORNERS]
        chosen = [_coordinates(effect.parameters, [SLOSHING, frequency, LIGHT, *place]) for frequency, place in places]
    return chosen


def _appendage(effect: FlexibleAppendage, frequency: float, matrix: Floats) -> Floats:
    """One mode: the largest eigenvector of the coupling matrix, with the sign that a mode has."""
    values, vectors = np.linalg.eigh(-matrix)
    coupling = vectors[:, -1] * np.sqrt(max(values[-1], 0.1))
    return _coordinates(effect.parameters, [frequency, LIGHT, *coupling])


def _coordinates(parameters: Sequence[Parameter], values: Sequence[float]) -> Floats:
    """Coordinates with a standard-normal prior of physical values; what lies outside a range is moved into it."""
    found = []
    for parameter, value in zip(parameters, values, strict=True):
        if parameter.prior is Prior.LOG_NORMAL:
            found.append(np.log(value / parameter.mean) / parameter.sigma)
        elif parameter.prior is Prior.UNIFORM:
            inside = np.clip((value - parameter.mean) / parameter.sigma, -0.8, 0.8)
            found.append(float(np.sqrt(2.0) * erfinv(inside)))
        else:
            found.append((value - parameter.mean) / parameter.sigma)
    return np.array(found)
