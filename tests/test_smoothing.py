"""The smoothing spline's errors are what it says they are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bayesid.recording.jumps import smooth_joints
from bayesid.recording.smoothing import MOST_EVALUATIONS, ORDERS, JointSamples, _Problem, smooth
from studies.common import mission
from studies.truth.recordings import Truth

SIGMA = 1e-5


def swing(seed: int, time: np.ndarray) -> np.ndarray:
    """Sum of sines with its first two derivatives, shape (3, T)."""
    rng = np.random.default_rng(seed)
    omega, phase = 2.0 * np.pi * rng.uniform(0.01, 0.06, 4), rng.uniform(0.0, 2.0 * np.pi, 4)
    size = rng.uniform(0.1, 0.4, 4)
    angle = omega * time[:, None] + phase
    return np.stack(
        [
            (size * np.sin(angle)).sum(axis=1),
            (size * omega * np.cos(angle)).sum(axis=1),
            -(size * omega**2 * np.sin(angle)).sum(axis=1),
        ]
    )


def samples(
    seed: int, time: np.ndarray, derivative: int = 0, sigma: float = SIGMA, declared: bool = True
) -> JointSamples:
    noise = sigma * np.random.default_rng(1000 + 7 * seed + derivative).normal(size=len(time))
    return JointSamples(derivative, time, swing(seed, time)[derivative] + noise, sigma if declared else None)


def mean_square(fit, truth: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Mean of (error / reported sd)^2 of position, velocity and acceleration."""
    return (((fit.evaluate(time) - truth) / fit.standard_deviation(time)) ** 2).mean(axis=1)


TIME = np.arange(0.0, 80.01, 0.5)


def wiener(order: int, time: np.ndarray, intensity: float, seed: int) -> np.ndarray:
    """A motion the spline's prior is right about: white noise integrated `order` times, shape (3, T)."""
    rng, power = np.random.default_rng(seed), np.arange(order)
    factorial = np.array([math.factorial(k) for k in range(order)])
    state = np.zeros((len(time), order))
    state[0, :3] = rng.normal(size=3) * [0.3, 0.03, 0.003]
    exponent = 2 * order - 1 - power[:, None] - power
    for row, step in enumerate(np.diff(time)):
        lift = power - power[:, None]
        transition = np.where(lift >= 0, step ** np.maximum(lift, 0) / factorial[np.maximum(lift, 0)], 0.0)
        spread = intensity**2 * step**exponent / (exponent * np.outer(factorial[::-1], factorial[::-1]))
        sd = np.sqrt(np.diag(spread))
        state[row + 1] = transition @ state[row]
        state[row + 1] += sd * (np.linalg.cholesky(spread / np.outer(sd, sd)) @ rng.normal(size=order))
    return state[:, :3].T


@pytest.mark.parametrize(("order", "intensity"), [(3, 1e-3), (4, 3e-4), (5, 1e-4)])
def test_errors_are_as_large_as_stated_where_the_prior_is_right(order, intensity):
    """Mean z^2 of position, velocity and acceleration over 12 motions; measured 0.95 to 1.07 over 25.

    Each motion has some 40 independent errors, so the mean varies by sqrt(2 / 480) = 0.065; the band is three of them.
    """
    found, orders = [], []
    for seed in range(12):
        truth = wiener(order, TIME, intensity, seed)
        noise = SIGMA * np.random.default_rng(500 + seed).normal(size=len(TIME))
        fit = smooth([JointSamples(0, TIME, truth[0] + noise, SIGMA)])
        found.append(mean_square(fit, truth, TIME))
        orders.append(fit.order)
    mean = np.mean(found, axis=0)
    assert (np.abs(mean - 1.0) < 0.2).all(), mean
    assert np.median(orders) == order


def test_errors_on_smooth_motion_are_covered():
    """Sines are smoother than any such process, so the stated errors are too large rather than too small.

    Measured over 40 joints: mean z^2 of 0.96, 0.79, 0.62. The band: not above 1.2 and not below a quarter.
    """
    mean = np.mean([mean_square(smooth([samples(k, TIME)]), swing(k, TIME), TIME) for k in range(10)], axis=0)
    assert (mean > 0.25).all(), mean
    assert (mean < 1.2).all(), mean


def test_derivatives_are_far_better_than_differences_of_the_samples():
    fit = smooth([samples(1, TIME)])
    sd = fit.standard_deviation(TIME)[:, 10:-10].mean(axis=1)
    assert sd[1] < 0.5 * SIGMA * np.sqrt(2.0) / 0.5  # of first differences
    assert sd[2] < 0.4 * SIGMA * np.sqrt(6.0) / 0.25  # of second differences


