"""Samples averaged over blocks: partition, the rule that predicts means, known actions, joints and the posterior."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bayesid._math.least_squares import levenberg_marquardt
from bayesid.diagnosis.noise import Outliers
from bayesid.diagnosis.noise.noise_fault import SensorResidual
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.inference.data import RecordedSamples
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings, simulate_recordings
from bayesid.inference.whitening import NoiseChannel
from bayesid.recording.actions import Actions
from bayesid.recording.blocks import Blocks
from bayesid.recording.lattice import lattice_step, mean_rounding_error
from bayesid.recording.recording import Recording
from bayesid.recording.smoothing import JointSamples, smooth
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Filter, Sensor, SensorKind, White
from studies.truth import mujoco as mj
from tests.conftest import PLANAR, POINT, SIGMA

EVERY = np.arange(0.0, 20.0, 0.01)


def jittered(seed: int = 1) -> np.ndarray:
    """Stamps of 100 Hz with jitter, single samples that are missing, and a gap."""
    rng = np.random.default_rng(seed)
    stamps = EVERY + rng.uniform(-0.003, 0.003, len(EVERY)) + 0.004
    kept = (rng.random(len(stamps)) > 0.03) & ((stamps < 7.0) | (stamps > 7.56))
    return stamps[kept]


@pytest.mark.parametrize("stamps", [EVERY, jittered()], ids=["even", "jitter and gaps"])
def test_two_nodes_give_the_mean_of_a_cubic_over_the_stamps(stamps):
    blocks = Blocks.of(stamps, 10.0)
    assert blocks.count.sum() == len(stamps)
    assert blocks.count.max() <= 10
    for power in range(4):
        apart = stamps - np.repeat(blocks.time, blocks.count)
        mean = (blocks.weight * (blocks.node - blocks.time[:, None]) ** power).sum(axis=1)
        np.testing.assert_allclose(mean, blocks.mean(apart**power), atol=1e-12)
    assert (blocks.node >= stamps[blocks.first][:, None] - 1e-12).all()


def test_slow_samples_are_kept_as_they_are():
    slow = EVERY[::6]  # 16.7 Hz: blocks of two samples would be 8.3 a second
    assert not Blocks.of(slow, 10.0).reduced
    assert not Blocks.of(EVERY, 0.0).reduced
    np.testing.assert_array_equal(Blocks.of(slow, 10.0).node[:, 0], slow)


def test_blocks_of_two_samples_are_predicted_from_these():
    blocks = Blocks.of(EVERY, 50.0)
    np.testing.assert_allclose(blocks.node.ravel(), EVERY, atol=1e-12)
    np.testing.assert_allclose(blocks.weight, 0.5)


def test_no_block_holds_a_break():
    blocks = Blocks.of(EVERY, 10.0, [0.333])
    last = EVERY[blocks.first + blocks.count - 1]
    assert not ((EVERY[blocks.first] < 0.333) & (last >= 0.333)).any()
    assert len(blocks.first) == len(Blocks.of(EVERY, 10.0).first) + 1


def test_the_mean_of_attitudes_is_that_of_small_rotations_whatever_the_sign_of_a_quaternion():
    angle = 0.02 * np.sin(EVERY[:10, None] * np.array([9.0, 5.0, 7.0]))
    quaternion = (Rotation.from_rotvec([0.4, -1.0, 0.3]) * Rotation.from_rotvec(angle)).as_quat()
    quaternion[::3] *= -1.0
    (mean,) = SensorKind.ATTITUDE.mean(quaternion, np.full(10, 0.1), np.array([0]))
    rest = (Rotation.from_quat(mean).inv() * Rotation.from_quat(quaternion)).as_rotvec().mean(axis=0)
    assert np.abs(rest).max() < 1e-6


def test_coloured_noise_of_means_has_the_covariance_of_averaged_samples():
    step, count, memory = 0.01, 10, 0.08
    time = step * np.arange(4 * count)
    every = np.exp(-np.abs(time[:, None] - time) / memory)
    average = np.kron(np.eye(4), np.full((1, count), 1.0 / count))
    channel = NoiseChannel(1.0, np.arange(4), Filter(), (1.0, memory), np.full(4, count), step)
    log_gain, variance = channel.coloured_moments(4)
    apart = step * count * np.abs(np.subtract.outer(np.arange(4), np.arange(4)))
    covariance = np.exp(log_gain[:, None] + log_gain - apart / memory)
    covariance[np.diag_indices(4)] = variance
    np.testing.assert_allclose(covariance, average @ every @ average.T, rtol=1e-10)


def wrench(force: np.ndarray) -> Recording:
    zero = np.zeros(len(EVERY))
    return Recording("held", None, EVERY, {"base_force.x": force, "base_force.y": zero, "base_force.z": zero})


def test_a_valve_keeps_every_change_and_a_noisy_force_its_impulse():
    valve = np.where((EVERY >= 3.333) & (EVERY < 4.127), 2.0, 0.0)
    np.testing.assert_allclose(Actions.from_recording(wrench(valve), per_second=10.0).changes, [3.34, 4.13], atol=1e-9)
    noisy = 1.0 + np.random.default_rng(1).normal(size=len(EVERY))
    actions = Actions.from_recording(wrench(noisy), per_second=10.0)
    assert len(actions.time) == 200
    impulse = (actions.wrench[:, 0] * np.diff(np.append(actions.time, 20.0))).sum()
    assert impulse == pytest.approx(noisy.sum() * 0.01, rel=1e-9)


def test_momentum_of_wheels_at_a_high_rate_is_averaged():
    spun = np.sin(0.3 * EVERY) + 1e-3 * np.random.default_rng(1).normal(size=len(EVERY))
    channels = {f"wheel_momentum.{axis}": spun for axis in "xyz"}
    actions = Actions.from_recording(Recording("wheels", None, EVERY, channels), per_second=10.0)
    assert len(actions.wheel_time) == 202
    momentum, torque = actions.wheels(EVERY[50:-50])
    assert np.abs(momentum[:, 0] - np.sin(0.3 * EVERY[50:-50])).std() < 5e-4
    assert np.abs(torque[:, 0] - 0.3 * np.cos(0.3 * EVERY[50:-50])).std() < 0.02


def swing(time: np.ndarray) -> np.ndarray:
    return 0.3 * np.sin(0.7 * time) ** 3


@pytest.mark.parametrize("rate", [50.0, 1000.0])
def test_smoothed_joints_are_as_sure_at_any_rate_as_their_noise_density_says(rate):
    rng = np.random.default_rng(5)
    at = np.linspace(2.0, 18.0, 81)
    spreads = []
    for frequency in (10.0, rate):
        time, sigma = np.arange(0.0, 20.0, 1.0 / frequency), 1e-6 * np.sqrt(frequency)
        samples = JointSamples(0, time, swing(time) + sigma * rng.normal(size=len(time)), sigma)
        joint = smooth([samples.reduced(10.0)])
        spreads.append(joint.standard_deviation(at))
        error = (joint.evaluate(at)[0] - swing(at)) / spreads[-1][0]
        assert 0.7 < np.sqrt((error**2).mean()) < 1.35
    assert joint.samples == 200
    np.testing.assert_allclose(spreads[1][0], spreads[0][0], rtol=0.1)


def test_a_short_block_at_the_end_costs_no_digits():
    time, rng = np.arange(0.0, 140.005, 0.01), np.random.default_rng(6)
    slow = 0.3 * np.sin(0.2 * time) ** 3 + 7e-6 * rng.normal(size=len(time))
    joint = smooth([JointSamples(0, time, slow, 7e-6).reduced(10.0)], orders=(5,))
    assert np.diff(joint.nodes)[-1] < 0.6 * np.diff(joint.nodes)[0]  # blocks of ten samples, the last of a single one
    parabola = JointSamples(0, time, 1e-3 * (time - 70.0) ** 2, 7e-6).reduced(10.0)
    exact = replace(joint, series=(parabola,)).with_roughness(np.ones(len(joint.nodes) - 1))
    assert exact.chi2 < 1e-3  # a motion without any noise of the process


def test_means_of_position_and_speed_over_long_blocks_are_no_values_at_their_centre():
    time = np.arange(0.0, 20.0, 0.01)
    speed = np.gradient(swing(time), time, edge_order=2)
    both = [JointSamples(0, time, swing(time), 1e-7), JointSamples(1, time, speed, 1e-3)]
    joint = smooth([one.reduced(2.5) for one in both])
    at = np.linspace(2.0, 18.0, 81)
    error = joint.evaluate(at)[0] - swing(at)
    centre = smooth([replace(one.reduced(2.5), means=None) for one in both]).evaluate(at)[0] - swing(at)
    assert np.abs(error).max() < 0.05 * np.abs(centre).max()


def test_rounding_is_white_only_where_the_motion_crosses_steps():
    step, time = 1e-3, np.arange(0.0, 40.0, 0.002)
    slow = np.where(time < 20.0, 1e-4 * time, 2e-3 + 0.05 * (time - 20.0))
    samples = JointSamples(0, time, step * np.round(slow / step), step / np.sqrt(12.0)).reduced(10.0)
    truth = Blocks.of(time, 10.0).mean(slow)
    deviation = samples.sigma * samples.relative
    still = samples.time < 19.9
    assert np.sqrt(((samples.value - truth)[still] ** 2).mean()) == pytest.approx(deviation[still].mean(), rel=0.25)
    assert np.sqrt(((samples.value - truth)[~still] ** 2).mean()) < deviation[~still][5:].mean()
    assert deviation[~still][5:].mean() < 0.35 * deviation[still].mean()


@pytest.mark.parametrize("crossed", [0.0, 0.3, 1.5, 4.5])
def test_the_mean_of_rounding_errors_has_the_stated_variance(crossed):
    phase = np.arange(400) / 400.0
    at = phase[:, None] + crossed * (np.arange(2000) + 0.5) / 2000.0
    error = (np.round(at) - at).mean(axis=1)
    assert error.std() == pytest.approx(float(mean_rounding_error(1.0, np.array([crossed]), 0.0)[0]), rel=0.02)
    noise = 0.3 * np.random.default_rng(1).normal(size=(400, 2000))
    dithered = (np.round(at + noise) - at - noise).mean(axis=1).std()
    assert dithered < 1.2 * np.hypot(mean_rounding_error(1.0, np.array([crossed]), 0.3)[0], np.sqrt(1.0 / 12.0 / 2000))


def test_only_readings_on_a_lattice_have_a_step():
    rng = np.random.default_rng(1)
    assert lattice_step(0.25 * rng.integers(0, 40, 1000)) == pytest.approx(0.25)
    assert lattice_step(rng.normal(size=1000)) is None


@pytest.fixture(scope="module")
def recorded(formula_motion) -> SimpleNamespace:
    """The planar robot of MuJoCo for 30 s at 50 Hz, with noise of the sensors, its joints' motion and a guess."""
    motion = mj.smooth_motion(2, 30.0, seed=11, amplitude=0.3, frequencies=(0.1, 0.17), ramp=8.0)
    time = np.arange(0.0, 30.001, 0.02)
    truth = mj.TruthModel(PLANAR, accel_position=POINT).run(motion, time, rate0=(0.01, -0.02, 0.015), step=0.02)
    rng = np.random.default_rng(3)
    channels = {f"position.joint{index + 1}": truth.position[:, index] for index in range(2)}
    for family, values in (("rate", truth.rate), ("accel", truth.accel)):
        for index, axis in enumerate("xyz"):
            channels[f"{family}.{axis}"] = values[:, index] + SIGMA * rng.normal(size=len(time))
    robot = Robot.from_urdf(PLANAR).perturbed("base_link", 0.1, np.random.default_rng(1))
    sensors = (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT))
    model = Model(robot, sensors, (BodyPrior("base_link", robot.link("base_link").inertial, 0.3),))
    recording = Recording("planar", None, time, channels)
    return SimpleNamespace(model=model, manoeuvre=Manoeuvre(recording, formula_motion(motion, PLANAR, robot)))


