"""Errors of the recorded speeds of wheels against MuJoCo, in which a wheel turns otherwise than is recorded."""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import numpy as np
import pytest

from bayesid import BodyPrior, InertialParameters, Manoeuvre, Model, Recording, Robot, Wheel
from bayesid.inference.data import grids_of
from bayesid.inference.encoder_noise import SampledMotion
from bayesid.inference.posterior import Posterior
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth import wheels

TIMES = np.arange(0.0, 16.01, 0.5)
SIZE, OMEGA = 0.05, 0.4  # of the error of one wheel's speed [rad/s, rad/s]


def error(time: float) -> tuple[float, float, float]:
    """Return the error of the wheel's angle, speed and acceleration, which is zero at the start."""
    return (
        SIZE * (time - np.sin(OMEGA * time) / OMEGA),
        SIZE * (1.0 - np.cos(OMEGA * time)),
        SIZE * OMEGA * np.sin(OMEGA * time),
    )


@dataclass(frozen=True)
class OneError(WheelMotion):
    """Motion of wheels of which the first has the error times a standard normal number."""

    @property
    def is_uncertain(self) -> bool:
        return True

    def lag_covariance(self, time: np.ndarray, lags: int) -> np.ndarray:
        values = np.array([error(t) for t in time])
        covariance = np.zeros((len(self.rotors), lags + 1, len(time), 3, 3))
        for lag in range(lags + 1):
            covariance[0, lag, lag:] = np.einsum("ta,tb->tab", values[lag:], values[: len(time) - lag])
        return covariance


@pytest.mark.slow
def test_what_a_wrong_speed_changes_by_and_by_is_what_mujoco_says(tmp_path, formula_motion):
    """The wheels hold much momentum, so that the turn of the base soon counts more than the speed itself."""
    urdf = tmp_path / "satellite.urdf"
    urdf.write_text(wheels.URDF, encoding="utf-8")
    mounted = wheels.pyramid()[:3]
    courses = [wheels.Slews(mean=250.0, size=20.0).course(np.random.default_rng(seed)) for seed in (1, 2, 3)]

    def otherwise(time: float) -> tuple[float, float, float]:
        angle, speed, acceleration = (value + wrong for value, wrong in zip(courses[0](time), error(time), strict=True))
        return angle, speed, acceleration

    truths = []
    for first in (courses[0], otherwise):
        true = [
            wheels.driven(wheel, wheels.Fault(), course)
            for wheel, course in zip(mounted, [first, *courses[1:]], strict=True)
        ]
        model = mj.TruthModel(urdf, wheels=true)
        truths.append(model.run(lambda time: (np.zeros(0),) * 3, TIMES, rate0=(0.02, -0.01, 0.015), step=0.01))
    before, after = truths

    robot = Robot.from_urdf(urdf)
    robot = robot.with_inertial(robot.base, InertialParameters(*model.base))
    for wheel in mounted:
        robot = robot.with_wheel(Wheel(*wheel))
    sensors = tuple(Sensor(kind, White(1e-5)) for kind in (SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE))
    channels = {
        f"wheel_speed.{wheel.name}": np.array([course(time)[1] for time in TIMES])
        for wheel, course in zip(mounted, courses, strict=True)
    }
    for kind, values in zip(SensorKind.known()[:3], (before.rate, before.accel, before.attitude), strict=True):
        channels |= dict(zip(kind.columns, values.T, strict=True))
    described = Model(robot, sensors, (BodyPrior(robot.base, robot.link(robot.base).inertial, 0.1),))
    manoeuvre = Manoeuvre(Recording("slew", None, TIMES, channels), formula_motion(None, urdf, robot))
    posterior = Posterior.of(described, [manoeuvre], step=0.5)
    (samples,) = posterior.data.recorded
    (grid,) = grids_of(described, [manoeuvre], posterior.data.recorded, 0.5)
    seen = SampledMotion(before.attitude, before.rate, jax.tree.map(np.asarray, grid.sample.environment))
    (errors,) = replace(samples, wheels=OneError(samples.wheels.rotors)).noise_model(robot, seen).errors

    attitude = np.asarray(jax.vmap(SensorKind.ATTITUDE.residual)(after.attitude, before.attitude))
    changed = np.concatenate([after.rate - before.rate, after.accel - before.accel, attitude], axis=1)
    at_once = np.einsum("jdtc,jtd->tc", errors.sensitivity[:1, :2], np.array([[error(t)[1:] for t in TIMES]]))
    assert np.abs(changed - at_once)[:, :3].max() > np.abs(at_once[:, :3]).max()  # the turn is what counts
    for lag in (0, 1, 7, 20):
        late, early = slice(lag, None), slice(0, len(TIMES) - lag)
        g, covariance = errors.sensitivity, errors.covariance[:, lag, late]
        found = np.einsum("jatc,jtab,jbtd->tcd", g[:, :, late], covariance, g[:, :, early])
        expected = np.einsum("tc,td->tcd", changed[late], changed[early])
        for one in (slice(0, 3), slice(3, 6), slice(6, 9)):
            for two in (slice(0, 3), slice(3, 6), slice(6, 9)):
                scale = np.abs(expected[:, one, two]).max()
                np.testing.assert_allclose(found[:, one, two], expected[:, one, two], atol=0.04 * scale)
