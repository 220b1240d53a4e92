"""The whole planar robot as unknown: systems drawn from the prior, flown by MuJoCo, and whether they are recovered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from bayesid.inference import identify
from bayesid.inference.body_quantities import bodies_of
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.inference.parameterisation import LinearParameterisation, StudentT
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior, draw_inertial
from bayesid.robot.robot import Robot
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from tests.conftest import ENCODER, PLANAR, POINT, SIGMA, STEP

SPREAD = 0.05
TORQUE = 1e-2
TIMES = np.arange(0.0, 40.01, 0.5)
RATE0 = np.array([0.01, -0.02, 0.015])
JOINTS = ("joint1", "joint2")


def drawn(rng: np.random.Generator) -> Robot:
    """A robot of the prior about the planar one: every body unknown."""
    robot = Robot.from_urdf(PLANAR)
    for name, link in Robot.from_urdf(PLANAR).links.items():
        if link.inertial.mass > 0.0:
            robot = robot.with_inertial(name, draw_inertial(link.inertial, SPREAD, rng))
    return robot


def truth_of(robot: Robot, folder: Path) -> mj.Truth:
    urdf = folder / "drawn.urdf"
    robot.write_urdf(urdf)
    motion = mj.smooth_motion(2, 40.0, seed=11, amplitude=0.3, frequencies=(0.03, 0.05), ramp=20.0)
    return mj.TruthModel(urdf, accel_position=POINT).run(motion, TIMES, rate0=RATE0, step=0.1)


def flown(robot: Robot, folder: Path, rng: np.random.Generator) -> Manoeuvre:
    run, channels = truth_of(robot, folder), {}
    for k, joint in enumerate(JOINTS):
        channels[f"position.{joint}"] = run.position[:, k] + ENCODER * rng.normal(size=len(TIMES))
        channels[f"torque.{joint}"] = run.torque[:, k] + TORQUE * rng.normal(size=len(TIMES))
    for family, values in (("rate", run.rate), ("accel", run.accel)):
        noisy = values + SIGMA * rng.normal(size=values.shape)
        channels |= {f"{family}.{axis}": noisy[:, k] for k, axis in enumerate("xyz")}
    recording = Recording("drawn", None, TIMES, channels)
    return Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER}))


def model(torque: bool) -> Model:
    robot = Robot.from_urdf(PLANAR)
    priors = tuple(
        BodyPrior(name, link.inertial, SPREAD) for name, link in robot.links.items() if link.inertial.mass > 0.0
    )
    sensors = (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT))
    bare = Model(robot, sensors, priors)
    return replace(bare, torque=TorqueSensor(JOINTS, (TORQUE,) * 2)) if torque else bare


def true_point(posterior: Posterior, robot: Robot) -> np.ndarray:
    bodies = [robot.link(prior.name).inertial for prior in posterior.model.priors]
    return posterior.unknowns.coordinates(bodies, RATE0[None])


def squared_distance(posterior: Posterior, normal: StudentT, z: np.ndarray) -> tuple[float, int]:
    """Of the bodies, in coordinates linear in their parameters, and how many these are.

    The initial rate is left out: what is estimated is the rate that goes with the smoothed joint speed at time 0.
    """
    count = 10 * len(posterior.model.priors)
    covariance = (normal.factor @ normal.factor.T)[:count, :count]
    d = (posterior.unknowns.to_linear(z[None])[0] - normal.mean)[:count]
    return float((np.linalg.solve(np.linalg.cholesky(covariance), d) ** 2).sum()), count


def total_mass(posterior: Posterior, draws: np.ndarray) -> float:
    """Relative standard deviation of the mass of the whole system over draws (n, size) of the coordinates."""
    totals = sum(body.values[:, 0] for body in bodies_of(posterior, draws).values())
    return float(np.std(totals) / np.mean(totals))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory) -> Callable[[bool], Posterior]:
    """Posteriors of motion alone and of motion with torques, whose compiled functions all cases share."""
    made: dict[bool, Posterior] = {}

    def get(torque: bool) -> Posterior:
        if torque not in made:
            rng = np.random.default_rng(0)
            manoeuvre = flown(drawn(rng), tmp_path_factory.mktemp("first"), rng)
            made[torque] = Posterior.of(model(torque), [manoeuvre], step=STEP)
        return made[torque]

    return get


@pytest.mark.slow
def test_the_uncertainty_from_motion_and_torques_holds_the_truth(compiled, tmp_path):
    check_distances(compiled(True), tmp_path)


def check_distances(first: Posterior, folder: Path) -> None:
    """Squared distances of the truth over fresh systems and fresh noise are chi-square."""
    count, distances = 12, []
    for stream in np.random.SeedSequence(7).spawn(count):
        rng = np.random.default_rng(stream)
        robot = drawn(rng)
        posterior = with_manoeuvres(first, [flown(robot, folder, rng)])
        z = true_point(posterior, robot)
        optimum = fit(
            relinearised(posterior, z), z
        )  # from the truth, to save time; the next test starts at the prior's centre
        square, bodies = squared_distance(posterior, LinearParameterisation(posterior).proposal(optimum), z)
        distances.append(square)
    reference = stats.chi2(bodies)
    assert stats.kstest(distances, reference.cdf).pvalue > 0.01
    assert abs(np.mean(distances) - reference.mean()) < 3.0 * reference.std() / np.sqrt(count)


@pytest.mark.usefixtures("slow")
def test_emcee_samples_all_bodies_and_torques_bring_the_scale(compiled, tmp_path):
    """From the prior's centre, with every diagnostic of convergence, and the truth inside."""
    rng = np.random.default_rng(3)
    robot = drawn(rng)
    manoeuvre = flown(robot, tmp_path, rng)
    widths = {}
    for torque in (False, True):
        posterior = with_manoeuvres(compiled(torque), [manoeuvre])
        result = identify(posterior, 1, effective_samples=400.0)
        assert result.chains.converged
        assert result.chains.r_hat < 1.02
        assert result.evidence.trusted
        draws = posterior.unknowns.to_linear(result.chains.flat)
        square, bodies = squared_distance(
            posterior, StudentT.about(draws.mean(axis=0), np.cov(draws.T)), true_point(posterior, robot)
        )
        assert stats.chi2(bodies).sf(square) > 1e-3
        widths[torque] = total_mass(posterior, result.chains.flat)
    # motion fixes ratios: three masses known to 2 x 5 % each are pooled, and nothing says more of the scale
    pooled = 2.0 * SPREAD / np.sqrt(3.0)
    assert widths[False] == pytest.approx(pooled, rel=0.2)
    # a torque goes with the scale, so that no estimate of it beats noise over torque
    limit = TORQUE / np.linalg.norm(truth_of(robot, tmp_path).torque)
    assert widths[True] == pytest.approx((pooled**-2 + limit**-2) ** -0.5, rel=0.1)
