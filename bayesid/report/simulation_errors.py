"""Errors of the simulation in the units of the sensors, before and after, and where they are largest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import by_recording
from bayesid.simulation.sensors import SensorKind

__all__ = ["SimulationError", "simulation_errors", "strongest_recording"]


class SimulationError(NamedTuple):
    """Root mean square, over time, of the length of measured minus simulated of one sensor, in its unit.

    The residuals are those that were freed of their correlation, times the noise per sample.

    Attributes
    ----------
    kind : SensorKind
    before, after : float
        After is that of before where no cause is named.
    noise : float
        What the declared noise alone makes of it.
    """

    kind: SensorKind
    before: float
    after: float
    noise: float


def simulation_errors(result: Diagnosis) -> list[SimulationError]:
    """Return the errors of every sensor over all recordings."""
    before, after = result.before.fit.posterior, result.after.fit.posterior
    found = []
    for kind in before.model.channels.kinds:
        names = before.model.channels.names[before.model.channels.of(kind)]
        sigma = _sigma(before, kind)
        found.append(
            SimulationError(
                kind,
                _length([result.gain.before.rms.get(name, 0.0) for name in names], sigma),
                _length([result.gain.after.rms.get(name, 0.0) for name in names], _sigma(after, kind)),
                float(np.linalg.norm(sigma)),
            )
        )
    return found


def _length(rms: list[float], sigma: Floats) -> float:
    """Length of a vector whose components are given in standard deviations."""
    return float(np.linalg.norm(np.array(rms) * sigma))


def strongest_recording(result: Diagnosis) -> int:
    """Return the recording whose chi-square decreases most, or is largest where no cause is named."""
    before, after = _chi2(result.before.fit.residual, result), _chi2(result.after.fit.residual, result)
    return int(np.argmax(before - after if result.verdict.causes else before))


def _chi2(residual: Floats, result: Diagnosis) -> Floats:
    """Chi-square of each recording, shape (R,)."""
    return np.asarray((by_recording(result.before.fit.posterior, residual) ** 2).sum(axis=1))


def _sigma(posterior: Posterior, kind: SensorKind) -> Floats:
    """Root mean square over the recordings of the noise per sample of each axis."""
    widths = [posterior.data.sigma(index, kind) for index in range(len(posterior.manoeuvres))]
    return np.sqrt(np.mean(np.square(widths), axis=0))
