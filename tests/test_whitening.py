"""The whitening of encoder noise against dense Gaussians, and against full errors-in-variables."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg as sla

from bayesid._io.errors import InputError
from bayesid.inference.mode import maximise
from bayesid.inference.posterior import Posterior
from bayesid.inference.whitening import MotionErrors, NoiseChannel, SampleNoise, Whitening, Window, apply, build
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.recording.smoothing import JointSamples, smooth
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import Start, simulate
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Filter, Sensor, SensorKind, White
from bayesid.simulation.time_grid import build_grid
from studies.truth import mujoco as mj
from tests.sensed import read

PLANAR = Path(__file__).resolve().parents[1] / "bayesid" / "robot" / "models" / "planar.urdf"
TIME = np.arange(0.0, 20.0, 0.5)


# against dense Gaussians ----------------------------------------------------------------------------------------------


def noise_model(channels: list[NoiseChannel], time: np.ndarray = TIME, encoder: float = 1e-5) -> SampleNoise:
    """Two joints with a random sensitivity; encoder noise that matters beside channels of 1e-5."""
    rng = np.random.default_rng(0)
    joints = []
    for index in range(2):
        value = 0.3 * np.sin(0.4 * time + index) + encoder * rng.normal(size=len(time))
        joints.append(smooth([JointSamples(0, time, value, encoder)]).lag_covariance(time, len(time) - 1))
    sensitivity = rng.normal(size=(2, 3, len(time), len(channels)))
    return SampleNoise(time, channels, [MotionErrors(sensitivity, np.stack(joints))])


def dense(noise: SampleNoise) -> np.ndarray:
    """Covariance of all channels at all rows of the grid, index (row, channel), written out."""
    count, channels = len(noise.time), len(noise.channels)
    total = np.zeros((count, channels, count, channels))
    (errors,) = noise.errors
    for g, own in zip(*errors, strict=True):
        for late in range(count):
            for early in range(late + 1):
                block = g[:, late].T @ own[late - early, late] @ g[:, early]
                total[late, :, early] += block
                if late != early:
                    total[early, :, late] += block.T
    for index, channel in enumerate(noise.channels):
        total[np.arange(count), index, np.arange(count), index] += channel.sigma**2
        level, memory = channel.coloured
        total[:, index, :, index] += level**2 * np.exp(-np.abs(noise.time[:, None] - noise.time) / memory)
    return total.reshape(count * channels, -1)


def operator(result: Whitening, count: int) -> np.ndarray:
    """The whitening as one matrix, outputs x (row, channel)."""
    _, channels, width, _ = result.weights.shape
    matrix = np.zeros((len(result.start), channels, count + width, channels))
    for block, start in enumerate(result.start):
        matrix[block, :, start : start + width] += result.weights[block]
    return matrix[:, :, :count].reshape(len(result.start) * channels, -1)[result.outputs.ravel()]


EVERY = np.arange(len(TIME))
SOME = np.delete(np.arange(0, len(TIME), 2), [3, 4, 5])
LOW = Filter(0.25, 3)
CASES = {
    "plain": [NoiseChannel(1e-5, EVERY, Filter()), NoiseChannel(2e-5, EVERY, Filter())],
    "different rows": [NoiseChannel(1e-5, EVERY, Filter()), NoiseChannel(2e-5, SOME, Filter())],
    "one coloured": [NoiseChannel(1e-5, EVERY, Filter(), (2e-5, 3.0)), NoiseChannel(2e-5, SOME, Filter())],
    "filtered and coloured": [NoiseChannel(1e-5, EVERY, LOW, (2e-5, 2.0)), NoiseChannel(2e-5, SOME, Filter())],
    "filtered": [NoiseChannel(1e-5, EVERY, LOW), NoiseChannel(2e-5, EVERY, Filter(0.4, 2))],
}


@pytest.mark.parametrize("case", ["plain", "different rows", "one coloured"])
def test_with_the_full_window_it_is_the_exact_gaussian(case):
    """Log determinant and quadratic form of the dense covariance over the samples that exist, to rounding."""
    noise = noise_model(CASES[case])
    result = build(noise, Window(len(TIME)))
    present = np.zeros((len(TIME), len(noise.channels)), dtype=bool)
    for index, channel in enumerate(noise.channels):
        present[channel.rows, index] = True
    covariance = dense(noise)[np.ix_(present.ravel(), present.ravel())]
    assert result.samples == present.sum() == len(covariance)
    assert result.log_sigma == pytest.approx(0.5 * np.linalg.slogdet(covariance)[1], abs=1e-7)
    residual = np.random.default_rng(1).normal(size=present.shape) * 1e-5
    padded = np.concatenate([residual, np.zeros((result.weights.shape[2], residual.shape[1]))])
    white = np.asarray(apply(jnp.asarray(result.weights), jnp.asarray(result.start), jnp.asarray(padded)))
    own = residual[present]
    assert (white**2).sum() == pytest.approx(own @ np.linalg.solve(covariance, own), rel=1e-8)


@pytest.mark.parametrize("case", CASES)
def test_with_the_full_window_outputs_are_white(case):
    """The covariance of all outputs is the identity, filters and decimation included."""
    noise = noise_model(CASES[case])
    matrix = operator(build(noise, Window(len(TIME))), len(TIME))
    np.testing.assert_allclose(matrix @ dense(noise) @ matrix.T, np.eye(len(matrix)), atol=1e-7)


@pytest.mark.parametrize("case", CASES)
def test_the_chosen_window_is_long_enough(case):
    """Each output has unit variance whatever the window; the log determinant is exact to 1e-3 per scalar."""
    noise = noise_model(CASES[case])
    chosen, exact = build(noise), build(noise, Window(len(TIME)))
    matrix = operator(chosen, len(TIME))
    covariance = matrix @ dense(noise) @ matrix.T
    np.testing.assert_allclose(np.diag(covariance), 1.0, atol=1e-9)
    assert 0.0 <= chosen.log_sigma - exact.log_sigma + 1e-9 < 1e-3 * exact.samples
    assert build(noise, Window(0)).log_sigma > chosen.log_sigma + 1e-3 * exact.samples  # correlation is there


def test_filtered_noise_is_white_in_a_monte_carlo():
    """Chi-square of simulated noise over 400 seeds: mean and variance of chi2(samples), within 4.5 standard errors."""
    channels = CASES["filtered"]
    noise = noise_model(channels)
    result = build(noise)
    root = np.linalg.cholesky(dense(noise))
    draws = (root @ np.random.default_rng(2).normal(size=(len(root), 400))).T.reshape(400, len(TIME), 2)
    padded = np.concatenate([draws, np.zeros((400, result.weights.shape[2], 2))], axis=1)
    white = np.asarray(jax.vmap(apply, (None, None, 0))(jnp.asarray(result.weights), jnp.asarray(result.start), padded))
    chi2, n = (white**2).sum(axis=(1, 2)), result.samples
    assert n < 0.6 * 2 * len(TIME)  # decimated
    assert abs(chi2.mean() - n) < 4.5 * np.sqrt(2.0 * n / 400)
    assert abs(chi2.var() / (2.0 * n) - 1.0) < 4.5 * np.sqrt(2.0 / 400) + 12.0 / n


def test_a_filter_does_not_reach_across_a_gap():
    """Each side of the gap gives what it gives alone, and rows in the gap are never read."""
    time = np.arange(0.0, 60.0, 0.5)
    gap = np.arange(50, 60)
    rows = np.delete(np.arange(len(time)), gap)
    plain = Filter(0.25)
    noise = SampleNoise(time, [NoiseChannel(1.0, rows, plain)])
    result = build(noise, Window(0))
    half = len(plain.taps(0.5)) // 2
    expected = [*range(half, 50 - half), *range(60 + half, len(time) - half)]
    np.testing.assert_array_equal(result.rows, expected)
    matrix = operator(result, len(time))
    assert not matrix[:, gap].any()
    for line, row in zip(matrix, result.rows, strict=True):
        used = np.flatnonzero(line)
        assert (used < 50).all() if row < 50 else (used >= 60).all()


def test_a_filter_longer_than_the_record_is_refused():
    noise = noise_model([NoiseChannel(1e-5, EVERY[:20], Filter(0.05))])
    with pytest.raises(InputError, match=r"the low-pass filter needs 133 evenly spaced samples, but no section"):
        build(noise)


# against errors in variables ------------------------------------------------------------------------------------------

SIGMA, LOUD, POINT = 1e-5, 1e-4, (0.1, -0.15, 0.3)


def planar_run(seed: int, duration: float, period: float) -> mj.Truth:
    """The planar robot, moving as gently as a space robot does (0.3 rad) and tumbling slowly, away from orbit."""
    motion = mj.smooth_motion(2, duration, seed=seed, amplitude=0.3, frequencies=(0.05, 0.09), ramp=duration / 4.0)
    times = np.round(np.arange(0.0, duration + 0.01, period), 9)
    return mj.TruthModel(PLANAR, accel_position=POINT).run(motion, times, rate0=(0.01, -0.02, 0.015), step=0.1)


def loud_posterior(truth: mj.Truth, encoder: float, step: float | None = None) -> Posterior:
    """The planar robot with encoders so noisy that they matter more than the sensors."""
    rng, channels = np.random.default_rng(5), {}
    for index in range(2):
        channels[f"position.joint{index + 1}"] = truth.position[:, index] + encoder * rng.normal(size=len(truth.times))
    for family, values in (("rate", truth.rate), ("accel", truth.accel)):
        for index, axis in enumerate("xyz"):
            channels[f"{family}.{axis}"] = values[:, index] + SIGMA * rng.normal(size=len(values))
    recording = Recording("loud", None, truth.times, channels)
    robot = Robot.from_urdf(PLANAR)
    motion = MeasuredMotion.from_recording(recording, robot, sigma={0: encoder})
    sensors = (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT))
    prior = BodyPrior("base_link", robot.link("base_link").inertial, 0.3)
    return Posterior.of(Model(robot, sensors, (prior,)), [Manoeuvre(recording, motion)], step=step)


def trajectory_basis(joint) -> np.ndarray:
    """Directions of the states' posterior that the first two derivatives feel, (nodes x order, k), unit normal."""
    size = joint.states.size
    covariance = sla.cho_solve_banded((joint.factor, True), np.eye(size))
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    felt = root.reshape(-1, joint.order, size)[:, :3].reshape(-1, size)
    _, singular, right = np.linalg.svd(felt, full_matrices=False)
    return root @ right[singular > 2e-2 * singular[0]].T


