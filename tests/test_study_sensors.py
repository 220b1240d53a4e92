"""The study of noise and sensors: treatments, closed forms, the linear method, and all of it where time allows."""

from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.base_body import paper
from studies.common.ets7 import INTERVAL
from studies.common.quantities import JUDGED
from studies.common.study import Verdict
from studies.sensors import STUDY, Effort, run
from studies.sensors.checks import Balance, SmoothingErrors, attenuation, regress, scalars, solve_balance
from studies.sensors.estimators import (
    EQUAL,
    EXACT,
    LIKELIHOOD,
    PAPER,
    PIECES,
    TREATMENTS,
    WEIGHTED,
    WHOLE,
    Estimator,
    Linear,
    Spread,
    as_read,
    constant,
    integral,
    integrated,
    integrated_whole,
)
from studies.sensors.report import _failing, _judged
from studies.sensors.result import REALISTIC
from studies.sensors.signals import (
    Differences,
    Draws,
    LowPass,
    Noise,
    Polynomial,
    SavitzkyGolay,
    SmoothingSpline,
    Wiener,
    fly,
    levels,
    motion,
)
from studies.sensors.tables import equal_rms, percent
from tests.report_rules import broken_rules


@pytest.fixture(scope="module")
def free():
    return fly(gradient=False)


@pytest.fixture(scope="module")
def small():
    """A made-up linear problem of 40 samples: slow signals of thirteen unknowns, and a bias."""
    rng = np.random.default_rng(5)
    time = INTERVAL * np.arange(40)
    waves = np.stack([np.cos((0.2 + 0.15 * k) * time + k) for k in range(5)], axis=1)
    readings = np.einsum("tk,kcn->tcn", waves, rng.normal(size=(5, 6, 13)))
    bias = np.zeros((40, 6, 3))
    bias[:, 3:] = np.eye(3)
    names = tuple(f"base.{k}" for k in range(13)) + tuple(f"accel-bias.{axis}" for axis in "xyz")
    whole = np.concatenate([readings, bias], axis=2).reshape(240, 16)
    return Linear(time, whole, np.zeros((6, 3, 40, 6)), np.eye(10, 16), names)


@pytest.mark.parametrize("treatment", TREATMENTS, ids=lambda item: item.title)
def test_treatments_follow_a_slow_wave_and_its_derivatives(treatment):
    time = INTERVAL * np.arange(241)
    w, phase = 2.0 * np.pi / 60.0, np.array([0.3, 1.4])
    angle = w * time[:, None] + phase
    inner = slice(60, -60)  # the low-pass swings longest after the ends
    treated = treatment(time, np.sin(angle), 1e-8)[:, inner]
    true = np.stack([np.sin(angle), w * np.cos(angle), -(w**2) * np.sin(angle)])[:, inner]
    # central differences err by (w h)^2 / 6 and / 12; the others by no more
    error = np.abs(treated - true).max(axis=(1, 2)) / [1.0, w, w**2]
    assert (error < (w * INTERVAL) ** 2 / 6.0 * 1.01 + 1e-6).all()


def test_differences_are_exact_for_parabolas_and_noise_is_as_in_closed_form():
    time = INTERVAL * np.arange(30)
    _, speed, bend = Differences()(time, (2.0 - 3.0 * time + 0.5 * time**2)[:, None], 0.0)
    np.testing.assert_allclose(speed[1:-1, 0], -3.0 + time[1:-1], atol=1e-11)
    np.testing.assert_allclose(bend[:, 0], 1.0, atol=1e-10)
    noise = np.random.default_rng(0).normal(size=(30, 4000))
    _, speed, bend = Differences()(time, noise, 1.0)
    assert speed[1:-1].std() == pytest.approx(1.0 / (np.sqrt(2.0) * INTERVAL), rel=0.01)
    assert bend[1:-1].std() == pytest.approx(np.sqrt(6.0) / INTERVAL**2, rel=0.01)


def test_pieces_of_a_polynomial_are_exact_where_one_polynomial_is_not():
    time = np.arange(0.0, 60.0, 0.5)
    values = np.where(time < 30.0, (time / 10.0) ** 3, 27.0 - (time - 30.0))[:, None]
    assert np.abs(Polynomial((30.0,))(time, values, 0.0)[0] - values).max() < 1e-9
    assert np.abs(Polynomial()(time, values, 0.0)[0] - values).max() > 0.1