def posterior_of(case: SimpleNamespace, per_second: float) -> Posterior:
    manoeuvre = replace(case.manoeuvre, blocks_per_second=per_second)
    return Posterior.of(case.model, [manoeuvre], step=0.25, window=0)


@pytest.mark.slow
def test_a_model_predicts_the_means_of_what_it_predicts_for_every_sample(recorded):
    every, means = posterior_of(recorded, 0.0), posterior_of(recorded, 10.0)
    z = every.starting_point()
    blocks = means.data.recorded[0].blocks["accel"]
    assert blocks.typical == 5
    (fine,), (coarse,) = predicted_readings(every, z), predicted_readings(means, z)
    for family in ("rate", "accel"):
        np.testing.assert_allclose(getattr(coarse, family), blocks.mean(getattr(fine, family)), atol=2e-3 * SIGMA)
    measured = means.data.measured(0, SensorKind.ACCEL)[1]
    np.testing.assert_allclose(measured, blocks.mean(every.data.measured(0, SensorKind.ACCEL)[1]))
    expected = (measured - coarse.accel) / (SIGMA / np.sqrt(blocks.count))[:, None]
    np.testing.assert_allclose(means.residuals(z)[0, : len(measured), 3:], expected, rtol=1e-5)
    (simulated,) = simulate_recordings(means, z=z)
    assert len(simulated.time) == len(fine.time)