@pytest.mark.usefixtures("slow")  # a fit of every joint sample beside the bodies
def test_marginalised_encoder_noise_equals_errors_in_variables():
    """Minimise over the base and over both joints' whole trajectories at once, and compare.

    The trajectories' prior is the smoothing posterior, so this is the full problem, linearised about the optimum. With
    encoders of 1e-4 rad beside sensors of 1e-5, a hundred times the usual, measured: inertial parameters apart by up to
    0.14 of their standard deviation, standard deviations by 1.5 %, the variance along the worst direction by 31 %, the
    whitening being the wider. The bounds are those figures with a margin.
    """
    truth = planar_run(11, 30.0, 0.5)
    posterior = loud_posterior(truth, LOUD, step=0.5)
    refined, optimum = maximise(posterior, np.random.default_rng(0))
    manoeuvre, robot, model = posterior.manoeuvres[0], posterior.model.robot, posterior.model
    joints, time = manoeuvre.motion.joints, truth.times
    bases = [trajectory_basis(joint) for joint in joints]
    sizes = [basis.shape[1] for basis in bases]

    def grid_at(eta: np.ndarray):
        moved, first = [], 0
        for joint, basis in zip(joints, bases, strict=True):
            change = basis @ eta[first : first + basis.shape[1]]
            moved.append(replace(joint, states=joint.states + change.reshape(joint.states.shape)))
            first += basis.shape[1]
        motion = MeasuredMotion(tuple(moved), manoeuvre.motion.names)
        return build_grid(robot, ("base_link",), motion, time, 0.5)

    def readings(z, grid):
        values = posterior.unknowns.values(z)
        start = Start(jnp.asarray(manoeuvre.attitude), values.rate[0])
        point = jnp.asarray(model.sensor(SensorKind.ACCEL).position)
        found = read(simulate(grid, values.inertial, start, model.effects, values.effects, point[None]), point)
        return jnp.concatenate([found.rate, found.accel], axis=1).ravel()

    compiled, slope = jax.jit(readings), jax.jit(jax.jacfwd(readings))
    measured = np.concatenate([manoeuvre.recording.vector(family)[1] for family in ("rate", "accel")], axis=1).ravel()
    z, eta, h = optimum.z.copy(), np.zeros(sum(sizes)), 1e-2
    for _ in range(1):
        grid = grid_at(eta)
        reading = np.asarray(compiled(z, grid))
        moved = [np.asarray(compiled(z, grid_at(eta + h * e))) for e in np.eye(len(eta))]
        along = (np.stack(moved, axis=1) - reading[:, None]) / h
        jacobian = np.concatenate([np.asarray(slope(z, grid)), along], axis=1) / SIGMA
        unknown = np.concatenate([z, eta])
        hessian = jacobian.T @ jacobian + np.eye(len(unknown))
        step = np.linalg.solve(hessian, jacobian.T @ (measured - reading) / SIGMA - unknown)
        z, eta = z + step[: len(z)], eta + step[len(z) :]
    covariance = np.linalg.inv(hessian)[:10, :10]
    sd, own = np.sqrt(np.diag(covariance)), np.sqrt(np.diag(optimum.covariance))[:10]
    shift = np.abs(optimum.z[:10] - z[:10]) / sd
    own_part = jacobian[:, : len(z)]
    deaf = np.sqrt(np.diag(np.linalg.inv(own_part.T @ own_part + np.eye(len(z)))))[:10] / sd
    print("shift", shift.max(), "sd", own / sd, "without encoder noise", deaf)
    assert shift.max() < 0.2
    np.testing.assert_allclose(own / sd, 1.0, atol=0.03)
    relative = np.linalg.solve(covariance, optimum.covariance[:10, :10])
    assert np.abs(np.linalg.eigvals(relative) - 1.0).max() < 0.35
    # the encoders matter: without them some errors would be less than two thirds as large
    assert deaf.min() < 0.67
    assert refined.samples == len(measured)


