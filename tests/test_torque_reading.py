"""Friction and torque errors that MuJoCo hides in the joint torques are found beside the verdict on the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bayesid import InputError, MeasuredMotion, Robot
from bayesid.diagnosis import Status, diagnose
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.evidence.verdict import ProbableVerdict
from bayesid.diagnosis.outcome.torque_reading import TorqueReading, TorquesNotRead, read_torques, torques_beside
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.diagnosis.response.present_fit import fit_present_model
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import JointFriction, TorqueBias, WheelMomentum
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from studies.truth import mujoco as mj
from tests.conftest import ENCODER, PLANAR, STEP

SIGMA = 0.02
"""Noise of the torque sensors [N m], of which the motion takes some 0.3."""

COULOMB, VISCOUS, OFFSET = 0.1, 4.0, 0.05
"""Friction [N m, N m s] that is hidden in joint 2, and the error of a torque sensor [N m]."""

Case = tuple[Model, list[Manoeuvre]]


@pytest.fixture(scope="module")
def flown(planar_truth, noisy, planar_posterior) -> Callable[..., Case]:
    """Return a function that records the small case with torques, to which something is added."""
    known = planar_posterior(np.random.default_rng(0), step=STEP).model
    model = replace(known, torque=TorqueSensor(("joint1", "joint2"), (SIGMA, SIGMA)))

    def make(seed: int, hidden: np.ndarray | float = 0.0) -> Case:
        rng = np.random.default_rng(seed)
        bare, torque = noisy(rng), planar_truth.torque
        read = torque + hidden + SIGMA * rng.normal(size=torque.shape)
        channels = {**bare.channels, "torque.joint1": read[:, 0], "torque.joint2": read[:, 1]}
        recording = replace(bare, channels=channels)
        moved = MeasuredMotion.from_recording(recording, Robot.from_urdf(PLANAR), sigma={0: ENCODER})
        return model, [Manoeuvre(recording, moved)]

    return make


@pytest.fixture
def friction(planar_truth: mj.Truth) -> np.ndarray:
    speed = planar_truth.speed[:, 1]
    return np.stack([0.0 * speed, COULOMB * np.sign(speed) + VISCOUS * speed], axis=1)


def fitted(case: Case) -> Hypothesis:
    model, manoeuvres = case
    perturbed = PerturbedModel(Posterior.of(model.without_torque, manoeuvres, step=STEP))
    return Hypothesis(perturbed, fit_present_model(perturbed).fit)


def read(case: Case) -> TorqueReading:
    return read_torques(fitted(case), case[0], CausePrior(), np.random.default_rng(0))


@pytest.mark.slow
def test_friction_of_one_joint_is_named_and_measured(flown, friction):
    found = read(flown(3, friction))
    assert found.verdict.status is Status.EXPLAINED
    assert found.verdict.causes == ("joint-friction:joint2",)
    cause = found.causes[0]
    assert cause.probability > 0.99
    assert (cause.sd < [0.1 * COULOMB, 0.1 * VISCOUS]).all()
    np.testing.assert_allclose((cause.mean - [COULOMB, VISCOUS]) / cause.sd, 0.0, atol=3.0)
    before, after = found.chi2_per_sample
    assert before > 10.0
    assert 0.8 < after < 1.25


@pytest.mark.slow
def test_an_error_of_a_sensor_is_told_from_friction(flown):
    found = read(flown(4, np.array([OFFSET, 0.0])))
    assert found.verdict.causes == ("torque-bias:joint1",)
    cause = found.causes[0]
    assert cause.mean[0] == pytest.approx(OFFSET, abs=3.0 * cause.sd[0])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5, 8))
def test_torques_that_lack_nothing_raise_no_alarm(flown, seed):
    found = read(flown(seed))
    assert found.verdict.status is Status.ADEQUATE
    assert found.p_value > 0.01
    assert found.chi2_per_sample[0] == found.chi2_per_sample[1] == pytest.approx(1.0, abs=0.25)


@pytest.mark.slow
def test_a_torque_that_nobody_listed_is_unknown(flown, planar_truth):
    """A cable that pulls the joint back, as a spring does, by its position."""
    spring = 0.5 * (planar_truth.position[:, 1] - planar_truth.position[:, 1].mean())
    found = read(flown(9, np.stack([0.0 * spring, spring], axis=1)))
    assert found.verdict.status is Status.UNKNOWN
    assert found.probabilities.unknown > 0.99


@pytest.mark.usefixtures("slow")  # another model is compiled
def test_friction_that_the_study_knows_is_not_found_again(flown, friction):
    model, manoeuvres = flown(10, friction)
    found = read((replace(model, effects=(*model.effects, JointFriction("joint2"))), manoeuvres))
    assert found.verdict.status is Status.ADEQUATE
    assert "joint-friction:joint2" not in {cause.name for cause in found.causes}


@pytest.mark.usefixtures("slow")  # another model is compiled
def test_torques_are_read_where_the_study_knows_every_candidate(flown, friction):
    model, manoeuvres = flown(10, friction)
    known = [kind(joint) for joint in ("joint1", "joint2") for kind in (JointFriction, TorqueBias)]
    found = read((replace(model, effects=(*model.effects, *known)), manoeuvres))
    assert found.verdict.status is Status.ADEQUATE


@pytest.mark.slow
@pytest.mark.parametrize(
    "verdict",
    [ProbableVerdict(Status.UNKNOWN), ProbableVerdict(Status.AMBIGUOUS, ("rate-bias",), {}, (("unknown",),))],
    ids=["unknown", "or unknown"],
)
def test_torques_are_not_read_beside_a_motion_that_may_hold_something_without_a_name(flown, verdict):
    case = flown(11)
    found = torques_beside(verdict, fitted(case), case[0], CausePrior(), np.random.default_rng(0))
    assert isinstance(found, TorquesNotRead)
    assert "no name" in found.reason


@pytest.mark.slow
def test_a_diagnosis_reads_the_torques_beside_its_verdict(flown, friction):
    found = diagnose(*flown(12, friction), effects=[WheelMomentum()])
    assert found.verdict.status is Status.ADEQUATE
    written = found.to_dict()["joint_torques"]
    assert written["status"] == "explained"
    assert written["causes"] == ["joint-friction:joint2"]
    size = written["candidates"][0]["amplitude"]["coulomb"]
    assert size["mean"] == pytest.approx(COULOMB, abs=4.0 * size["sd"])


@pytest.mark.usefixtures("slow")
def test_torques_in_other_units_are_refused_before_anything_is_fitted(flown):
    model, (manoeuvre,) = flown(13)
    robot = Robot.from_urdf(PLANAR)
    model = replace(model, robot=robot, priors=(replace(model.priors[0], centre=robot.link("base_link").inertial),))
    channels = manoeuvre.recording.channels
    wrong = {key: 1e3 * value if key.startswith("torque") else value for key, value in channels.items()}
    recording = replace(manoeuvre.recording, channels=wrong)
    with pytest.raises(InputError, match=r"column torque\.joint\d"):
        diagnose(model, [replace(manoeuvre, recording=recording)])