@pytest.fixture(scope="module")
def spiked(recorded) -> SimpleNamespace:
    """The same recording with four garbled readings of the rate."""
    recording = recorded.manoeuvre.recording
    rate = np.array(recording.channels["rate.y"])
    rate[[200, 480, 900, 1310]] += np.array([40.0, -25.0, 60.0, 30.0]) * SIGMA
    channels = {**recording.channels, "rate.y": rate}
    garbled = Recording("spiked", None, recording.time, channels)
    return SimpleNamespace(model=recorded.model, manoeuvre=replace(recorded.manoeuvre, recording=garbled))


def samples_of(case: SimpleNamespace) -> RecordedSamples:
    return RecordedSamples.of(case.model, replace(case.manoeuvre, blocks_per_second=5.0))


def test_spikes_are_in_no_mean(recorded, spiked):
    whole, some = samples_of(recorded), samples_of(spiked)
    assert len(whole.spikes["rate"]) == 0
    assert np.sort(some.spikes["rate"]) == pytest.approx([25.0, 30.0, 40.0, 60.0], rel=0.15)
    assert some.blocks["rate"].count.sum() == 1501 - 4
    assert not np.isin(whole.blocks["rate"].stamps[[200, 480, 900, 1310]], some.blocks["rate"].stamps).any()
    row = np.searchsorted(some.blocks["rate"].first, 480, side="right") - 1
    kept = np.delete(np.arange(480, 490), 0)
    readings = spiked.manoeuvre.recording.vector("rate")[1]
    np.testing.assert_allclose(some.series[SensorKind.RATE][1][row], readings[kept].mean(axis=0), rtol=1e-12)


@pytest.mark.slow
def test_spikes_at_the_full_rate_count_as_outliers(spiked):
    posterior = posterior_of(spiked, 5.0)
    calm, fault = SensorResidual(900.0, 900.0, [np.zeros(300)] * 3), Outliers(SensorKind.RATE)
    assert fault.log_p_of(calm, posterior) < -1000.0
    fitted = fault.measured(PerturbedModel(posterior).fit())
    assert fitted.mean[0] == pytest.approx(4.0 / 1501.0, rel=0.01)
    assert fitted.log_charge > 1000.0


@pytest.mark.slow
def test_means_over_blocks_determine_a_body_as_every_sample_does(recorded):
    modes = {}
    for per_second in (0.0, 10.0):
        posterior = posterior_of(recorded, per_second)
        start = posterior.starting_point()
        mode = levenberg_marquardt(posterior.least_squares, posterior.jacobian, start, 1e-9, 100).x
        slopes = posterior.jacobian(mode)
        modes[per_second] = mode, np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    (every, sd), (means, wider) = modes[0.0], modes[10.0]
    assert (np.abs(means - every) / sd).max() < 0.1
    np.testing.assert_allclose(wider, sd, rtol=0.01)
