"""Joint torques of the simulation against MuJoCo, their encoder noise against differences, friction, and bad input."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest

from bayesid._io.errors import InputError
from bayesid.inference.data import RecordedSamples
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings, simulate_recordings
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import EncoderOffset, GravityGradient, JointFriction, LinkInertia, TorqueBias
from bayesid.simulation.instant import Environment
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Channels, Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth.bodies import moving_joints
from tests.conftest import ROOT

ROBOTS = {
    "ets7": ROOT / "bayesid" / "robot" / "models" / "ets7.urdf",
    "branched": ROOT / "studies" / "truth" / "robots" / "branched.urdf",
}
ORBIT = mj.Orbit(6.9e6)
TIMES = np.arange(0.0, 8.01, 0.5)
RATE0 = (0.01, -0.02, 0.015)
GRADIENT = (GravityGradient(),)


def flown(urdf: Path, changed=None, orbit=ORBIT):
    motion = mj.smooth_motion(len(moving_joints(urdf)), 12.0, seed=3, amplitude=0.5, frequencies=(0.1, 0.17), ramp=5.0)
    model = mj.TruthModel(urdf, orbit=orbit, changed=changed)
    return motion, model.run(motion, TIMES, rate0=RATE0, step=0.05)


def posterior_of(urdf, truth, motion, *, robot=None, priors=(), effects=GRADIENT, joints=None):
    robot = Robot.from_urdf(urdf) if robot is None else robot
    urdf_joints = moving_joints(urdf)
    names = tuple(joint.name for joint in robot.joints) if joints is None else joints
    channels = {f"rate.{axis}": truth.rate[:, k] for k, axis in enumerate("xyz")}
    channels |= {f"position.{name}": truth.position[:, k] for k, name in enumerate(urdf_joints)}
    channels |= {f"torque.{name}": truth.torque[:, urdf_joints.index(name)] for name in names}
    model = Model(
        robot,
        (Sensor(SensorKind.RATE, White(1e-6)),),
        priors,
        Orbit(ORBIT.radius),
        effects,
        torque=TorqueSensor(names, (1e-4,) * len(names)),
    )
    recording = Recording("truth", None, truth.times, channels)
    return Posterior.of(model, [Manoeuvre(recording, motion)], step=0.25)


def start(posterior: Posterior, rate0=RATE0) -> np.ndarray:
    return posterior.unknowns.coordinates([prior.centre for prior in posterior.model.priors], np.array([rate0]))


@pytest.mark.parametrize("name", ROBOTS)
def test_torques_are_mujocos(name, formula_motion):
    """With gravity gradient on every body, revolute and prismatic joints, fixed links and a branch."""
    urdf = ROBOTS[name]
    motion, truth = flown(urdf)
    robot = Robot.from_urdf(urdf)
    posterior = posterior_of(urdf, truth, formula_motion(motion, urdf, robot))
    time, measured = posterior.data.torques(0)
    predicted = predicted_readings(posterior, start(posterior))[0].torque
    assert np.array_equal(time, TIMES)
    assert np.abs(measured).max() > 0.1
    np.testing.assert_allclose(predicted, measured, rtol=0, atol=1e-8 * np.abs(measured).max())


def test_gravity_gradient_shows_in_the_torques(formula_motion):
    urdf = ROBOTS["ets7"]
    motion, truth = flown(urdf)
    robot = Robot.from_urdf(urdf)
    without = posterior_of(urdf, truth, formula_motion(motion, urdf, robot), effects=())
    miss = predicted_readings(without, start(without))[0].torque - without.data.torques(0)[1]
    assert np.abs(miss).max() > 1e-4  # of which the first test leaves less than 1e-6


@pytest.mark.slow
def test_unknown_bodies_and_a_changed_link_carry_their_torques(formula_motion):
    """Two links as unknowns at values off the prior's centre, a third changed by an effect."""
    urdf = ROBOTS["ets7"]
    robot = Robot.from_urdf(urdf)
    names = ("base_link", "link2", "link5")
    heavier = {
        name: InertialParameters(1.2 * b.mass, b.com, 1.2 * b.inertia)
        for name, b in ((name, robot.link(name).inertial) for name in (*names, "link4"))
    }
    changed = {name: mj.Body(b.mass, b.com, b.inertia) for name, b in heavier.items() if name != "base_link"}
    motion, truth = flown(urdf, changed)
    priors = tuple(BodyPrior(name, robot.link(name).inertial, 0.3) for name in names)
    effects = (GravityGradient(), LinkInertia("link4"))
    posterior = posterior_of(
        urdf,
        truth,
        formula_motion(motion, urdf, robot),
        robot=robot,
        priors=priors,
        effects=effects,
        joints=("joint5", "joint2"),
    )
    bodies = [robot.link("base_link").inertial, heavier["link2"], heavier["link5"]]
    z = posterior.unknowns.coordinates(bodies, np.array([RATE0]))
    z[-10] = 0.5 * np.log(1.2) / 0.1  # alpha of the effect on link4: all its parameters by a factor
    np.testing.assert_allclose(
        predicted_readings(posterior, z)[0].torque, posterior.data.torques(0)[1], rtol=0, atol=1e-6
    )