@pytest.mark.slow
def test_clean_data_have_a_chi_square_near_one_where_the_encoder_dominates():
    """10 Hz and 1e-5 rad: the joints' acceleration is worth more than the accelerometer's noise; 4 standard errors."""
    posterior = loud_posterior(planar_run(4, 12.0, 0.1), 1e-5)
    refined, optimum = maximise(posterior, np.random.default_rng(0))
    freedom = posterior.samples - posterior.size
    print("chi2 per sample", optimum.chi2 / freedom)
    assert abs(optimum.chi2 / freedom - 1.0) < 4.0 * np.sqrt(2.0 / freedom)
    # the whitened residual of the accelerometer alone, as well
    white = refined.residuals(optimum.z)[0]
    assert abs((white[:, 3:] ** 2).mean() - 1.0) < 4.0 * np.sqrt(2.0 / white[:, 3:].size) + 13.0 / white[:, 3:].size


def test_what_is_left_out_is_in_no_sum():
    """The last samples left out: log determinant and scalars are those of the covariance of the others."""
    noise = noise_model(CASES["plain"])
    whole = build(noise, Window(len(TIME)))
    gone = np.zeros_like(whole.outputs)
    gone[-7:] = True
    rest = whole.without(gone)
    kept = dense(noise)[: -7 * len(noise.channels), : -7 * len(noise.channels)]
    assert rest.samples == len(kept)
    assert rest.log_sigma == pytest.approx(0.5 * np.linalg.slogdet(kept)[1], abs=1e-7)
    matrix = operator(rest, len(TIME))
    assert not matrix[:, -7 * len(noise.channels) :].any()
    own = matrix[:, : len(kept)]
    np.testing.assert_allclose(own @ kept @ own.T, np.eye(len(kept)), atol=1e-7)
