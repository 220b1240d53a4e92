"""Basilisk as a source of truth: it keeps momentum and agrees with MuJoCo, and the package explains its studies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.stats import chi2

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_posterior
from bayesid.inference import maximise
from bayesid.inference.body_quantities import bodies_of
from studies.truth.basilisk import (
    BasiliskHidden,
    Leak,
    Panel,
    Run,
    Slosh,
    Wheel,
    simulate,
    true_base,
    write_basilisk_study,
)
from studies.truth.bodies import SERVICER4
from studies.truth.mujoco import (
    Appendage,
    Body,
    Manoeuvres,
    Motion,
    Rotor,
    Thrust,
    Truth,
    TruthModel,
    rotation_from_rpy,
    smooth_motion,
)

ACCEL_POSITION = (0.1, -0.15, 0.3)
SHORT = Manoeuvres(count=2, duration=80.0)


def _run(hidden: BasiliskHidden) -> Run:
    motion = smooth_motion(4, 50.0, 3, amplitude=0.6)
    return simulate(
        motion, 50.0, hidden=hidden, rate0=(5e-4, -3e-4, 2e-4), sigma0=(0.3, -0.5, 0.2), accel_position=ACCEL_POSITION
    )


def _followed(truth: Truth) -> Motion:
    position = make_interp_spline(truth.times, truth.position, k=5)
    speed, acceleration = position.derivative(), position.derivative(2)
    return lambda time: (position(time), speed(time), acceleration(time))


def _in_mujoco(hidden: BasiliskHidden) -> TruthModel:
    """Build the same robot and hidden parts in MuJoCo."""
    appendages, options = [], {}
    if hidden.panel is not None:
        panel, hinge = hidden.panel, rotation_from_rpy(hidden.panel.rpy)[:, 1]
        appendages.append(
            Appendage(panel.body, hinges=[hinge], anchor=panel.hinge, frequency=panel.frequency, damping=panel.damping)
        )
    if hidden.slosh is not None:
        slosh, point = hidden.slosh, np.array(hidden.slosh.position)
        particle = Body(slosh.mass, point, 1e-9 * np.eye(3))
        appendages += [
            Appendage(particle, slides=[axis], frequency=slosh.frequency, damping=slosh.damping) for axis in np.eye(3)
        ]
    if hidden.wheel is not None:
        options["rotor"] = Rotor(hidden.wheel.momentum, mass=1e-6, spin_inertia=hidden.wheel.spin_inertia)
    if hidden.leak is not None:
        options["thrusts"] = (Thrust(0.0, np.inf, hidden.leak.force, hidden.leak.torque),)
    return TruthModel(SERVICER4, appendages=appendages, accel_position=ACCEL_POSITION, **options)


@pytest.mark.parametrize(
    "hidden",
    [BasiliskHidden(), BasiliskHidden(panel=Panel(), slosh=Slosh(), wheel=Wheel())],
    ids=["nothing hidden", "internal parts"],
)
def test_angular_momentum_is_conserved(hidden: BasiliskHidden) -> None:
    run = _run(hidden)
    assert np.ptp(run.truth.position, axis=0).min() > 0.5
    # the base alone has inertias of 200 kg m2: less than 1e-8 rad/s
    np.testing.assert_allclose(run.momentum, np.broadcast_to(run.momentum[0], run.momentum.shape), rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("hidden", "tolerance"),
    [
        (BasiliskHidden(), 2e-9),
        (BasiliskHidden(panel=Panel()), 2e-9),
        (BasiliskHidden(slosh=Slosh()), 2e-9),
        (BasiliskHidden(leak=Leak()), 2e-9),
        # Basilisk's wheel keeps its momentum in inertial space, MuJoCo's its speed relative to the base
        (BasiliskHidden(Panel(), Slosh(), Wheel(), Leak()), 1e-7),
    ],
    ids=["nothing hidden", "panel", "slosh", "leak", "everything"],
)
def test_basilisk_and_mujoco_agree(hidden: BasiliskHidden, tolerance: float) -> None:
    """MuJoCo is given the joint angles that Basilisk found, and must find the same motion of the base."""
    whole = _run(hidden).truth
    truth = Truth(*(column[::50] for column in whole))
    other = _in_mujoco(hidden).run(_followed(whole), truth.times, rate0=truth.rate[0], attitude0=truth.attitude[0])
    np.testing.assert_allclose(truth.rate, other.rate, rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(truth.accel, other.accel, rtol=0.0, atol=tolerance)
    turned = np.abs((truth.attitude * other.attitude).sum(axis=1))
    np.testing.assert_allclose(turned, 1.0, rtol=0.0, atol=1e-10)
    # away from the ends, where splines are worse
    np.testing.assert_allclose(truth.torque[1:-1], other.torque[1:-1], rtol=0.0, atol=1e-3)


@pytest.mark.slow
def test_nothing_hidden_leaves_noise_and_finds_the_base(tmp_path: Path) -> None:
    file = write_basilisk_study(tmp_path, 10, manoeuvres=SHORT)
    posterior, optimum = maximise(load_posterior(Study.load(file)), np.random.default_rng(0))
    assert optimum.converged
    freedom = posterior.samples - posterior.size
    assert abs(optimum.chi2 - freedom) < 4.0 * np.sqrt(2.0 * freedom)
    draws = np.random.default_rng(1).multivariate_normal(optimum.z, optimum.covariance, size=4000)
    found, base = bodies_of(posterior, draws)["base_link"].values, true_base()
    miss = base.quantities - found.mean(axis=0)
    assert miss @ np.linalg.solve(np.cov(found.T), miss) < chi2.ppf(0.9999, 10)


@pytest.mark.slow
def test_hidden_slosh_shows(tmp_path: Path) -> None:
    file = write_basilisk_study(tmp_path, 11, hidden=BasiliskHidden(slosh=Slosh(mass=4.0)), manoeuvres=SHORT)
    posterior, optimum = maximise(load_posterior(Study.load(file)), np.random.default_rng(0))
    freedom = posterior.samples - posterior.size
    assert optimum.chi2 - freedom > 6.0 * np.sqrt(2.0 * freedom)
