"""A burst is looked for only where a sensor has as many samples as a burst lasts."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from bayesid.diagnosis.candidates.generic_cause import LENGTH, STRONGEST, burst_signatures
from bayesid.simulation.sensors import SensorKind

TIMES, CHANNELS = 30, 6


def bank_of(rates: int, accelerations: int):
    """The bank where so many of the samples hold an output of each sensor, and the residual is one everywhere."""
    outputs = np.zeros((TIMES, CHANNELS), dtype=bool)
    outputs[: 2 * rates : 2, :3] = True
    outputs[: 2 * accelerations : 2, 3:] = True
    columns = {SensorKind.RATE: slice(0, 3), SensorKind.ACCEL: slice(3, 6)}
    channels = SimpleNamespace(kinds=tuple(columns), of=columns.get)
    posterior = SimpleNamespace(
        model=SimpleNamespace(channels=channels),
        residual_shape=(1, TIMES, CHANNELS),
        whitenings=[SimpleNamespace(outputs=outputs)],
    )
    fit = SimpleNamespace(residual=outputs.astype(float).ravel())
    return burst_signatures(SimpleNamespace(posterior=posterior), fit)


def test_a_sensor_with_fewer_samples_than_a_burst_has_none():
    names = [cause.name for cause in bank_of(12, LENGTH - 3).causes]
    assert names == ["burst of rate"]


def test_places_hold_as_many_samples_as_a_burst_lasts_and_do_not_overlap():
    bank = bank_of(12, LENGTH)
    assert [cause.name for cause in bank.causes] == ["burst of rate", "burst of accel"]
    seen = [np.flatnonzero(item.columns.any(axis=1)) for item in bank.signatures]
    assert len(seen) == 12 // LENGTH + 1 <= STRONGEST
    assert all(len(rows) == 3 * LENGTH for rows in seen)
    assert len(np.unique(np.concatenate(seen))) == 3 * LENGTH * len(seen)
