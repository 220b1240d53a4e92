"""A posterior as the next prior: two studies in turn tell what one tells of both; fuel is subtracted by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import arviz_base as az
import numpy as np
import pytest
from conftest import PLANAR
from scipy.optimize import least_squares
from test_unknowns import CENTRE, OTHER

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_model, load_robot
from bayesid.inference.noise_changes import leaving_out, with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import InertialDraws, joint_prior
from bayesid.inference.predicted_readings import blank_channels, simulate_recordings
from bayesid.inference.unknowns import Unknowns
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior, draw_inertial
from bayesid.robot.inertial_parameters import BodyChange, InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind, White

NAMES = ("base_link", "load")


def correlated(count: int = 400, width: float = 0.05) -> InertialDraws:
    """Draws of two bodies whose coordinates share half of their variance."""
    z = np.random.default_rng(1).normal(size=(count, 30))
    mixed = np.concatenate([z[:, :10] + z[:, 20:], z[:, 10:20] - z[:, 20:]], axis=1) / np.sqrt(2.0)
    layout = Unknowns((BodyPrior("base_link", CENTRE, width), BodyPrior("load", OTHER, width)), (), 1, 0.0, (0.0,))
    return InertialDraws(NAMES, np.stack([np.asarray(layout.values(row).inertial).reshape(2, 10) for row in mixed]))


def test_the_joint_prior_has_mean_and_covariance_of_the_draws():
    draws = correlated()
    prior = joint_prior(draws)
    layout = Unknowns(prior.bodies(), (), 1, 0.0, (0.0,), prior.mixing())
    z = np.stack([layout.coordinates([InertialParameters.from_vector(v) for v in row]) for row in draws.values])
    np.testing.assert_allclose(z.mean(axis=0), 0.0, atol=1e-8)
    np.testing.assert_allclose(np.cov(z.T), np.eye(20), atol=1e-8)
    # and it remembers that the bodies are correlated: half of the variance, with 400 draws
    cross = np.diag(prior.covariance[:10, 10:]) / np.sqrt(
        np.diag(prior.covariance)[:10] * np.diag(prior.covariance)[10:]
    )
    np.testing.assert_allclose(cross, -0.5, atol=4.0 / 20.0)
    assert [body.nuisance for body in prior.bodies(["load"])] == [False, True]


def test_independent_bodies_follow_the_joint_prior():
    prior = joint_prior(correlated())
    factor = np.array(prior.mixing([BodyPrior("link", OTHER, 0.3)]))
    np.testing.assert_allclose(factor[:20, :20] @ factor[:20, :20].T, prior.covariance, rtol=1e-9, atol=1e-15)
    np.testing.assert_array_equal(factor[20:], np.concatenate([np.zeros((10, 20)), 0.3 * np.eye(10)], axis=1))


def test_few_draws_are_an_error():
    with pytest.raises(InputError, match="79 draws are too few for the covariance of 20 coordinates"):
        joint_prior(InertialDraws(NAMES, correlated(79).values))


# fuel -----------------------------------------------------------------------------------------------------------------


def test_fuel_is_subtracted_by_the_parallel_axis_theorem():
    """100 kg at the origin with 4 kg m2 all round lose 20 kg at x = 0.5 m, by hand."""
    full = InertialParameters(100.0, [0.0, 0.0, 0.0], 40.0 * np.eye(3))
    draws = InertialDraws(("base_link",), np.tile(full.vector, (50, 1, 1)))
    fuel = BodyChange("base_link", -20.0, [0.5, 0.0, 0.0], np.diag([0.1, 0.2, 0.3]))
    left = InertialParameters.from_vector(draws.changed(fuel, np.random.default_rng(0)).values[0, 0])
    assert left.mass == pytest.approx(80.0)
    np.testing.assert_allclose(left.com, [-0.125, 0.0, 0.0], atol=1e-14)
    # about the old centre 40 - 0.2 - 20 * 0.25 = 34.8 (yy); to the new one less 80 * 0.125^2 = 1.25
    np.testing.assert_allclose(left.inertia, np.diag([39.9, 33.55, 33.45]), atol=1e-12)
    back = BodyChange("base_link", 20.0, [0.5, 0.0, 0.0], np.diag([0.1, 0.2, 0.3]))
    again = draws.changed(fuel, np.random.default_rng(0)).changed(back, np.random.default_rng(0))
    np.testing.assert_allclose(again.values, draws.values, atol=1e-12)


def test_an_uncertain_amount_of_fuel_widens_the_mass():
    draws = correlated(1000, 1e-4)
    fuel = BodyChange("base_link", -6.0, [0.05, 0.0, 0.1], mass_sigma=0.5)
    mass = draws.changed(fuel, np.random.default_rng(2)).values[:, 0, 0]
    assert mass.mean() == pytest.approx(54.0, abs=4.0 * 0.5 / np.sqrt(1000))
    assert mass.std() == pytest.approx(0.5, rel=4.0 / np.sqrt(2000))


def test_more_fuel_than_there_is_is_an_error():
    with pytest.raises(InputError, match=r"load is no longer a physical body in 400 of 400 draws.* by -6 kg"):
        correlated().changed(BodyChange("load", -6.0, [0.5, 0.0, 0.0]), np.random.default_rng(0))
    with pytest.raises(InputError, match="the mass is 0"):
        BodyChange("load", 0.0, [0.5, 0.0, 0.0])


# two studies in turn --------------------------------------------------------------------------------------------------


class Sine:
    """Both joints of the planar robot swing; frequency and phase tell manoeuvres apart."""

    def __init__(self, frequency: float, phase: float) -> None:
        self.omega, self.phase = frequency * np.array([1.0, 1.4]), phase * np.array([1.0, -1.0])

    def evaluate(self, time: np.ndarray) -> JointState:
        angle = np.asarray(time)[:, None] * self.omega + self.phase
        return JointState(0.6 * np.sin(angle), 0.6 * self.omega * np.cos(angle), -0.6 * self.omega**2 * np.sin(angle))


def laplace(posterior: Posterior) -> np.ndarray:
    """Draws of the base from the Laplace approximation, as linear parameters."""
    # differences: to compile the exact derivatives would take longer than the test
    found = least_squares(posterior.least_squares, np.zeros(posterior.size), "3-point", method="lm")
    normal = np.random.default_rng(4).normal(size=(8000, posterior.size))
    z = found.x + normal @ np.linalg.cholesky(np.linalg.inv(found.jac.T @ found.jac)).T
    return np.asarray(posterior.unknowns.values_of(z).inertial)


@pytest.mark.usefixtures("slow")  # the loop's tests show the same on two steps
def test_two_studies_in_turn_tell_what_one_tells_of_both():
    """The planar robot at rest; the second recording halves what the first left uncertain."""
    robot = Robot.from_urdf(PLANAR)
    sensors = (Sensor(SensorKind.RATE, White(2e-5)), Sensor(SensorKind.ACCEL, White(2e-5), position=(0.1, -0.15, 0.3)))
    prior = BodyPrior("base_link", robot.link("base_link").inertial, 0.05)
    model = Model(robot, sensors, (prior,), rate_sigma=0.0)
    time = np.arange(0.0, 30.0, 0.5)
    planned = [
        Manoeuvre(Recording(f"sine {phase}", None, time, blank_channels(sensors, len(time))), Sine(frequency, phase))
        for frequency, phase in ((0.5, 0.0), (0.8, 1.0))
    ]
    both = Posterior.of(model, planned, step=0.5)
    truth = 0.5 * np.random.default_rng(6).normal(size=10)
    recordings = simulate_recordings(both, np.random.default_rng(5), truth)
    manoeuvres = [Manoeuvre(recording, plan.motion) for recording, plan in zip(recordings, planned, strict=True)]
    posterior = with_manoeuvres(both, manoeuvres)
    # a recording left out in place of a posterior of one: nothing is compiled anew
    everything = [np.ones_like(item.outputs) for item in posterior.whitenings]
    joint = laplace(posterior)
    first = laplace(leaving_out(posterior, [np.zeros_like(everything[0]), everything[1]]))
    carried = joint_prior(InertialDraws(("base_link",), first[:, None]))
    later = replace(model, priors=carried.bodies(), mixing=carried.mixing())
    sequential = laplace(Posterior.of(later, manoeuvres[1:], step=0.5))
    sd = joint.std(axis=0)
    assert (first.std(axis=0) > 1.5 * sd).sum() >= 3  # the second recording did matter
    np.testing.assert_array_less(np.abs(sequential.mean(axis=0) - joint.mean(axis=0)) / sd, 0.08)
    np.testing.assert_allclose(sequential.std(axis=0) / sd, 1.0, atol=0.02)


# study files ----------------------------------------------------------------------------------------------------------

STUDY = {
    "robot": {"urdf": str(PLANAR)},
    "sensors": {"rate": {"sigma": 1e-5}},
    "unknowns": {"bodies": ["base_link"]},
}


def study_of(folder: Path, names: tuple[str, ...], **unknowns: object) -> Study:
    """A study whose prior is a file with draws of the named links of the planar robot, 5 % wide."""
    rng, links = np.random.default_rng(3), Robot.from_urdf(PLANAR).links
    draws = [[draw_inertial(links[name].inertial, 0.05, rng).vector for name in names] for _ in range(100)]
    values = np.reshape(draws, (2, 50, len(names), 10))
    data = az.from_dict(
        {"posterior": {"inertial": values}}, dims={"inertial": ["body", "parameter"]}, coords={"body": list(names)}
    )
    data.to_netcdf(str(folder / "posterior.nc"))
    section = {"bodies": ["base_link"], "posterior": str(folder / "posterior.nc"), **unknowns}
    return Study.from_mapping({**STUDY, "unknowns": section})


def test_a_file_that_the_legacy_arviz_wrote_is_read():
    draws = InertialDraws.read(Path(__file__).parent / "legacy_posterior.nc")
    assert draws.names == ("base_link", "load")
    assert draws.values.shape == (6, 2, 10)
    assert draws.values.sum() == pytest.approx(180.655)
    last = [1.909, 1.393, 1.349, 1.348, 1.481, 1.093, 1.547, 1.921, 1.563, 1.744]
    np.testing.assert_array_equal(draws.values[5, 1], last)


def test_a_study_starts_from_an_earlier_posterior(tmp_path):
    study = study_of(tmp_path, ("link1", "base_link"))
    model = load_model(study)
    assert [(prior.name, prior.nuisance) for prior in model.priors] == [("base_link", False), ("link1", True)]
    draws = InertialDraws.read(tmp_path / "posterior.nc").of_bodies(["base_link", "link1"])
    np.testing.assert_allclose(model.mixing, joint_prior(draws).mixing(), rtol=1e-12, atol=1e-12)
    for prior, name in zip(model.priors, ("base_link", "link1"), strict=True):
        assert load_robot(study).link(name).inertial.mass == prior.centre.mass
    fuel = {"body": "base_link", "mass": -10.0, "com": [0.0, 0.0, 0.0]}
    lighter = load_model(study_of(tmp_path, ("link1", "base_link"), changes=[fuel]))
    assert lighter.priors[0].centre.mass == pytest.approx(
        model.priors[0].centre.mass - 10.0, abs=0.1
    )  # about a tenth of a percent, as geometric means differ


@pytest.mark.parametrize(
    ("names", "unknowns", "message"),
    [
        (("link1",), {}, "posterior.nc: it contains no body 'base_link'. It contains link1"),
        (("base_link",), {"spread": 0.1}, "spread: it contradicts unknowns.posterior"),
        (("base_link",), {"posterior": "none.nc"}, "none.nc: there is no such file"),
        (("base_link",), {"posterior": str(PLANAR)}, "contains no draws of inertial parameters"),
        (("base_link",), {"changes": [{"body": "tank", "mass": 1.0, "com": [0, 0, 0]}]}, "'tank' is not among"),
        (
            ("base_link",),
            {"changes": [{"body": "base_link", "mass": -1e4, "com": [0, 0, 0]}]},
            "base_link is no longer a physical body",
        ),
        (("base_link",), {"changes": [{"body": "base_link", "mass": 0.0, "com": [0, 0, 0]}]}, "the mass is 0"),
    ],
)
def test_bad_priors_are_errors(tmp_path, names, unknowns, message):
    with pytest.raises(InputError, match=message):
        load_model(study_of(tmp_path, names, **unknowns))