@pytest.mark.slow
def test_covariance_between_times_is_that_of_the_errors():
    """Correlation of velocity errors one sample apart, over many noises of one motion; 5 standard errors."""
    time, runs, at = np.arange(0.0, 30.01, 0.5), 120, 30
    fits = []
    truth = swing(3, time)
    for run in range(runs):
        noise = SIGMA * np.random.default_rng(run).normal(size=len(time))
        fits.append(smooth([JointSamples(0, time, truth[0] + noise, SIGMA)]))
    error = np.array([(fit.evaluate(time) - truth)[1, at - 3 : at + 1] for fit in fits])
    stated = np.mean([[fit.lag_covariance(time, 3)[lag, at, 1, 1] for lag in range(4)] for fit in fits], axis=0)
    variance = stated[0]
    for lag in range(4):
        found = (error[:, 3] * error[:, 3 - lag]).mean()
        assert abs(found - stated[lag]) < 5.0 * variance * np.sqrt(2.0 / runs), (lag, found / variance)


def test_velocity_alone_with_its_start():
    """Position is the start plus the integral: exact at time 0, then its error grows and is reported."""
    truth = swing(4, TIME)
    fit = smooth([samples(4, TIME, derivative=1)], start=float(truth[0, 0]))
    sd = fit.standard_deviation(TIME)
    error = fit.evaluate(TIME) - truth
    assert abs(error[0, 0]) < 1e-9
    assert sd[0, -1] > 3.0 * sd[0, 5]
    assert np.abs(error[0] / np.maximum(sd[0], 1e-9)).max() < 4.5
    assert 0.5 < (error[1:] ** 2 / sd[1:] ** 2).mean() < 1.6


def test_position_velocity_and_acceleration_together():
    """More channels, smaller errors, still covered: the mean z^2 over six joints within 0.65 to 1.4."""
    time = np.arange(0.0, 60.01, 0.5)
    found = []
    for seed in range(6):
        series = [samples(seed, time), samples(seed, time, 1, 2e-6), samples(seed, time, 2, 2e-6)]
        joint, alone = smooth(series), smooth(series[:1])
        assert (joint.standard_deviation(time) < alone.standard_deviation(time)).all()
        found.append(mean_square(joint, swing(seed, time), time))
    mean = np.mean(found, axis=0)
    assert (mean > 0.65).all(), mean
    assert (mean < 1.4).all(), mean


@pytest.mark.parametrize("derivative", [0, 1])
@pytest.mark.parametrize(("order", "intensity"), [(4, 3e-4), (5, 1e-4)])
def test_an_undeclared_noise_is_estimated_within_15_percent(order, intensity, derivative):
    """The standard error of a sigma from 400 samples, a fifth of which the curve takes, is 4 %."""
    time = np.arange(0.0, 200.0, 0.5)
    truth = wiener(order, time, intensity, 5)
    noise = SIGMA * np.random.default_rng(6).normal(size=len(time))
    start = float(truth[0, 0]) if derivative else None
    fit = smooth([JointSamples(derivative, time, truth[derivative] + noise, None)], start=start)
    assert fit.sigmas[0] == pytest.approx(SIGMA, rel=0.15)


@pytest.mark.parametrize("derivative", [0, 1])
def test_the_noise_on_smooth_motion_is_estimated(derivative):
    """The median over five joints within 15 %."""
    time = np.arange(0.0, 200.0, 0.5)
    start = 0.0 if derivative else None
    found = [smooth([samples(k, time, derivative, declared=False)], start=start).sigmas[0] for k in range(5)]
    assert np.median(found) == pytest.approx(SIGMA, rel=0.15)


def test_two_undeclared_noises_are_told_apart():
    time = np.arange(0.0, 150.0, 0.5)
    series = [samples(6, time, 0, 1e-4, declared=False), samples(6, time, 1, 3e-6, declared=False)]
    assert smooth(series).sigmas == pytest.approx((1e-4, 3e-6), rel=0.15)


def test_a_gap_widens_the_errors_and_they_stay_covered():
    kept = TIME[(TIME < 30.0) | (TIME > 36.0)]
    inside = np.arange(31.0, 35.5, 0.5)
    ratios = []
    for seed in range(6):
        fit = smooth([samples(seed, kept)])
        sd = fit.standard_deviation(inside)
        usual = fit.standard_deviation(kept[20:40]).mean(axis=1)
        assert (sd[:2].max(axis=1) > 1.5 * usual[:2]).all()
        ratios.append((np.abs(fit.evaluate(inside) - swing(seed, inside)) / sd).max(axis=1))
    # an error within a gap is one or two numbers per joint and derivative
    ratios = np.array(ratios)
    assert ratios.max() < 5.0
    assert np.median(ratios) < 2.5
    assert np.median(ratios) > 0.2


