"""Outliers that crowd or recur are an event; those that fall anywhere are called one as rarely as is stated."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.diagnosis.noise.sensor_faults import is_event
from bayesid.diagnosis.settings import DEFAULT_SETTINGS

TIMES = [np.arange(0.0, 160.0, 0.5)] * 3


def fallen(rng: np.random.Generator, fraction: float) -> list[np.ndarray]:
    """Outliers that fall anywhere."""
    return [times[rng.random(len(times)) < fraction] for times in TIMES]


@pytest.mark.parametrize("fraction", [0.003, 0.01, 0.03])
def test_outliers_that_fall_anywhere_are_no_event(fraction):
    rng, draws = np.random.default_rng(4), 4000
    assert (
        sum(is_event(fallen(rng, fraction), TIMES) for _ in range(draws)) <= draws * DEFAULT_SETTINGS.event_level * 3.0
    )


def test_what_lasts_is_an_event():
    assert is_event([np.array([60.0, 60.5, 61.0]), *[np.zeros(0)] * 2], TIMES)
    assert not is_event([np.array([20.0, 60.0, 90.0]), *[np.zeros(0)] * 2], TIMES)


def test_what_recurs_is_an_event():
    assert is_event([np.array([68.5]), np.array([68.5]), np.array([69.0])], TIMES)
    assert not is_event([np.array([68.5]), np.array([12.5]), np.array([101.0])], TIMES)


def test_none_and_recordings_without_the_sensor_are_no_event():
    assert not is_event([np.zeros(0)] * 3, TIMES)
    assert not is_event([np.zeros(0), np.zeros(0)], [np.zeros(0), TIMES[0]])
