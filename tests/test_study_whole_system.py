"""The study of the whole system: the regressor method on MuJoCo data, the algebra of what is known, the report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayesid.robot.inertial_parameters import InertialParameters
from studies.common.ets7 import BASE
from studies.whole_system import STUDY, run
from studies.whole_system.identification import Coverage, Sampled, linear_prior, regress
from studies.whole_system.report import _well_sized
from studies.whole_system.system import LOAD, Information, Sensors, bodies, drawn, fly, record, spreads, true_robot
from tests.report_rules import broken_rules


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


@pytest.mark.slow
def test_regressors_without_torques_know_the_prior_and_the_number_of_samples(flown):
    """A right side of zero knows nothing of the scale s of the masses; P (s - 1)^2 + n s^2 is least at P / (P + n).

    The masses' ratios give way a little too, which lowers the scale by less than a fifth.
    """
    truth, whole = flown
    drawings = drawn(truth, 2)
    drawn_mass, true_mass = (sum(body.link(name).inertial.mass for name in bodies(body)) for body in (drawings, truth))
    # a body's scale is exp(2 spread z); the method gets no prior of the load
    precision = sum(0.25 / spread**2 for name, spread in spreads(truth).items() if name != LOAD)
    shares = []
    for run_ in (fly(truth, 1, duration=50.0, joints=tuple(range(6))), whole):
        manoeuvre = record(run_, truth, "six joints", np.random.default_rng(3))
        estimate, stated = regress(manoeuvre, drawings, torques=False)
        shares.append(estimate[::10].sum() / drawn_mass)
        equations = 6 * len(run_.position)
        assert 0.8 < shares[-1] / (precision / (precision + equations)) < 1.0
        missing = true_mass - estimate[::10].sum()
        assert missing > 10.0 * np.sqrt(stated[::10, ::10].sum())  # and is sure of it
    assert shares[1] < shares[0]


def test_regressors_with_torques_find_the_base(flown):
    """The joints' friction is unknown."""
    truth, run_ = flown
    manoeuvre = record(run_, truth, "six joints", np.random.default_rng(3))
    estimate, _ = regress(manoeuvre, drawn(truth, 2), torques=True)
    assert estimate[0] == pytest.approx(truth.link(BASE).inertial.mass, rel=0.03)


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
    STUDY.write(result, tmp_path / "report.pdf")
    assert broken_rules(tmp_path / "report.pdf", full=False) == []


def test_both_tails_of_the_distances_are_tested():
    """By hand: of 40 distances three are beyond the 95 % quantile, as 2 P(3 or more) = 0.65 allows; of ten five are."""
    inside, outside = np.full(37, 80.0), np.full(3, 200.0)
    coverage = Coverage(np.concatenate([inside, outside]), np.zeros((40, 3)), 80)
    assert (coverage.far, coverage.near) == (3, 0)
    assert coverage.tail_p_value == pytest.approx(2.0 * 0.3233, abs=1e-4)
    for unlikely in (200.0, 20.0):
        assert Coverage(np.repeat([80.0, unlikely], 5), np.zeros((10, 3)), 80).tail_p_value < 2e-4


def test_a_sampled_posterior_that_is_too_wide_fails_and_the_level_is_shared():
    def case(p_value):
        return Sampled("motion", None, 0.0, p_value, {})

    assert _well_sized([case(0.03), case(0.5)])
    assert not _well_sized([case(0.02), case(0.5)])
    assert not _well_sized([case(0.04)])