def test_times_off_the_grid_are_covered_as_well():
    """On the process the spline assumes: mean z^2 of 12 x 60 correlated errors within 0.7 to 1.4."""
    time = np.arange(0.0, 50.01, 0.5)
    other = np.sort(np.random.default_rng(0).uniform(0.5, 49.5, 60))
    both = np.union1d(time, other)
    found = []
    for seed in range(12):
        truth = wiener(4, both, 3e-4, seed)
        noise = SIGMA * np.random.default_rng(50 + seed).normal(size=len(time))
        fit = smooth([JointSamples(0, time, truth[0, np.isin(both, time)] + noise, SIGMA)])
        found.append(mean_square(fit, truth[:, np.isin(both, other)], other))
    mean = np.mean(found, axis=0)
    assert (mean > 0.7).all(), mean
    assert (mean < 1.4).all(), mean


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_a_joint_at_rest(noise):
    """A constant: velocity and acceleration vanish within their errors, with and without noise in the samples."""
    time = np.arange(0.0, 40.01, 0.5)
    value = 0.4 + noise * SIGMA * np.random.default_rng(8).normal(size=len(time))
    fit = smooth([JointSamples(0, time, value, SIGMA)])
    position, velocity, acceleration = fit.evaluate(time)
    assert np.abs(position - 0.4).max() < 4.0 * SIGMA
    # the mean of 81 samples has an error of SIGMA / 9 and a slope over 40 s one of 1e-7 rad/s; the rest is margin
    assert np.abs(velocity).max() < 5e-6
    assert np.abs(acceleration).max() < 5e-6
    assert np.isfinite(fit.standard_deviation(time)).all()


def test_chi2_says_when_the_samples_are_not_followed():
    """Noise three times as large as declared shows as a misfit."""
    honest = smooth([samples(2, TIME)])
    assert honest.chi2 / honest.samples < 1.2
    noise = 3.0 * SIGMA * np.random.default_rng(9).normal(size=len(TIME))
    wrong = smooth([JointSamples(0, TIME, swing(2, TIME)[0] + noise, SIGMA)])
    assert honest.intensity < wrong.intensity or wrong.chi2 / wrong.samples > 2.0


def test_time_units_and_offsets_do_not_matter():
    """The same samples stated in another time unit give the same curve; to the optimiser's tolerance."""
    here = smooth([samples(1, TIME)])
    shifted = smooth([JointSamples(0, TIME + 1000.0, samples(1, TIME).value, SIGMA)])
    np.testing.assert_allclose(shifted.evaluate(TIME + 1000.0)[0], here.evaluate(TIME)[0], atol=0.05 * SIGMA)


def test_equal_readings_are_a_joint_at_rest_beside_others_that_move():
    """Rounding of a position of 0.2 rad would else be a motion, from which bodies without motion are identified."""
    time, rng = np.arange(0.0, 60.0, 0.1), np.random.default_rng(4)
    moving = JointSamples(0, time, 0.1 * np.sin(0.2 * time) + 1e-6 * rng.normal(size=len(time)), 1e-6)
    at_rest = JointSamples(0, time, np.full(len(time), 0.2), 1e-6)
    still, moved = smooth_joints([[at_rest], [moving]])
    position, velocity, acceleration = still.evaluate(time)
    np.testing.assert_allclose(position, 0.2, rtol=1e-14)
    assert np.abs(velocity).max() < 1e-9
    assert np.abs(acceleration).max() < 1e-9
    assert still.jumps == ()
    assert np.abs(moved.evaluate(time)[1] - 0.02 * np.cos(0.2 * time)).max() < 1e-4


@pytest.mark.slow
def test_steps_of_very_different_roughness_do_not_spoil_the_states():
    """ETS-VII's flight, recorded with one noise of many: repeated solutions with the inexact factor diverge."""
    rng = np.random.default_rng(np.random.SeedSequence(3, spawn_key=(4,)))
    mission.true_arm(mission.published_robot(), rng)
    rng.standard_normal(3)
    times = mission.sample_times(mission.DURATION, mission.INTERVAL)
    position, speed, acceleration = map(np.asarray, mission.flight_manoeuvre().evaluate(times))
    still, level = np.zeros((len(times), 3)), np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1))
    truth = Truth(times, position, speed, acceleration, acceleration, still, level, still, still, still)
    for joint, angle in zip(mission.recorded(truth, rng, bias=np.zeros(3)).motion.joints, position.T, strict=True):
        assert joint.chi2 < 1.5 * joint.samples
        assert np.abs(joint.evaluate(times)[0] - angle).max() < 5e-6


@pytest.mark.parametrize("exact", [0.01 * TIME, 1e-4 * TIME**2], ids=["ramp", "parabola"])
def test_readings_without_noise_take_few_evaluations(monkeypatch, exact):
    """Their likelihood grows with every digit that noise and process lose, until rounding makes it rough."""
    solved, refined = [], []
    solve, gradient = _Problem.solve, _Problem._gradient
    monkeypatch.setattr(_Problem, "solve", lambda *given: solved.append(1) or solve(*given))
    monkeypatch.setattr(_Problem, "_gradient", lambda *given: refined.append(1) or gradient(*given))
    fit = smooth([JointSamples(0, TIME, exact, None)])
    np.testing.assert_allclose(fit.evaluate(TIME)[0], exact, rtol=0.0, atol=1e-10)
    assert fit.sigmas[0] < 1e-9
    assert len(solved) <= len(ORDERS) * (2 * MOST_EVALUATIONS + 3)
    assert len(refined) < 16 * len(solved)
