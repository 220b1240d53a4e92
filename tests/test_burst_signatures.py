"""Bursts: where a sensor has enough samples for one, and as long as the residual shows."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.diagnosis.candidates.generic_cause import LENGTH, STRONGEST, burst_signatures
from bayesid.simulation.sensors import SensorKind

TIMES, CHANNELS = 30, 6


def outputs_of(rates: int, accelerations: int):
    """Which samples hold an output, where so many hold one of each sensor."""
    outputs = np.zeros((TIMES, CHANNELS), dtype=bool)
    outputs[: 2 * rates : 2, :3] = True
    outputs[: 2 * accelerations : 2, 3:] = True
    return outputs


def bank_of(outputs, residual):
    """The bank of one recording with some outputs (T, 6) and their residual."""
    columns = {SensorKind.RATE: slice(0, 3), SensorKind.ACCEL: slice(3, 6)}
    channels = SimpleNamespace(kinds=tuple(columns), of=columns.get)
    posterior = SimpleNamespace(
        model=SimpleNamespace(channels=channels),
        residual_shape=(1, *outputs.shape),
        whitenings=[SimpleNamespace(outputs=outputs)],
    )
    fit = SimpleNamespace(residual=residual.ravel())
    return burst_signatures(SimpleNamespace(posterior=posterior), fit)


def test_a_sensor_with_fewer_samples_than_a_burst_has_none():
    outputs = outputs_of(12, LENGTH - 3)
    names = [cause.name for cause in bank_of(outputs, outputs.astype(float)).causes]
    assert names == ["burst of rate"]


def test_places_hold_as_many_samples_as_a_burst_lasts_and_do_not_overlap():
    outputs = outputs_of(12, LENGTH)
    bank = bank_of(outputs, outputs.astype(float))
    assert [cause.name for cause in bank.causes] == ["burst of rate", "burst of accel"]
    seen = [np.flatnonzero(item.columns.any(axis=1)) for item in bank.signatures]
    assert len(seen) == 12 // LENGTH + 1 <= STRONGEST
    assert all(len(rows) == 3 * LENGTH for rows in seen)
    assert len(np.unique(np.concatenate(seen))) == 3 * LENGTH * len(seen)


@pytest.mark.parametrize(("samples", "step"), [(5, 1), (20, 4)])
def test_a_burst_is_as_long_as_the_residual_shows(samples, step):
    """A thousand samples of white noise, and errors of one size in all in five steps of one or of four samples."""
    residual = np.random.default_rng(4).normal(size=(1000, CHANNELS))
    signs = np.repeat([1.0, -1.0, 1.0, 1.0, -1.0], step)
    residual[400 : 400 + samples, :3] += 6.0 / np.sqrt(step) * signs[:, None]
    bank = bank_of(np.ones((1000, CHANNELS), dtype=bool), residual)
    (place,) = [item for item in bank.signatures if item.name == "burst of rate, place 1"]
    strongest = place.columns.reshape(1000, CHANNELS, LENGTH, 3)
    rows = np.flatnonzero(strongest.any(axis=(1, 2, 3)))
    np.testing.assert_array_equal(rows, np.arange(400, 400 + samples))
    assert strongest.sum(axis=(0, 1)).tolist() == [[step] * 3] * LENGTH
    assert not strongest[:, 3:].any()