def test_smoothers_beat_differences_on_noise():
    time = INTERVAL * np.arange(241)
    rng, w, sigma = np.random.default_rng(3), 2.0 * np.pi / 60.0, 1e-4
    true = -(w**2) * np.sin(w * time)
    noisy = (np.sin(w * time) + sigma * rng.normal(size=241))[:, None]

    def error(treatment):
        return (treatment(time, noisy, sigma)[2, 20:-20, 0] - true[20:-20]).std()

    rough = error(Differences())
    for treatment in (LowPass(), SavitzkyGolay(), Polynomial(), SmoothingSpline(), Wiener()):
        assert error(treatment) < 0.2 * rough
    assert error(Wiener()) < min(error(LowPass()), error(SavitzkyGolay()), error(SmoothingSpline()))


def test_integration_loses_what_the_closed_form_says():
    for item in scalars(400, np.random.default_rng(1), samples=601):
        assert item.matrices == pytest.approx(item.closed, rel=3e-3)  # sums of 601 samples are no integrals yet
        assert item.simulated == pytest.approx(item.closed, abs=4.0 * item.error)
        # one direction of 601 is lost, of which a wave that ends at 1 has no more than this
        assert 1.0 <= item.whole < 1.0 + 2.0 / 601**2 + 1e-9
        assert item.bias == pytest.approx(item.bias_closed, rel=1e-3)


def test_the_rule_is_exact_for_lines_and_blind_to_alternation_alone():
    time = INTERVAL * np.arange(41)
    rule = integral(time)
    np.testing.assert_allclose(rule @ (2.0 + time), 2.0 * time[1:] + 0.5 * time[1:] ** 2)
    blind = np.where(np.arange(41) % 2, -1.0, 1.0) / np.sqrt(41)
    np.testing.assert_allclose(rule @ blind, 0.0, atol=1e-15)
    # the whole covariance undoes the sum: all information but the blind direction's
    kept = rule.T @ np.linalg.solve(rule @ rule.T, rule)
    np.testing.assert_allclose(kept, np.eye(41) - np.outer(blind, blind), atol=1e-9)


def test_stated_deviations_are_those_of_repeated_noise(small):
    noise, rng, count = Noise(0.02, 0.03, 0.0), np.random.default_rng(7), 4000
    rate, accel = (sigma * rng.normal(size=(count, 40, 3)) for sigma in (noise.rate, noise.accel))
    residual = small.residual(rate, accel, np.zeros((count, 3, 40, 6)))
    for weight in (as_read(small.time, noise), integrated_whole(small.time, noise)):
        errors, stated, chi2 = Estimator(small, weight).solve(residual)
        np.testing.assert_allclose(errors.std(axis=0), stated[0], rtol=0.05)
        assert chi2.mean() == pytest.approx(1.0, abs=0.01)
    # the velocities' whole covariance gives the very same estimates, less one alternating direction
    read, whole = (
        Estimator(small, weigh(small.time, noise)).solve(residual)[0] for weigh in (as_read, integrated_whole)
    )
    assert np.abs(read - whole).std() < 0.2 * read.std()
    # taken for white, velocities are worse, and least squares do not know it
    errors, stated, _ = Estimator(small, integrated(small.time, noise)).solve(residual)
    assert (errors.std(axis=0) > read.std(axis=0)).all()


def test_unknown_bias_and_constant_take_the_blame(small):
    noise, still = Noise(1.0, 1.0, 0.0), np.zeros((1, 40, 3))
    residual = small.residual(still, still + 0.5, np.zeros((1, 3, 40, 6)))
    weight = integrated(small.time, noise)
    assert np.abs(Estimator(small, weight).solve(residual)[0]).max() > 0.01
    np.testing.assert_allclose(Estimator(small, weight, biased=True).solve(residual)[0], 0.0, atol=1e-10)
    # a velocity at the start is an acceleration that acts during the first sample
    kick = still.copy()
    kick[:, 0] = 0.1
    residual = small.residual(still, kick, np.zeros((1, 3, 40, 6)))
    free = Estimator(small, weight, nuisance=constant(weight, small.time))
    np.testing.assert_allclose(free.solve(residual)[0], 0.0, atol=1e-10)


def test_monte_carlo_errors_are_those_of_normal_numbers():
    rng = np.random.default_rng(2)
    spreads = [Spread(0.3 + rng.normal(size=(50, 10)), np.ones((50, 10)), np.ones(50)) for _ in range(60)]
    for name in ("bias", "sd", "rms"):
        values = np.concatenate([getattr(spread, name) for spread in spreads])
        errors = np.concatenate([getattr(spread, f"{name}_error") for spread in spreads])
        assert errors.mean() == pytest.approx(values.std(), rel=0.15)