def test_encoder_errors_reach_the_torques_as_differences_of_the_simulation(formula_motion):
    """Joint accelerations act at once: a ramp of acceleration error cannot be told from its sensitivity."""
    urdf = ROBOTS["ets7"]
    robot = Robot.from_urdf(urdf)
    state = JointState(*(0.1 * np.random.default_rng(1).normal(size=(3, 4, 6))))
    environment = Environment(
        *np.zeros((10, 4)), np.zeros((4, 0, 5)), np.ones(4), np.zeros(4)
    )  # far from everything: what acts is the arm
    seen = SampledMotion(np.tile([0.0, 0.0, 0.0, 1.0], (4, 1)), np.zeros((4, 3)), environment)
    response = joint_sensitivity(robot, state, seen, (Sensor(SensorKind.RATE, White(1e-6)),), (1, 4))
    torques = Channels((SensorKind.RATE,), ("joint2", "joint5")).torques
    for row in range(4):
        mass = _mass_matrix(robot.model, state.position[row])
        effective = mass[6:, 6:] - mass[6:, :6] @ np.linalg.solve(mass[:6, :6], mass[:6, 6:])
        np.testing.assert_allclose(response[:, 2, row, torques], effective[:, [1, 4]], rtol=1e-5, atol=1e-4)


def _mass_matrix(model, position):
    data = model.createData()
    q = pin.neutral(model)
    q[7:] = position
    upper = np.triu(pin.crba(model, data, q))
    return upper + np.triu(upper, 1).T


def test_friction_and_bias_add_to_the_reading(formula_motion):
    urdf = ROBOTS["ets7"]
    motion, truth = flown(urdf)
    robot = Robot.from_urdf(urdf)
    plain = posterior_of(urdf, truth, formula_motion(motion, urdf, robot))
    effects = (GravityGradient(), JointFriction("joint3"), TorqueBias("joint1"))
    rubbing = posterior_of(urdf, truth, formula_motion(motion, urdf, robot), effects=effects)
    z = np.concatenate([start(plain), [2.0 / 5.0, 10.0 / 50.0, -0.3 / 2.0]])
    added = predicted_readings(rubbing, z)[0].torque - predicted_readings(plain, start(plain))[0].torque
    speed = truth.speed[:, 2]
    moving = np.abs(speed) > 1e-3
    assert moving.sum() > 10
    np.testing.assert_allclose(added[moving, 2], (2.0 * np.sign(speed) + 10.0 * speed)[moving], atol=1e-9)
    np.testing.assert_allclose(added[:, 0], -0.3, atol=1e-9)
    np.testing.assert_allclose(added[:, [1, 3, 4, 5]], 0.0, atol=1e-9)


@pytest.mark.slow
def test_simulated_torques_have_the_declared_noise(formula_motion):
    urdf = ROBOTS["ets7"]
    motion, truth = flown(urdf)
    posterior = posterior_of(urdf, truth, formula_motion(motion, urdf, Robot.from_urdf(urdf)), joints=("joint2",))
    z = start(posterior)
    (quiet,), (noisy,) = (simulate_recordings(posterior, rng, z) for rng in (None, np.random.default_rng(2)))
    error = noisy.channels["torque.joint2"] - quiet.channels["torque.joint2"]
    assert 0.5e-4 < error.std() < 1.7e-4
    assert np.array_equal(quiet.channels["torque.joint2"], predicted_readings(posterior, z)[0].torque[:, 0])
    chi2 = (with_manoeuvres(posterior, [Manoeuvre(quiet, posterior.manoeuvres[0].motion)]).residuals(z) ** 2).sum()
    assert chi2 < 1e-10


@pytest.mark.slow
def test_bad_torque_sensors_are_refused(formula_motion):
    urdf = ROBOTS["ets7"]
    motion, truth = flown(urdf)
    robot = Robot.from_urdf(urdf)
    with pytest.raises(InputError, match="not positive"):
        TorqueSensor(("joint1",), (0.0,))
    with pytest.raises(InputError, match="no moving joint named 'elbow'"):
        TorqueSensor(("elbow",), (0.1,)).columns(robot)
    with pytest.raises(InputError, match=r"encoder-offset:joint1.*not modelled"):
        posterior_of(urdf, truth, motion, effects=(EncoderOffset("joint1"),))
    with pytest.raises(InputError, match=r"joint-friction:joint2.*not measured"):
        posterior_of(urdf, truth, motion, joints=("joint1",), effects=(JointFriction("joint2"),))
    posterior = posterior_of(urdf, truth, formula_motion(motion, urdf, robot), joints=("joint1",))
    channels = {k: v for k, v in posterior.manoeuvres[0].recording.channels.items() if "torque" not in k}
    bare = Manoeuvre(Recording("bare", None, TIMES, channels), posterior.manoeuvres[0].motion)
    with pytest.raises(InputError, match=r"no column torque\.joint1, but the study declares"):
        RecordedSamples.of(posterior.model, bare)
    assert posterior.model.without_torque.torque is None
    assert jnp.isfinite(jnp.asarray(posterior.jacobian(start(posterior)))).all()


def test_torques_in_other_units_are_refused(formula_motion):
    urdf = ROBOTS["ets7"]
    motion, truth = flown(urdf)
    wrong = truth._replace(torque=1e3 * truth.torque)
    posterior = posterior_of(urdf, wrong, formula_motion(motion, urdf, Robot.from_urdf(urdf)))
    with pytest.raises(InputError, match=r"column torque\.joint1.*1e\+03 times.*Give them in N m"):
        refuse_wrong_units(posterior)
