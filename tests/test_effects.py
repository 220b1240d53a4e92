"""The register of effects, and effects written by a user."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.inference.mode import maximise
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import Effect, Parameter, Wrench, create, register
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth import stepwise as ref

PLANAR = Path(__file__).resolve().parents[1] / "bayesid" / "robot" / "models" / "planar.urdf"


@pytest.mark.parametrize(
    ("name", "orbit", "lacking"),
    [
        ("gravity-gradient", None, r"\[orbit\]"),
        ("solar-pressure", Orbit(6.9e6), r"sun in \[orbit\]"),
        ("magnetic-dipole", Orbit(6.9e6), r"inclination in \[orbit\]"),
        ("accel-bias", Orbit(6.9e6), r"\[sensors.accel\]"),
        ("attitude-misalignment", Orbit(6.9e6), r"\[sensors.attitude\]"),
    ],
)
def test_a_model_refuses_an_effect_that_could_not_act(name: str, orbit: Orbit | None, lacking: str):
    robot = Robot.shipped("planar")
    with pytest.raises(InputError, match=f"{name}' requires {lacking}"):
        Model(robot, (Sensor(SensorKind.RATE, White(1e-5)),), (), orbit, (create(name),))


def test_a_stated_place_of_a_tank_is_kept_and_the_usual_one_is_the_spacecraft():
    robot = Robot.shipped("ets7")
    usual, stated = create("fuel-slosh").attach(robot), create("fuel-slosh", reach=0.05).attach(robot)
    assert all(item.sigma > 0.3 for item in usual.parameters[3:])
    assert [item.sigma for item in stated.parameters[3:]] == [0.05] * 3
    assert [item.mean for item in stated.parameters[3:]] == [item.mean for item in usual.parameters[3:]]
    assert stated.attach(robot).parameters == stated.parameters


def test_the_register():
    with pytest.raises(InputError, match=r"unknown effect 'phlogiston'. Choose from .*gravity-gradient"):
        create("phlogiston")

    class Nameless(Effect):
        pass

    with pytest.raises(InputError, match="effect Nameless has no name"):
        register(Nameless)


# a user's own effects -------------------------------------------------------------------------------------------------


class ConstantTorque(Effect):
    """A torque of unknown size on the base."""

    name = "constant-torque"
    parameters = tuple(Parameter(axis, "N m", 0.01) for axis in "xyz")

    def wrench(self, values, instant, inner):
        return Wrench(jnp.zeros(3), values)


TAU = 8.0


class CreepingTorque(Effect):
    """A torque that approaches its final value with a time constant of 8 s: an effect with states of its own."""

    name = "creeping-torque"
    states: ClassVar[int] = 3
    parameters = tuple(Parameter(axis, "N m", 0.01) for axis in "xyz")

    def derivative(self, values, instant, inner):
        return (values - inner) / TAU

    def wrench(self, values, instant, inner):
        return Wrench(jnp.zeros(3), inner)


TORQUE = np.array([2e-3, -1e-3, 1.5e-3])
SIGMA, POINT = 1e-5, (0.1, -0.15, 0.3)
TIMES = np.arange(0.0, 30.01, 0.5)


def posterior_of(rate: np.ndarray, accel: np.ndarray, motion: mj.Motion) -> Posterior:
    rng, channels = np.random.default_rng(3), {}
    position = np.array([motion(t)[0] for t in TIMES])
    for index in range(2):
        channels[f"position.joint{index + 1}"] = position[:, index] + 1e-6 * rng.normal(size=len(TIMES))
    for family, values in (("rate", rate), ("accel", accel)):
        for index, axis in enumerate("xyz"):
            channels[f"{family}.{axis}"] = values[:, index] + SIGMA * rng.normal(size=len(TIMES))
    recording, robot = Recording("own", None, TIMES, channels), Robot.from_urdf(PLANAR)
    smoothed = MeasuredMotion.from_recording(recording, robot, sigma={0: 1e-6})
    sensors = (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT))
    prior = BodyPrior("base_link", robot.link("base_link").inertial, 0.1)
    return Posterior.of(Model(robot, sensors, (prior,)), [Manoeuvre(recording, smoothed)], step=0.5)


def identified(posterior: Posterior, effect: Effect) -> tuple[np.ndarray, np.ndarray, float]:
    """Values, covariance and chi2 per sample of the model extended by the effect."""
    extended = Posterior.of(posterior.model.extend(effect), posterior.manoeuvres, step=0.5)
    assert extended.unknowns.names[-3:] == tuple(f"{effect.label}.{axis}" for axis in "xyz")
    assert posterior.model.effects == ()
    refined, optimum = maximise(extended, np.random.default_rng(0))
    values = np.asarray(refined.unknowns.values_at(optimum.z).effects[0])
    return values, optimum.covariance[-3:, -3:] * 0.01**2, optimum.chi2 / refined.samples


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["constant", "creeping"])
def test_an_effect_of_ones_own_is_composed_and_identified(kind):
    """Truth: a hidden thrust in MuJoCo, and a torque that grows as 1 - exp(-t / tau) in the reference.

    Chi-square of the three torques is below 21.1, exceeded by chance once in 10,000.
    """
    motion = mj.smooth_motion(2, 30.0, seed=5, amplitude=0.4, frequencies=(0.04, 0.07), ramp=8.0)
    rate0 = (0.01, -0.02, 0.015)
    if kind == "constant":
        effect = ConstantTorque()
        thrust = mj.Thrust(0.0, 1e9, torque=tuple(TORQUE))
        truth = mj.TruthModel(PLANAR, thrusts=[thrust], accel_position=POINT).run(motion, TIMES, rate0=rate0, step=0.1)
    else:
        effect = CreepingTorque()
        truth = ref.simulate(
            PLANAR,
            motion,
            TIMES,
            0.1,
            gradient=False,
            rate0=rate0,
            accel_position=POINT,
            base_torque=lambda t: TORQUE * (1.0 - np.exp(-t / TAU)),
        )
    values, covariance, chi2 = identified(posterior_of(truth.rate, truth.accel, motion), effect)
    error = values - TORQUE
    assert error @ np.linalg.solve(covariance, error) < 21.1
    assert (np.sqrt(np.diag(covariance)) < 0.2 * np.abs(TORQUE)).all()  # it was found, not left at its prior
    assert 0.6 < chi2 < 1.3
