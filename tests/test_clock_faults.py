"""Readings at other times than stated: against a signal in closed form and against MuJoCo read at those times."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._math.resampling import resampled
from bayesid.simulation.effects import Readings, SensorClock, SensorLatency
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.sensors import SensorKind
from studies.truth import mujoco as mj
from studies.truth.bodies import SERVICER3

RNG = np.random.default_rng(7)
UNEVEN = np.cumsum(RNG.uniform(0.05, 0.4, 200))
FREQUENCY = np.array([0.05, 0.11, 0.23])


def signal(time: np.ndarray) -> np.ndarray:
    """Three sines of the time (T, 3)."""
    return np.sin(2.0 * np.pi * FREQUENCY * np.asarray(time)[:, None] + [0.3, 1.0, 2.0])


def faulty(effect: Effect, value: float, time: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """The readings of the effect's sensor, whose true readings are given, and those of the other left alone."""
    readings = Readings(jnp.asarray(time), {"rate": jnp.asarray(truth), "accel": jnp.asarray(truth)}, jnp.zeros((0, 0)))
    found = effect.read(jnp.asarray([value]), readings)
    (other,) = {"rate", "accel"} - {effect.sensor.value}
    np.testing.assert_array_equal(found.channels[other], truth)
    return np.asarray(found.channels[effect.sensor.value])


# the interpolation ----------------------------------------------------------------------------------------------------


def test_a_curve_goes_through_its_samples():
    values = RNG.normal(size=(len(UNEVEN), 3))
    np.testing.assert_allclose(resampled(jnp.asarray(UNEVEN), UNEVEN, values), values, rtol=0.0, atol=1e-14)


@pytest.mark.slow
def test_a_parabola_is_exact_up_to_its_ends_and_goes_on_straight():
    values = np.stack([UNEVEN**2 - 3.0 * UNEVEN, 0.5 * UNEVEN + 1.0], axis=1)
    at = np.linspace(UNEVEN[0], UNEVEN[-1], 333)
    exact = np.stack([at**2 - 3.0 * at, 0.5 * at + 1.0], axis=1)
    np.testing.assert_allclose(resampled(jnp.asarray(at), UNEVEN, values), exact, atol=1e-10)
    for end, sign in ((0, -1.0), (-1, 1.0)):
        beyond = UNEVEN[end] + sign * np.array([0.5, 5.0])
        straight = values[end] + (beyond - UNEVEN[end])[:, None] * np.array([2.0 * UNEVEN[end] - 3.0, 0.5])
        np.testing.assert_allclose(resampled(jnp.asarray(beyond), UNEVEN, values), straight, atol=1e-9)


@pytest.mark.slow
def test_the_error_falls_with_the_third_power_of_the_samples_distance():
    errors = []
    for step in (0.4, 0.2, 0.1):
        time, at = np.arange(0.0, 40.01, step), np.arange(0.0, 39.9, 0.013)
        errors.append(np.abs(np.asarray(resampled(jnp.asarray(at), time, signal(time))) - signal(at)).max())
    assert errors[0] < 0.02
    assert np.log2(errors[0] / errors[1]) > 2.7
    assert np.log2(errors[1] / errors[2]) > 2.7


@pytest.mark.slow
@pytest.mark.parametrize("padding", [1, 2, 7])
def test_padding_changes_nothing(padding):
    at = jnp.linspace(UNEVEN[0] - 1.0, UNEVEN[-1] + 1.0, 50)
    longer = [np.concatenate([part, np.repeat(part[-1:], padding, axis=0)]) for part in (UNEVEN, signal(UNEVEN))]
    plain, padded = (resampled(at, time, values) for time, values in ((UNEVEN, signal(UNEVEN)), longer))
    np.testing.assert_allclose(padded, plain, atol=1e-13)
    slope = jax.jacfwd(lambda delay: resampled(longer[0] - delay, *longer))(0.0)
    exact = -2.0 * np.pi * FREQUENCY * np.cos(2.0 * np.pi * FREQUENCY * UNEVEN[:, None] + [0.3, 1.0, 2.0])
    np.testing.assert_allclose(slope[: len(UNEVEN)], exact, atol=0.15)
    np.testing.assert_allclose(slope[len(UNEVEN) :], np.broadcast_to(exact[-1], (padding, 3)), atol=0.15)


# the effects ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "effect",
    [SensorLatency.of(SensorKind.RATE)(), SensorLatency.of(SensorKind.ACCEL)()],
    ids=lambda effect: effect.name,
)
def test_a_delayed_sample_shows_the_past(effect):
    """What the interpolation leaves is 2 % of what a delay of 0.3 s makes, at samples 0.05 to 0.4 s apart."""
    late = faulty(effect, 0.3, UNEVEN, signal(UNEVEN))
    change = np.abs(signal(UNEVEN - 0.3) - signal(UNEVEN)).max()
    inside = UNEVEN[0] + 0.3 < UNEVEN
    assert np.abs(late - signal(UNEVEN - 0.3))[inside].max() < 0.02 * change


@pytest.mark.parametrize(
    "effect",
    [
        SensorLatency.of(SensorKind.RATE)(),
        SensorLatency.of(SensorKind.ACCEL)(),
        SensorClock.of(SensorKind.RATE)(),
        SensorClock.of(SensorKind.ACCEL)(),
    ],
    ids=lambda e: e.name,
)
def test_without_fault_the_reading_is_exact(effect):
    """The interpolation's error is zero at the samples, so that none has to cancel."""
    truth = signal(UNEVEN)
    np.testing.assert_allclose(faulty(effect, 0.0, UNEVEN, truth), truth, atol=1e-14)


@pytest.mark.parametrize(
    "effect", [SensorClock.of(SensorKind.RATE)(), SensorClock.of(SensorKind.ACCEL)()], ids=lambda effect: effect.name
)
@pytest.mark.parametrize("rate", [5e-3, -5e-3])
def test_a_clock_stamps_true_time_times_one_plus_its_rate(effect, rate):
    """A sensor that samples at true times and stamps them wrongly, against the truth at the stamps."""
    true_time = np.arange(0.0, 40.0, 0.1)
    stamped = true_time * (1.0 + rate)
    found = faulty(effect, rate, stamped, signal(stamped))
    inside = true_time < stamped[-1]
    error = np.abs(found - signal(true_time))
    assert error[inside].max() < 1e-3
    assert error.max() < 0.05  # straight on for 0.2 s
    assert np.abs(signal(stamped) - signal(true_time)).max() > 0.2


def test_a_fast_clock_reads_what_mujoco_reads_at_the_true_times():
    """What is left of the effect is 2 % where the motion's ramps end, at kinks of the acceleration."""
    motion = mj.smooth_motion(3, 40.0, 5, amplitude=0.5, frequencies=(0.03, 0.06), ramp=10.0)
    true_time = np.arange(0.0, 40.0, 0.1)
    stamped, truth = true_time * 1.004, mj.TruthModel(SERVICER3, accel_position=(0.2, -0.1, 0.3))
    read, at_stamps = (truth.run(motion, time, rate0=(0.02, -0.03, 0.015), step=0.05) for time in (true_time, stamped))
    for effect, key in ((SensorClock.of(SensorKind.RATE)(), "rate"), (SensorClock.of(SensorKind.ACCEL)(), "accel")):
        given, exact = getattr(at_stamps, key), getattr(read, key)
        found = faulty(effect, 4e-3, stamped, given)
        assert np.linalg.norm(found - exact) < 0.02 * np.linalg.norm(given - exact)
        assert np.median(np.abs(found - exact)) < 1e-3 * np.median(np.abs(given - exact))
