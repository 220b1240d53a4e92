"""A turned star sensor: rotations by SciPy, and in a fit of MuJoCo's readings with exact and unknown start."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bayesid.inference.mode import maximise
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import AttitudeMisalignment, Readings
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth.bodies import SERVICER3

TRUE = np.array([0.02, -0.035, 0.015])
TIMES = np.arange(0.0, 60.01, 1.0)
SIGMA = 1e-5


@pytest.mark.parametrize("size", [1e-6, 1e-2, 0.1])
def test_the_reading_is_the_true_attitude_turned_in_base_axes(size):
    attitudes = Rotation.random(20, np.random.default_rng(0))
    vector = size * np.array([0.6, -0.48, 0.64])
    readings = Readings(jnp.arange(20.0), {"attitude": jnp.asarray(attitudes.as_quat())}, jnp.zeros((20, 0)))
    found = AttitudeMisalignment().read(jnp.asarray(vector), readings).attitude
    error = (Rotation.from_quat(np.asarray(found)).inv() * attitudes * Rotation.from_rotvec(vector)).magnitude()
    assert error.max() < 1e-9
    differ = [SensorKind.ATTITUDE.residual(a, b) for a, b in zip(found, readings.attitude, strict=True)]
    np.testing.assert_allclose(differ, np.broadcast_to(vector, (20, 3)), atol=1e-3 * size)


def test_it_occurs_only_where_an_attitude_is_measured():
    robot, rate = Robot.from_urdf(SERVICER3), Sensor(SensorKind.RATE, White(SIGMA))
    assert not AttitudeMisalignment.instances(Model(robot, (rate,), ()))
    assert AttitudeMisalignment.instances(Model(robot, (rate, Sensor(SensorKind.ATTITUDE, White(SIGMA))), ()))


@pytest.mark.slow
@pytest.mark.parametrize("attitude_sigma", [0.0, 0.05])
def test_it_is_found_with_an_exact_and_with_an_unknown_start(attitude_sigma):
    """Three parameters within 16.3 of chi-square (once in 1,000); an unknown start makes it less certain."""
    robot, rng = Robot.from_urdf(SERVICER3), np.random.default_rng(2)
    motion = mj.smooth_motion(3, 60.0, 5, amplitude=0.5, frequencies=(0.03, 0.06), ramp=10.0)
    truth = mj.TruthModel(SERVICER3).run(motion, TIMES, rate0=(0.02, -0.03, 0.015), step=0.1)
    turned = Rotation.from_quat(truth.attitude) * Rotation.from_rotvec(TRUE)
    measured = (turned * Rotation.from_rotvec(SIGMA * rng.normal(size=(len(TIMES), 3)))).as_quat()
    channels = {f"position.joint{i + 1}": truth.position[:, i] + 1e-6 * rng.normal(size=len(TIMES)) for i in range(3)}
    channels |= {f"attitude.{axis}": measured[:, i] for i, axis in enumerate("xyzw")}
    for index, axis in enumerate("xyz"):
        channels[f"rate.{axis}"] = truth.rate[:, index] + SIGMA * rng.normal(size=len(TIMES))
    recording = Recording("turned", None, TIMES, channels)
    manoeuvre = Manoeuvre(
        recording, MeasuredMotion.from_recording(recording, robot, sigma={0: 1e-6}), attitude_sigma=attitude_sigma
    )
    sensors = tuple(Sensor(kind, White(SIGMA)) for kind in (SensorKind.RATE, SensorKind.ATTITUDE))
    posterior = Posterior.of(Model(robot, sensors, (), effects=(AttitudeMisalignment(),)), [manoeuvre], step=0.5)
    refined, optimum = maximise(posterior, np.random.default_rng(0))
    start = refined.unknowns.names.index("attitude-misalignment.x")
    values = np.asarray(refined.unknowns.values_at(optimum.z).effects[0])
    covariance = optimum.covariance[start : start + 3, start : start + 3] * 0.03**2
    assert (values - TRUE) @ np.linalg.solve(covariance, values - TRUE) < 16.3
    assert 0.7 < optimum.chi2 / refined.samples < 1.3
    largest = np.sqrt(np.diag(covariance)).max()
    assert largest < (1e-5 if attitude_sigma == 0.0 else 1e-3)
    assert largest > (0.0 if attitude_sigma == 0.0 else 1e-5)
