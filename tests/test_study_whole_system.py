"""The study of the whole system: the regressor method on MuJoCo data, the algebra of what is known, the report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayesid.robot.inertial_parameters import InertialParameters
from studies.common.ets7 import BASE
from studies.whole_system import run, write_report
from studies.whole_system.information import Information, Sensors
from studies.whole_system.linear import linear_prior, regress
from studies.whole_system.setting import LOAD, bodies, drawn, spreads, true_robot
from studies.whole_system.world import fly, record


@pytest.fixture(scope="module")
def flown():
    truth = true_robot()
    return truth, fly(truth, 1, duration=100.0, joints=tuple(range(6)))


def test_drawings_are_such_that_the_truth_is_a_draw_of_their_prior():
    """Over many drawings the standardised logarithm of the mass is standard normal."""
    truth = true_robot()
    z = []
    for seed in range(60):
        drawings = drawn(truth, seed)
        for name, spread in spreads(truth).items():
            ratio = truth.link(name).inertial.mass / drawings.link(name).inertial.mass
            z.append(0.5 * np.log(ratio) / spread)
    assert abs(np.mean(z)) < 4.0 / np.sqrt(len(z))
    assert np.std(z) == pytest.approx(1.0, abs=0.13)


def test_regressors_need_torques(flown):
    """On motion alone least squares answers with nothing; with torques it finds the base, friction unknown."""
    truth, run_ = flown
    drawings = drawn(truth, 2)
    manoeuvre = record(run_, truth, "six joints", np.random.default_rng(3))
    true = truth.link(BASE).inertial.mass
    alone, believed = regress(manoeuvre, drawings, torques=False)
    assert alone[0] < 0.05 * true
    assert np.sqrt(believed[0, 0]) < 0.05 * true  # and is sure of it
    with_torques, _ = regress(manoeuvre, drawings, torques=True)
    assert with_torques[0] == pytest.approx(true, rel=0.03)


def test_the_linear_prior_is_that_of_the_drawings():
    robot = true_robot()
    centre, covariance = linear_prior(robot)
    first = InertialParameters.from_vector(centre[:10])
    assert first.mass == pytest.approx(robot.link(BASE).inertial.mass)
    assert np.sqrt(covariance[0, 0]) == pytest.approx(2.0 * spreads(robot)[BASE] * first.mass)  # mass = exp(2 alpha)


def test_what_is_known_is_the_conditioned_normal_distribution():
    """Against the covariance of the joint normal, conditioned and rescaled directly."""
    robot, rng = true_robot(), np.random.default_rng(4)
    names, count = bodies(robot), 10 * len(bodies(robot)) + 3
    jacobian = rng.normal(size=(30, 12, count))
    information = Information(robot, jacobian)
    own = jacobian[:, :6].reshape(-1, count)
    full = np.linalg.inv(own.T @ own + np.eye(count))
    motion = information.knowledge(Sensors.MOTION)
    np.testing.assert_allclose(motion.covariance, full, atol=1e-12)
    fixed = np.arange(10 * names.index(LOAD), 10 * names.index(LOAD) + 10)
    free = np.setdiff1d(np.arange(count), fixed)
    # of a normal distribution: S_11 - S_12 S_22^-1 S_21
    expected = full[np.ix_(free, free)] - full[np.ix_(free, fixed)] @ np.linalg.solve(
        full[np.ix_(fixed, fixed)], full[np.ix_(fixed, free)]
    )
    np.testing.assert_allclose(information.knowledge(Sensors.MOTION, known=(LOAD,)).covariance, expected, atol=1e-10)
    wide = information.knowledge(Sensors.MOTION, widths={**spreads(robot), BASE: 3.0 * spreads(robot)[BASE]})
    precision = own.T @ own + np.diag([1.0 / 9.0] * 10 + [1.0] * (count - 10))
    scale = np.array([3.0] * 10 + [1.0] * (count - 10))
    np.testing.assert_allclose(wide.covariance * np.outer(scale, scale), np.linalg.inv(precision), atol=1e-10)
    prior, posterior = motion.mass(BASE)
    assert prior == pytest.approx(2.0 * spreads(robot)[BASE])
    assert posterior == pytest.approx(prior * np.sqrt(full[0, 0]))


@pytest.mark.usefixtures("slow")
def test_torques_and_thrust_bring_the_scale_and_the_report_is_written(tmp_path: Path):
    result = run(duration=80.0, repeats=2)
    six = result.known["six joints"]
    total = {sensors: six.knowledge(sensors).mass(*bodies(result.truth))[1] for sensors in Sensors}
    thrust = result.known["six joints, known thrust"].knowledge(Sensors.MOTION).mass(*bodies(result.truth))[1]
    assert total[Sensors.TORQUES] < 0.2 * total[Sensors.MOTION]
    assert thrust < 0.2 * total[Sensors.MOTION]
    write_report(result, tmp_path / "report.pdf")
    assert (tmp_path / "report.pdf").read_bytes()[:5] == b"%PDF-"
