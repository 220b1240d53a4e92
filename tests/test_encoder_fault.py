"""Noise of the encoders, from their samples alone."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from bayesid.diagnosis.noise.encoder_fault import encoder_noise, noise_of, with_encoder_noise
from bayesid.inference.noise_changes import leaving_out, relinearised, with_sensors
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.recording.smoothing import JointSamples
from bayesid.simulation.sensors import Scaled

SIGMA, TIME = 1e-6, np.arange(0.0, 120.0, 0.25)
DRAWS = 400


def swung(sigma, seed, time=TIME, joints=3):
    """Samples of joints that swing at up to 0.1 Hz."""
    rng = np.random.default_rng(seed)
    swing = [0.6 * np.sin(2.0 * np.pi * (0.02 + 0.04 * k) * time + k) for k in range(joints)]
    return [JointSamples(0, time, own + sigma * rng.normal(size=len(time)), SIGMA) for own in swing]


@pytest.fixture(scope="module")
def drawn():
    return [noise_of(swung(SIGMA, seed)) for seed in range(DRAWS)]


def test_the_variance_is_right_and_so_are_its_degrees_of_freedom(drawn):
    """Mean and scatter against chi-square; the least of three orders is a little below one."""
    ratio, degrees = np.array([own.ratio for own in drawn]), np.mean([own.degrees for own in drawn])
    assert 0.9 < ratio.mean() < 1.02
    assert ratio.std() == pytest.approx(np.sqrt(2.0 / degrees), rel=0.2)


def test_false_alarms_are_no_more_frequent_than_the_level(drawn):
    values = np.array([own.log_p for own in drawn])
    level = 0.05
    assert (values < np.log(level)).mean() < level + 3.0 * np.sqrt(level * (1.0 - level) / DRAWS)
    assert values.min() > np.log(1e-5)


def test_twice_the_noise_is_seen_and_measured():
    found = noise_of(swung(2.0 * SIGMA, 1))
    assert np.sqrt(found.ratio) == pytest.approx(2.0, rel=0.2)
    assert found.log_p < -20.0


def test_a_joint_of_which_other_things_are_wrong_is_no_noise():
    good, *others = swung(SIGMA, 4)
    rough = good.value + 1e-3 * np.sign(np.sin(0.4 * TIME))
    found = noise_of([replace(good, value=rough), *others])
    assert found.log_p > np.log(1e-3)


def test_uneven_samples_are_left_out():
    gap = TIME[(TIME < 40.0) | (TIME > 52.0)]
    whole, cut = noise_of(swung(SIGMA, 2)), noise_of(swung(SIGMA, 2, gap))
    assert cut.ratio == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / cut.degrees))
    assert cut.degrees < whole.degrees


def test_nothing_is_said_where_nothing_is_declared_or_little_recorded():
    assert noise_of([replace(one, sigma=None) for one in swung(SIGMA, 1)]) is None
    assert noise_of(swung(SIGMA, 1, TIME[:40])) is None


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.7])
def test_the_gain_is_that_of_a_scaled_chi_square(factor):
    found = noise_of(swung(1.6 * SIGMA, 7))

    def log_density(scale):
        return chi2.logpdf(found.ratio * found.degrees / scale**2, found.degrees) - 2.0 * np.log(scale)

    assert found.log_gain(factor) == pytest.approx(log_density(factor) - log_density(1.0), abs=1e-9)


def test_a_posterior_has_the_noise_of_its_joints(planar_case):
    """The joints of a posterior, noisier than declared, smoothed anew with what they have."""
    model, posterior = planar_case.posterior.model, planar_case.posterior
    names = [f"position.{joint.name}" for joint in model.robot.joints]

    def with_joints(sigma):
        values = {name: one.value for name, one in zip(names, swung(sigma, 3, joints=len(names)), strict=True)}
        motion = MeasuredMotion.from_recording(Recording("joints", None, TIME, values), model.robot, sigma={0: SIGMA})
        manoeuvres = tuple(replace(item, motion=motion) for item in posterior.manoeuvres)
        return replace(posterior, data=replace(posterior.data, manoeuvres=manoeuvres))

    z = posterior.starting_point()
    noisy, quiet = with_joints(3.0 * SIGMA), with_joints(SIGMA)
    assert encoder_noise(noisy).log_p < -20.0
    assert encoder_noise(quiet).log_p > np.log(1e-4)
    again = with_encoder_noise(noisy, 3.0, z)
    assert encoder_noise(again).log_p > np.log(1e-4)


def test_samples_that_are_left_out_stay_so_with_other_noise(planar_case):
    """Outliers beside a second fault: the noise of sensors or encoders changes, or is linearised elsewhere."""
    whole, z = planar_case.posterior, planar_case.posterior.starting_point()
    gone = np.zeros_like(whole.whitenings[0].outputs)
    gone[[3, 20], 1] = True
    less = leaving_out(whole, [gone])
    noisier = [replace(sensor, noise=Scaled(sensor.noise, (2.0,) * 3)) for sensor in whole.model.sensors]
    for again in (relinearised(less, z), with_sensors(less, noisier, z), with_encoder_noise(less, 2.0, z)):
        assert again.samples == whole.samples - 2
        assert not again.residuals(z)[0, : len(gone)][gone].any()
