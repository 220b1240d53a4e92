"""Noise at the full rate, before samples are averaged: its size, colour, tones and spikes."""

import numpy as np
import pytest

from bayesid.recording.full_rate import channel_spectrum, noise_scale, spikes

TIME = np.arange(0.0, 60.0, 0.005)
SIGMA = 2e-4


def noise(seed: int = 1) -> np.ndarray:
    slow = 0.1 * np.sin(0.5 * TIME)
    return slow + SIGMA * np.random.default_rng(seed).normal(size=len(TIME))


@pytest.mark.parametrize("seed", range(5))
def test_white_noise_has_its_size_and_nothing_else(seed):
    seen = channel_spectrum("rate.x", TIME, noise(seed), 600, SIGMA)
    assert seen.reduced
    assert seen.block_rate == pytest.approx(10.0)
    assert seen.sigma == pytest.approx(SIGMA, rel=5.0 * seen.sigma_error)
    assert seen.sigma_error < 0.02
    assert seen.remarks == ()


def test_a_tone_above_the_blocks_has_its_frequency_and_amplitude():
    seen = channel_spectrum("accel.y", TIME, noise() + 5e-5 * np.sin(2.0 * np.pi * 40.0 * TIME), 600, SIGMA)
    (tone,) = seen.tones
    assert tone.frequency == pytest.approx(40.0, abs=0.1)
    assert tone.amplitude == pytest.approx(5e-5, rel=0.15)
    assert "tone at 40" in seen.remarks[0]


def test_noise_of_another_size_and_colour_is_remarked():
    larger = channel_spectrum("rate.x", TIME, noise(), 600, SIGMA / 1.5)
    assert "declared" in larger.remarks[0]
    smooth = np.convolve(np.random.default_rng(2).normal(size=len(TIME)), [0.5, 0.5], "same")
    assert "falls with frequency" in channel_spectrum("rate.x", TIME, SIGMA * smooth, 600, SIGMA).remarks[-1]


def test_channels_that_are_not_averaged_have_a_spectrum_alone():
    seen = channel_spectrum("rate.x", TIME, noise(), len(TIME), SIGMA)
    assert not seen.reduced
    assert seen.remarks == ()
    assert len(seen.frequency) == len(seen.density) > 100


def test_spikes_are_found_and_noise_has_none():
    readings = noise()
    assert noise_scale(readings) == pytest.approx(SIGMA, rel=0.03)
    assert not spikes(readings, SIGMA)[0].any()
    places = [100, 5000, 5001, 9000]
    readings[places] += np.array([10.0, 20.0, -15.0, 40.0]) * SIGMA
    gone, departure = spikes(readings, SIGMA)
    assert np.flatnonzero(gone).tolist() == places
    np.testing.assert_allclose(departure, [10.0, 20.0, 15.0, 40.0], atol=4.0)
