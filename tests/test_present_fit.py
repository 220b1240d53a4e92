"""A model whose fit diverges, since a large wheel is missing: its body is held, and the wheel is named (MuJoCo)."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid import (
    BodyPrior,
    InertialParameters,
    Manoeuvre,
    MeasuredMotion,
    Model,
    Recording,
    Robot,
    Sensor,
    SensorKind,
    White,
)
from bayesid.diagnosis import Status, diagnose
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.diagnosis.response.present_fit import (
    FollowingTorque,
    fit_present_model,
    follow,
    improbable,
    step_along_data,
    strayed,
    without_torque,
)
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import create
from studies.truth import mujoco as mj
from tests.conftest import ENCODER, PLANAR, POINT, SIGMA

MASS, INERTIA = 12.0, np.array([0.3, 0.42, 0.36])
URDF = """<robot name="box"><link name="base_link"><inertial><mass value="12.0"/>
<inertia ixx="0.3" ixy="0" ixz="0" iyy="0.42" iyz="0" izz="0.36"/></inertial></link></robot>"""
NOISE = 1e-3
"""Of the gyro [rad/s]."""

END = 23.0
"""Length of the recording [s]: a second from each knot of an unrecorded wheel to the next."""


def model_and_flight(folder, momentum):
    """A box that tumbles for 23 s while a wheel about z runs through the given momenta [N m s], second by second."""
    file = folder / "box.urdf"
    file.write_text(URDF, encoding="utf-8")
    times = np.linspace(0.0, END, 231)
    empty = np.zeros(0)
    wheel = mj.SpunWheel(np.array([0.0, 0.0, 1.0]), np.arange(END + 1.0), np.asarray(momentum))
    truth = mj.TruthModel(file, fields=[wheel]).run(
        lambda time: (empty, empty, empty), times, rate0=(0.3, -0.2, 0.25), step=0.02
    )
    noise = NOISE * np.random.default_rng(2).normal(size=truth.rate.shape)
    channels = {f"rate.{axis}": column for axis, column in zip("xyz", (truth.rate + noise).T, strict=True)}
    robot = Robot.from_string(URDF)
    centre = InertialParameters(MASS, np.zeros(3), np.diag(INERTIA * [1.02, 0.99, 0.98]))
    model = Model(robot, (Sensor(SensorKind.RATE, White((NOISE,) * 3)),), (BodyPrior("base_link", centre, 0.1),))
    recording = Recording("flight", None, times, channels)
    return model, [Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot))]


@pytest.fixture(scope="module")
def spun(tmp_path_factory):
    knots = np.arange(END + 1.0)
    return model_and_flight(tmp_path_factory.mktemp("spun"), 0.03 * knots)


@pytest.fixture(scope="module")
def perturbed(spun):
    return PerturbedModel(Posterior.of(*spun, step=0.1))


@pytest.mark.slow
def test_a_fit_that_strays_gives_way_to_one_with_its_body_held(perturbed):
    assert strayed(perturbed.fit())
    found = fit_present_model(perturbed)
    assert found.held
    assert not found.fit.z[perturbed.posterior.unknowns.layout.all_bodies].any()
    assert found.fit.own.shape[1] == perturbed.posterior.size  # of which the derivatives are known all the same


@pytest.mark.slow
def test_a_free_torque_brings_the_held_model_to_the_data(perturbed):
    assert step_along_data(perturbed.posterior) == pytest.approx(0.1)
    along = follow(perturbed)
    assert not strayed(along)
    assert along.chi2 < 1e-4 * without_torque(along).chi2


@pytest.mark.slow
def test_a_fit_that_follows_the_data_keeps_its_body(tmp_path):
    perturbed = PerturbedModel(Posterior.of(*model_and_flight(tmp_path, np.zeros(24)), step=0.1))
    found = fit_present_model(perturbed)
    assert not found.held
    assert found.fit.chi2 < 1.2 * perturbed.posterior.samples


@pytest.mark.slow
@pytest.mark.parametrize("share", [1.0 / 20.0, 1.0 / 40.0])
def test_a_link_of_many_times_its_guess_is_found(share):
    """Of the planar robot in MuJoCo; the first fit ends far from the data, once with an improbable body, once not."""
    times = np.arange(0.0, 40.01, 0.5)
    motion = mj.smooth_motion(2, 40.0, seed=11, amplitude=0.3, frequencies=(0.03, 0.05), ramp=20.0)
    truth = mj.TruthModel(PLANAR, accel_position=POINT).run(motion, times, rate0=(0.01, -0.02, 0.015), step=0.1)
    rng, robot = np.random.default_rng(1), Robot.from_urdf(PLANAR)
    channels = {f"position.joint{k + 1}": truth.position[:, k] + ENCODER * rng.normal(size=81) for k in range(2)}
    for family, values in (("rate", truth.rate), ("accel", truth.accel)):
        channels |= {f"{family}.{axis}": values[:, k] + SIGMA * rng.normal(size=81) for k, axis in enumerate("xyz")}
    recording = Recording("flight", None, times, channels)
    manoeuvre = Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma={0: ENCODER}))
    link = robot.link("link2").inertial
    guess = InertialParameters(share * link.mass, np.zeros(3), share * link.inertia)
    sensors = (Sensor(SensorKind.RATE, White(SIGMA)), Sensor(SensorKind.ACCEL, White(SIGMA), position=POINT))
    perturbed = PerturbedModel(
        Posterior.of(Model(robot, sensors, (BodyPrior("link2", guess, 2.0),)), [manoeuvre], step=0.5)
    )
    assert perturbed.fit().chi2 > 1e3 * perturbed.posterior.samples
    found = fit_present_model(perturbed)
    assert not found.held
    assert found.fit.chi2 < 1.2 * perturbed.posterior.samples


@pytest.mark.slow
def test_a_large_unrecorded_wheel_is_named(spun):
    model, manoeuvres = spun
    names = ("wheel-history:x", "wheel-history:y", "wheel-history:z", "rotational-drag", "rate-scale")
    effects = [create(name, end=END) if "wheel" in name else create(name) for name in names]
    found = diagnose(model, manoeuvres, 1, effects=[effect.attach(model.robot) for effect in effects])
    assert found.bodies_fixed
    assert found.to_dict()["bodies_held"]
    assert found.verdict.status is Status.EXPLAINED
    assert found.verdict.causes == ("wheel-history:z",)
    assert found.gain.after.chi2_per_sample < 1.2


@pytest.mark.slow
def test_a_small_unexplained_torque_does_not_fit_what_a_large_wheel_does(spun):
    """A body of a fraction of its inertia let the torque of the present model do what the wheel does."""
    model, manoeuvres = spun
    model = model.extend(FollowingTorque(END, 1e-3))
    posterior = Posterior.of(model, manoeuvres, step=0.1)
    present = fit_present_model(PerturbedModel(posterior))
    assert not present.held
    assert improbable(present.fit)
    assert present.fit.chi2 < 2.0 * posterior.samples
