"""Identification from files that MuJoCo made: the truth lies inside the posterior, and noise is all that is left."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

import bayesid
from bayesid import BodyPrior, Excitation, Manoeuvre, Model, Posterior, Robot, Sensor, SensorKind, White
from bayesid.inference import maximise
from bayesid.inference.body_quantities import bodies_of
from bayesid.inference.predicted_readings import integration_error_at, simulate_manoeuvre
from studies.truth.bodies import BRANCHED, SERVICER4
from studies.truth.mujoco import Hidden, Manoeuvres, Rotor, Sensors, Thrust, write_study

SHIPPED = Path(bayesid.__file__).parent / "robot" / "models"
EXAMPLES = Path(__file__).parents[2] / "shared" / "examples"


class Case(NamedTuple):
    """A robot and how it was recorded."""

    urdf: Path
    base: str
    options: dict


CASES = {
    "ets7": Case(SHIPPED / "ets7.urdf", "base_link", {"sensors": Sensors(encoder_sigma=2e-6)}),
    "four joints, other rates and a gap": Case(
        SERVICER4,
        "base_link",
        {
            "sensors": Sensors(rate_period=0.4, accel_period=0.2, encoder_period=0.2, encoder_sigma=1e-5),
            "gaps": {"accel": [(30.0, 38.0)], "rate": [(60.0, 64.0)]},
        },
    ),
    "branched, attitude in place of rate": Case(
        BRANCHED,
        "bus",
        {"sensors": Sensors(rate_period=None, attitude_period=0.5, attitude_sigma=2e-5)},
    ),
    "known thrust": Case(
        SERVICER4,
        "base_link",
        {"hidden": Hidden(thrusts=(Thrust(20.0, 35.0, (0.4, -0.3, 0.2), (0.05, 0.1, -0.08)),))},
    ),
    "wheel in the model": Case(
        SERVICER4,
        "base_link",
        {"hidden": Hidden(rotor=Rotor((0.05, -0.08, 0.04))), "effects": ["gravity-gradient", "wheel-momentum"]},
    ),
}


LONG = (
    "ets7",
    "four joints, other rates and a gap",
    "branched, attitude in place of rate",
    "known thrust",
    "wheel in the model",
)
"""Cases left to ``--slow``."""


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "name" in metafunc.fixturenames:
        metafunc.parametrize(
            "name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in CASES]
        )


def test_truth_lies_inside_the_posterior_and_noise_is_all_that_is_left(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    made = write_study(
        tmp_path, case.urdf, np.random.default_rng(11), manoeuvres=Manoeuvres(count=2, duration=100.0), **case.options
    )
    posterior, optimum = maximise(bayesid.load_posterior(bayesid.Study.load(made.file)), np.random.default_rng(0))
    assert optimum.converged
    # chi-square has the samples less the fitted unknowns as its mean; four standard deviations on either side
    freedom = posterior.samples - posterior.size
    assert abs(optimum.chi2 - freedom) < 4.0 * np.sqrt(2.0 * freedom)
    draws = np.random.default_rng(1).multivariate_normal(optimum.z, optimum.covariance, size=4000)
    body = bodies_of(posterior, draws)[case.base].values
    inertia = made.base.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    truth = np.concatenate([[made.base.mass], made.base.com, inertia])
    miss = truth - body.mean(axis=0)
    assert miss @ np.linalg.solve(np.cov(body.T), miss) < chi2.ppf(0.9999, 10)
    assert integration_error_at(posterior, optimum.z) < 0.01


@pytest.mark.slow
def test_the_error_of_an_integrated_attitude_is_its_angle_however_the_base_is_turned() -> None:
    robot, time = Robot.shipped("planar"), np.arange(0.0, 40.01, 0.5)
    body = BodyPrior("base_link", robot.link("base_link").inertial, 1.0)
    model = Model(robot, (Sensor(SensorKind.ATTITUDE, White(1e-5)),), (body,))
    motion = Excitation([0.3, -0.5], [0.4, 0.6], 2.0 * np.pi / 12.0, periods=3)
    recording = simulate_manoeuvre(model, motion, time)
    errors = []
    for attitude in ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.0), (0.5, 0.5, 0.5, 0.5)):
        manoeuvre = Manoeuvre(recording, motion, attitude=np.array(attitude))
        posterior = Posterior.of(model, [manoeuvre], step=2.0)
        errors.append(integration_error_at(posterior, posterior.starting_point()))
    assert errors[0] > 1e-3
    np.testing.assert_allclose(errors, errors[0], rtol=1e-4)


@pytest.mark.slow
@pytest.mark.skipif(not EXAMPLES.is_dir(), reason="the examples that come with the file contract are absent")
def test_the_contracts_example_is_identified() -> None:
    """Frames, signs and units against recordings made by somebody else's simulator."""
    result = bayesid.identify(
        bayesid.load_posterior(bayesid.Study.load(EXAMPLES / "nothing-hidden" / "study.toml")), 2, effective_samples=500
    )
    assert not result.disagreements
    truth = [640.0, 0.06, 0.02, -0.11, 210.0, 265.0, 240.0, -4.0, 6.5, 3.0]
    miss = truth - result.bodies["base_link"].mean
    assert miss @ np.linalg.solve(result.covariance, miss) < chi2.ppf(0.999, 10)


@pytest.mark.usefixtures("slow")  # whole systems drawn from the prior show the same
def test_an_arm_known_to_five_percent_widens_the_answer_and_still_covers(tmp_path: Path) -> None:
    """The truth's arm is off by its declared spread; an exact arm would then exclude the true base."""
    made = write_study(tmp_path, SERVICER4, np.random.default_rng(5), manoeuvres=Manoeuvres(count=2, duration=100.0))
    file = tmp_path / "robot.urdf"
    robot = bayesid.Robot.from_urdf(file)
    rng = np.random.default_rng(8)
    for name, link in list(robot.links.items())[1:]:
        if link.inertial.mass > 0.0:
            robot = robot.perturbed(name, 0.05, rng)
    robot.write_urdf(file)
    truth = made.base.mass

    def mass(text: str) -> tuple[float, float]:
        made.file.write_text(text)
        posterior, optimum = maximise(bayesid.load_posterior(bayesid.Study.load(made.file)), np.random.default_rng(0))
        draws = np.random.default_rng(1).multivariate_normal(optimum.z, optimum.covariance, size=2000)
        values = bodies_of(posterior, draws)["base_link"].values[:, 0]
        return float(values.mean()), float(values.std())

    text = made.file.read_text()
    exact, exact_sd = mass(text)
    free, free_sd = mass(text.replace('urdf = "robot.urdf"', 'urdf = "robot.urdf"\nlink_spread = 0.05'))
    assert abs(exact - truth) > 5.0 * exact_sd
    assert abs(free - truth) < 3.5 * free_sd
    assert free_sd > 5.0 * exact_sd
