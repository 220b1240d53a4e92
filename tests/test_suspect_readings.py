"""Readings that were filled in, held or constant are found, and the recordings of all kinds of sensors hold none."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.recording.recording import Recording
from bayesid.recording.suspect_readings import Suspicion, suspect_readings

TIME = np.arange(0.0, 60.0, 0.1)
FILL = slice(200, 210)


def flown(seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    channels = {f"position.j{k}": 0.4 * np.sin(0.2 * (k + 1) * TIME + k) + 1e-6 * rng.normal(size=600) for k in (0, 1)}
    for family, sigma in (("rate", 1e-5), ("accel", 1e-5)):
        channels |= {f"{family}.{axis}": 1e-3 * np.sin(0.3 * TIME) + sigma * rng.normal(size=600) for axis in "xyz"}
    return channels


def suspects(channels: dict[str, np.ndarray]) -> list[tuple[Suspicion, str, int]]:
    found = suspect_readings(Recording("flight", None, TIME, channels))
    return [(item.kind, item.columns[0], item.samples) for item in found]


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_found_in_a_recording_as_it_should_be(seed):
    channels = flown(seed)
    assert suspects(channels) == []
    # a joint that rests for half of the time, a coarse encoder and a coarse gyro are as they should be
    channels["position.j0"][:300] = channels["position.j0"][300]
    assert suspects(channels) == []
    coarse = {name: np.round(values, 4 if name.startswith("position") else 5) for name, values in flown(seed).items()}
    assert suspects(coarse) == []


@pytest.mark.parametrize("value", [0.0, 999.0, -1.0])
@pytest.mark.parametrize(("family", "first"), [("position", "position.j0"), ("rate", "rate.x")])
def test_fill_values_are_found(family, first, value):
    channels = flown()
    for name in channels:
        if name.startswith(family):
            channels[name][FILL] = value if family == "position" else value or 0.5
    assert suspects(channels) == [(Suspicion.FILLED, first, 10)]


def test_held_readings_are_found_with_their_interval():
    channels = flown()
    for name in channels:
        if name.startswith("position"):
            channels[name] = np.repeat(channels[name][::10], 10)
    (found,) = suspect_readings(Recording("flight", None, TIME, channels))
    assert found.kind is Suspicion.HELD
    assert found.interval == pytest.approx(1.0)
    assert "every 1 s" in str(found)


def test_a_sensor_that_was_off_is_found():
    channels = flown()
    for axis in "xyz":
        channels[f"accel.{axis}"][:300] = 0.0
    assert suspects(channels) == [(Suspicion.CONSTANT, "accel.x", 300)]
