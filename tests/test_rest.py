"""A base that is declared to rest: the smoothed joints do not rest exactly, and the likelihood knows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from bayesid.inference.mode import fit, maximise
from bayesid.inference.parameterisation import LinearParameterisation
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from tests.conftest import ORBIT, PLANAR, POINT

SIGMA, ENCODER, RECORDINGS, SEEDS = 1e-5, 1e-6, 2, 2
"""Noise of rate and accelerometer [rad/s, m/s2] and of the encoders [rad]; recordings of one study; studies."""


@pytest.fixture(scope="module")
def flights() -> list[mj.Truth]:
    """Two manoeuvres in MuJoCo from true rest."""
    model = mj.TruthModel(PLANAR, orbit=ORBIT, accel_position=POINT)
    motions = [
        mj.smooth_motion(2, 40.0, seed=seed, amplitude=0.3, frequencies=(0.03, 0.05), ramp=20.0)
        for seed in range(RECORDINGS)
    ]
    return [model.run(motion, np.arange(0.0, 40.01, 0.5), step=0.1) for motion in motions]


def posterior_of(
    flights: list[mj.Truth], rng: np.random.Generator, *, speed_errors: bool, rate_sigma: float
) -> Posterior:
    robot = Robot.from_urdf(PLANAR)
    manoeuvres = []
    for number, truth in enumerate(flights):
        count = len(truth.times)
        channels = {f"position.joint{k + 1}": truth.position[:, k] + ENCODER * rng.normal(size=count) for k in range(2)}
        for family, values in (("rate", truth.rate), ("accel", truth.accel)):
            for k, axis in enumerate("xyz"):
                channels[f"{family}.{axis}"] = values[:, k] + SIGMA * rng.normal(size=count)
        recording = Recording(f"rest-{number}", None, truth.times, channels)
        motion = MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER})
        manoeuvres.append(Manoeuvre(recording, motion))
    model = Model(
        robot,
        (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT)),
        (BodyPrior("base_link", robot.link("base_link").inertial, 0.3),),
        Orbit(ORBIT.radius),
        (GravityGradient(),),
        rate_sigma=rate_sigma,
        speed_errors=speed_errors,
    )
    return Posterior.of(model, manoeuvres, step=0.5)


def score_of_released_rates(flights: list[mj.Truth], seed: int, *, speed_errors: bool) -> float:
    """Twice the gain of the log posterior when initial rates, truly zero, are let free: chi-square of 6 if honest."""
    costs = []
    for rate_sigma in (0.0, 0.1):
        rng = np.random.default_rng(seed)
        posterior = posterior_of(flights, rng, speed_errors=speed_errors, rate_sigma=rate_sigma)
        _, optimum = maximise(posterior, np.random.default_rng(0), np.zeros(posterior.size))
        costs.append(optimum.cost)
    return 2.0 * (costs[0] - costs[1])


@pytest.mark.slow
def test_a_base_at_rest_raises_no_alarm(flights):
    """Pooled over noises the score is chi-square of 12."""
    honest = sum(score_of_released_rates(flights, seed, speed_errors=True) for seed in range(SEEDS))
    degrees = 3 * RECORDINGS * SEEDS
    assert honest < degrees + 4.0 * np.sqrt(2.0 * degrees)


@pytest.mark.slow
def test_without_the_unknown_speeds_rest_would_raise_one(flights):
    naive = score_of_released_rates(flights, 0, speed_errors=False)
    assert naive > 5.0 * 3 * RECORDINGS


@pytest.mark.slow
def test_the_speeds_are_unknowns_where_the_rate_is_declared_zero(flights):
    posterior = posterior_of(flights, np.random.default_rng(1), speed_errors=True, rate_sigma=0.0)
    layout = posterior.unknowns.layout
    assert posterior.unknowns.names[layout.all_speeds] == tuple(
        f"initial-speed[{r}].joint{j + 1}" for r in range(RECORDINGS) for j in range(2)
    )
    sd = posterior.unknowns.speed_sigma[0][0]
    assert 1e-6 < sd < 1e-3  # of the order of the encoders' noise over the time the spline looks back
    model = posterior.model
    assert replace(model, speed_errors=None).has_speed_errors
    assert not replace(model, speed_errors=None, rate_sigma=0.1).has_speed_errors
    exact = Posterior.of(model, [replace(m, motion=_Exact(m.motion)) for m in posterior.manoeuvres], step=0.5)
    assert exact.unknowns.layout.joints == 0


@pytest.mark.slow
def test_the_bodies_are_covered(flights):
    """Squared distances of the true base over noises, 10 degrees of freedom each."""
    total = 0.0
    for seed in range(SEEDS):
        posterior = posterior_of(flights, np.random.default_rng(100 + seed), speed_errors=True, rate_sigma=0.0)
        optimum = fit(posterior, np.zeros(posterior.size))
        # in coordinates linear in the parameters, where the ridge that the data leave open is straight
        proposal, own = LinearParameterisation(posterior).proposal(optimum), posterior.unknowns.layout.all_bodies
        covariance = (proposal.factor @ proposal.factor.T)[own, own]
        miss = proposal.mean[own]  # the prior is centred at the truth
        total += float(miss @ np.linalg.solve(covariance, miss))
    assert total < 10.0 * SEEDS + 4.0 * np.sqrt(20.0 * SEEDS)


class _Exact:
    """A motion taken as exact."""

    def __init__(self, motion) -> None:
        self.motion = motion

    def evaluate(self, time):
        return self.motion.evaluate(time)


@pytest.mark.slow
def test_a_speed_error_is_the_momentum_of_that_joint(flights):
    """Against Pinocchio's centroidal momentum: a joint believed too fast by d lets the base start at - I^-1 h(d)."""
    posterior = posterior_of(flights[:1], np.random.default_rng(1), speed_errors=True, rate_sigma=0.0)
    unknowns, motion = posterior.unknowns, posterior.manoeuvres[0].motion
    robot = pin.buildModelFromUrdf(str(PLANAR), pin.JointModelFreeFlyer())
    data, q = robot.createData(), pin.neutral(robot)
    q[7:] = motion.evaluate(np.zeros(1)).position[0]
    for joint in range(2):
        z = np.zeros(unknowns.size)
        z[unknowns.layout.all_speeds.start + joint] = 2.0
        error = 2.0 * unknowns.speed_sigma[0][joint]
        pin.ccrba(robot, data, q, np.zeros(8))
        momentum = pin.computeCentroidalMomentum(robot, data, q, np.eye(8)[6 + joint] * error).angular
        expected = -np.linalg.solve(data.Ig.inertia, momentum)
        rate = predicted_readings(posterior, z)[0].rate[0] - predicted_readings(posterior, 0.0 * z)[0].rate[0]
        assert np.abs(expected).max() > 1e-6
        np.testing.assert_allclose(rate, expected, atol=1e-6 * np.abs(expected).max())
