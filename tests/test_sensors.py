"""Noise specifications by their definition, and the filter's promises."""

from __future__ import annotations

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import periodogram

from bayesid._io.errors import InputError
from bayesid.simulation.effects import create
from bayesid.simulation.sensors import AngleRandomWalk, Filter, NoiseDensity, Sensor, SensorKind, StarTracker, White

AXES = (1.0e-5, 2.0e-5, 3.0e-5)


# noise ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("interval", [0.01, 0.5])
def test_white_noise_is_per_sample_whatever_the_interval(interval):
    np.testing.assert_array_equal(White(1e-5).sigma(interval), [1e-5] * 3)
    np.testing.assert_array_equal(White(AXES).sigma(interval), AXES)


@pytest.mark.parametrize("interval", [0.02, 0.1])
def test_an_angle_random_walk_is_the_growth_of_the_integrated_rate(interval):
    """The angle after t seconds has standard deviation walk x sqrt(t), whatever the sampling; four standard errors."""
    walk, duration, runs = 3e-4, 20.0, 3000
    sigma = AngleRandomWalk((walk, 2 * walk, 3 * walk)).sigma(interval)
    noise = np.random.default_rng(0).normal(size=(runs, round(duration / interval), 3)) * sigma
    angle = (noise * interval).sum(axis=1)
    expected = np.array([1.0, 2.0, 3.0]) * walk * np.sqrt(duration)
    np.testing.assert_allclose(angle.std(axis=0), expected, rtol=4.0 / np.sqrt(2.0 * runs))


@pytest.mark.parametrize("interval", [0.05, 0.2])
def test_a_noise_density_is_the_one_sided_spectrum(interval):
    """The mean of n exponential periodogram ordinates has a relative error of 1 / sqrt(n); four of them."""
    density, count = 2e-5, 40000
    sigma = NoiseDensity((density, 2 * density, 3 * density)).sigma(interval)
    noise = np.random.default_rng(1).normal(size=(count, 3)) * sigma
    frequency, spectrum = periodogram(noise, fs=1.0 / interval, axis=0, scaling="density", detrend=False)
    inside = (frequency > 0.0) & (frequency < 0.5 / interval)
    found = np.sqrt(spectrum[inside].mean(axis=0))
    np.testing.assert_allclose(found, density * np.array([1.0, 2.0, 3.0]), rtol=4.0 / np.sqrt(inside.sum()))


def test_a_star_tracker_is_differenced():
    """Rates from differences of noisy angles, made here; four standard errors."""
    arcsec, interval, count = 2.0, 0.5, 60000
    angle = np.random.default_rng(2).normal(size=count) * arcsec * np.pi / 648000.0
    rate = np.diff(angle)[::2] / interval  # every other one, so that they are independent
    sigma = StarTracker(arcsec).sigma(interval)
    np.testing.assert_allclose(sigma, rate.std(), rtol=4.0 / np.sqrt(2.0 * len(rate)))
    np.testing.assert_allclose(StarTracker((1.0, 2.0, 3.0)).sigma(interval) / sigma, [0.5, 1.0, 1.5])


# filter ---------------------------------------------------------------------------------------------------------------


def response(taps: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    """Complex gain at frequencies in cycles per sample, the middle tap being the present."""
    n = np.arange(len(taps)) - len(taps) // 2
    return np.exp(-2j * np.pi * np.outer(cycles, n)) @ taps


@pytest.mark.parametrize(("low_pass", "interval"), [(0.05, 0.5), (0.2, 0.5), (0.4, 0.1), (2.0, 0.1)])
def test_the_filter_has_gain_one_zero_phase_and_half_amplitude_at_its_cut_off(low_pass, interval):
    taps = Filter(low_pass).taps(interval)
    assert len(taps) % 2 == 1
    np.testing.assert_array_equal(taps, taps[::-1])
    assert taps.sum() == pytest.approx(1.0, abs=1e-14)
    cut = low_pass * interval
    gain = response(taps, np.array([0.0, cut]))
    np.testing.assert_allclose(gain.imag, 0.0, atol=1e-12)
    decibel = 20.0 * np.log10(np.abs(gain[1]))
    assert decibel == pytest.approx(-6.02, abs=0.1)


@pytest.mark.parametrize(("low_pass", "interval"), [(0.05, 0.5), (0.4, 0.1)])
def test_the_filter_passes_what_is_well_below_and_stops_what_is_well_above(low_pass, interval):
    """A Hamming window ripples by 0.0022 in the pass band and leaks as much in the stop band."""
    taps, cut = Filter(low_pass).taps(interval), low_pass * interval
    assert np.abs(response(taps, np.linspace(0.0, 0.2 * cut, 20)) - 1.0).max() < 0.005
    assert np.abs(response(taps, np.linspace(2.2 * cut, 0.5, 200))).max() < 0.005


def test_no_filter_is_one_tap():
    np.testing.assert_array_equal(Filter().taps(0.5), [1.0])
    np.testing.assert_array_equal(Filter(decimate=4).taps(0.5), [1.0])


@pytest.mark.parametrize("low_pass", [1.0, 1.5, 0.0, -0.1])
def test_a_cut_off_must_be_below_half_the_sampling_rate(low_pass):
    with pytest.raises(InputError, match=r"low_pass .* Hz is not below half the sampling rate, 1 Hz"):
        Filter(low_pass).taps(0.5)


# sensor ---------------------------------------------------------------------------------------------------------------


def test_mounting_turns_sensor_axes_into_base_axes():
    """A quarter turn about z: the sensor's x is the base's y."""
    half = np.sqrt(0.5)
    sensor = Sensor(SensorKind.RATE, White(1e-5), mounting=(0.0, 0.0, half, half))
    np.testing.assert_allclose(sensor.rotation @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)
    np.testing.assert_array_equal(Sensor(SensorKind.RATE, White(1e-5)).rotation, np.eye(3))


def test_units():
    shipped = (SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE)
    assert {kind.value: kind.unit for kind in shipped} == {"rate": "rad/s", "accel": "m/s2", "attitude": "rad"}


def test_an_accelerometer_elsewhere_reads_the_acceleration_of_a_point_of_a_rigid_body():
    """Of a base that turns at a constant rate about z, and of one that starts to turn."""
    effect, error = create("accel-position"), jnp.array([0.3, 0.0, 0.0])
    turning = SimpleNamespace(rate=jnp.array([0.0, 0.0, 2.0]), rate_change=jnp.zeros(3))
    starting = SimpleNamespace(rate=jnp.zeros(3), rate_change=jnp.array([0.0, 0.0, 5.0]))
    assert effect.specific_force(error, turning, jnp.zeros(3)) == pytest.approx([-4.0 * 0.3, 0.0, 0.0])
    assert effect.specific_force(error, starting, jnp.zeros(3)) == pytest.approx([0.0, 5.0 * 0.3, 0.0])