def test_linear_method_is_exact_without_noise(free):
    balance = Balance(np.stack(motion().evaluate(free.time)))
    quantities = mass_com_inertia(solve_balance(*balance(free.rate, free.rate_change, free.accel)))
    # the rates' derivative is by differences of samples 0.1 s apart
    np.testing.assert_allclose(quantities[:7], paper.TRUTH[:7], rtol=2e-3)


def test_linear_method_is_attenuated_as_predicted(free):
    noise = levels(free)["0.04 deg/s"]
    errors = regress(Draws.of(free, 6, np.random.default_rng(4)), noise, (Differences(),))["differences"]
    predicted = attenuation(free, noise)
    assert predicted[0] < -0.5
    np.testing.assert_allclose(errors.mean(axis=0)[JUDGED], predicted[JUDGED], atol=0.02)


def test_percentages_have_their_error_in_brackets_and_small_ones_a_power_of_ten():
    assert percent(0.032, 0.0034) == "3.2(3)"
    assert percent(-2.0e-4, 1.2e-4) == "−0.020(12)"
    assert percent(1.653e-7, 1.794e-8) == "1.65(18) × 10⁻⁵"


def test_errors_are_orders_of_magnitude_where_fits_diverge():
    spread = Spread(np.tile([[0.13], [-0.13], [0.14]], 10), np.ones((3, 10)), np.ones(3))
    for diverged, mass in ((True, "about 10"), (False, "13.3(3)")):
        fits = {"level": {PAPER: SimpleNamespace(diverged=np.array([False, diverged]))}}
        result = SimpleNamespace(accelerometers={"level": {PAPER: spread}}, refits=fits)
        assert equal_rms(result, "level", PAPER) == (mass, mass)


def test_a_ratio_is_judged_with_its_monte_carlo_error():
    for ratio, verdict in ((0.66, Verdict.FAIL), (0.7, Verdict.OPEN), (0.8, Verdict.OPEN), (1.0, Verdict.PASS)):
        assert _judged(np.array([1.0, ratio]), np.array([0.08, 0.08])) is verdict


def test_the_cause_of_what_is_not_honest_is_named_only_where_exact_joints_are_honest():
    rng = np.random.default_rng(0)
    wide, right = (Spread(rng.normal(size=(400, 10)), np.full((400, 10), sd), np.ones(400)) for sd in (2.0, 1.0))
    smoothing = {"level": SmoothingErrors(np.array([0.95, 0.85, 0.73]), np.array([0.93, 0.77, 0.58]))}
    joints = [{"level": {LIKELIHOOD: wide, EXACT: exact}} for exact in (right, wide)]
    results = [SimpleNamespace(joints=each, smoothing=smoothing) for each in joints]
    named, unknown = (_failing(result, "level") for result in results)
    assert "it is the propagated encoder noise that is misstated" in named
    assert "0.95, 0.85 and 0.73 times" in named
    assert "the cause is not known" in unknown


@pytest.mark.slow
def test_errors_of_smoothed_joints_are_overstated_at_most_by_the_motion_that_is_not_lost():
    """Motion that is lost can only add to the noise that passes, and the smoother states both."""
    flown = fly()
    noise = levels(flown)["2″, 1e-9, 1e-6"]
    errors = SmoothingErrors.of(Draws.of(flown, 6, np.random.default_rng(4)), noise)
    assert (errors.measured > errors.expected - 0.05).all()
    assert (errors.measured < 1.0).all()
    assert errors.measured[2] < 0.85


@pytest.mark.usefixtures("slow")
def test_the_study(tmp_path):
    result = run(effort=Effort(8, likelihood_fits=3, paper_fits=2, levels=("0.04 deg/s", REALISTIC)))
    for level, refits in result.refits.items():
        assert refits[LIKELIHOOD].difference[JUDGED].max() < (0.3 if level == "0.04 deg/s" else 0.05)
        assert np.isfinite(refits[PAPER].nonlinear.errors).all()
    for uses in result.accelerometers.values():
        np.testing.assert_allclose(
            uses[WHOLE].errors, uses[WEIGHTED].errors, rtol=0.0, atol=2e-3 * uses[WEIGHTED].sd.max()
        )
        assert (uses[EQUAL].sd[JUDGED] > 2.0 * uses[WEIGHTED].sd[JUDGED]).all()
    honest = result.joints[REALISTIC][LIKELIHOOD]
    assert 0.7 < honest.honesty.mean() < 1.3
    assert PIECES.title in result.rates[REALISTIC]
    STUDY.write(result, tmp_path / "sensors.pdf")
    assert broken_rules(tmp_path / "sensors.pdf", full=False) == []
