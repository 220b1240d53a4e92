"""The loop of plan, execute, identify, update: what it finds, what it refuses to fly, and that it survives a kill."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from conftest import PLANAR
from jax import Array

from bayesid._io.errors import InputError
from bayesid.design import (
    BSplines,
    Laplace,
    Limits,
    Loop,
    NotFlown,
    Plan,
    PlannedMotion,
    Problem,
    RelativePrecision,
    Search,
    SimulatedSpacecraft,
    Tip,
)
from bayesid.design.criteria import Criterion, covariance
from bayesid.design.excitation_loop import flown
from bayesid.design.flight import Outcome
from bayesid.design.knowledge_update import bodies_of_draws, known_of
from bayesid.design.simulated_spacecraft import plan_recording
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensor, SensorKind, White

ENCODER = {0: 1e-6}
SENSORS = (Sensor(SensorKind.RATE, White(1e-5)), Sensor(SensorKind.ACCEL, White(2e-5), position=(0.1, -0.15, 0.3)))
TRUE = InertialParameters(61.2, [0.0525, -0.028, 0.0015], [[2.42, 0.047, 0.0], [0.047, 2.64, 0.0], [0.0, 0.0, 2.82]])
"""As the prior has it, which is so narrow that normal approximations do: at 5 % they lose a tenth of some widths."""
LIMITS = Limits(joint_speed=0.5, base_rotation=0.024)


def robot_of(base: InertialParameters) -> Robot:
    return Robot.from_urdf(PLANAR).with_inertial("base_link", base)


def model_of(base: InertialParameters, spread: float) -> Model:
    return Model(robot_of(base), SENSORS, (BodyPrior("base_link", base, spread),))


@dataclass(frozen=True)
class Swing(Criterion):
    """A criterion of one's own: how far the base turns about z.

    It needs no derivative of what the sensors read, which would take long to compile.
    """

    name = "swing"
    informed = False

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        return -jnp.mean(outcome.trajectory.excursion[:, 5] ** 2)


def problem() -> Problem:
    """Twelve seconds of two joints; the prior is 2 % wide in every coordinate."""
    model = model_of(Robot.from_urdf(PLANAR).link("base_link").inertial, 0.02)
    family = BSplines([0.3, -0.6], (0, 1), 12.0, points=3)
    return Problem(Plan(model, family, interval=0.25, tip=Tip.of(model.robot), step=1.0), LIMITS, (Swing(),))


PROBLEM = problem()


def loop_of(**options) -> Loop:
    """One of the problem.

    Two starts end in local optima, which differ with the rounding of other numbers of threads. With this seed they
    reach the limit on the base's rotation under all that were tried.
    """
    settings = {
        "goals": (RelativePrecision(0.0),),
        "at_most": 2,
        "search": Search(2, 40),
        "identifier": Laplace(),
        "seed": 4,
        **options,
    }
    return Loop(PROBLEM, ENCODER, **settings)


def mass_alone(bodies) -> float:
    """A planar robot tells nothing of some moments of inertia."""
    return bodies["base_link"].sd[0] / bodies["base_link"].mean[0]


TRUTH = SimulatedSpacecraft(model_of(TRUE, 1.0), encoder_sigma=1e-6, seed=8)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory):
    """Two steps without interruption."""
    return loop_of().run(TRUTH, tmp_path_factory.mktemp("loop"))


@pytest.mark.usefixtures("slow")
def test_every_step_narrows_the_posterior_about_the_truth(done):
    assert done.status == "at-most"
    bodies = [step["identification"]["bodies"]["base_link"] for step in done.steps]
    for step, body in zip(done.steps, bodies, strict=True):
        fit = step["identification"]
        assert abs(fit["chi2"] / fit["samples"] - 1.0) < 5.0 * np.sqrt(2.0 / fit["samples"])
        assert abs(body["mass"]["mean"] - TRUE.mass) < 4.0 * body["mass"]["sd"]
    first, second = (np.array([item["sd"] for item in body.values()]) for body in bodies)
    # what moves in a plane tells nothing of some moments of inertia
    assert (second < 1.1 * first).all()
    assert (second < 0.9 * first).sum() >= 2
    assert second[0] < 0.5  # the prior's is 2.4 kg


@pytest.mark.usefixtures("slow")
def test_what_may_break_a_limit_is_shrunk_before_it_is_flown(done):
    attempts = done.steps[0]["plan"]["attempts"]
    assert [attempt["go"] for attempt in attempts] == [False] * (len(attempts) - 1) + [True]
    assert len(attempts) > 1
    first, last = (attempt["limits"]["base_rotation"] for attempt in (attempts[0], attempts[-1]))
    assert first["quantile_99"] > first["limit"] == first["designed_for"]
    assert last["quantile_99"] <= last["limit"]
    assert last["designed_for"] < last["limit"]
    # and what became known lets the second go farther
    assert done.steps[1]["plan"]["attempts"][-1]["limits"]["base_rotation"]["designed_for"] > last["designed_for"]


@pytest.mark.usefixtures("slow")
def test_an_interrupted_loop_ends_with_the_very_same_numbers(done, tmp_path: Path):
    class Tired:
        """It fails in the middle of the second step."""

        def execute(self, plan: Recording) -> Recording:
            if plan.name == "step-2":
                raise RuntimeError("killed")
            return TRUTH.execute(plan)

    with pytest.raises(RuntimeError, match="killed"):
        loop_of().run(Tired(), tmp_path)
    (tmp_path / "step-1-posterior.nc").unlink()  # the identification is lost as well
    again = loop_of().run(TRUTH, tmp_path)
    assert again.steps == [{**step, **_hash(again, index)} for index, step in enumerate(done.steps)]
    for name in ("step-1-plan.csv", "step-2-plan.csv", "step-2-recording.csv"):
        assert (tmp_path / name).read_bytes() == (done.folder / name).read_bytes()
    for first, second in zip(_draws(done), _draws(again), strict=True):
        np.testing.assert_array_equal(first, second)
    assert loop_of().run(Tired(), tmp_path).steps == again.steps  # nothing is left to be flown


def _hash(history, index: int) -> dict:
    """The identification of the other run with this one's hash: NetCDF files are not the same byte for byte."""
    own = history.steps[index]["identification"]
    return {"identification": own} if own["bodies"] else {}


def _draws(history) -> list[np.ndarray]:
    return [InertialDraws.read(history.path(number, "identification")).values for number in (1, 2)]


@pytest.mark.usefixtures("slow")
def test_two_steps_tell_what_one_identification_of_both_tells(done):
    loop = loop_of()
    plan = loop.problem.plan
    manoeuvres = [flown(plan, Recording.read(done.path(number, "recording")), ENCODER) for number in (1, 2)]
    seed = int(np.random.SeedSequence(1).generate_state(1)[0])
    file = done.folder / "both.nc"
    Laplace(20000).identify(Posterior.of(plan.model, manoeuvres), seed, file)
    joint = bodies_of_draws(plan.model, InertialDraws.read(file))["base_link"]
    bodies = done.steps[1]["identification"]["bodies"]["base_link"]
    mean, sd = (np.array([item[key] for item in bodies.values()]) for key in ("mean", "sd"))
    np.testing.assert_allclose(sd / joint.sd, 1.0, atol=0.06)
    np.testing.assert_array_less(np.abs(mean - joint.mean) / joint.sd, 0.25)


@pytest.mark.usefixtures("slow")
def test_it_stops_where_the_wanted_precision_is_reached_and_goes_on_when_more_is_wanted(done, tmp_path: Path):
    for file in done.folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    content = json.loads((tmp_path / "loop.json").read_text())
    del content["steps"][1]
    (tmp_path / "loop.json").write_text(json.dumps(content))
    history = loop_of(goals=(RelativePrecision(1.0),)).run(TRUTH, tmp_path)
    assert history.status == "reached"
    assert len(history.steps) == 1
    assert history.steps[0]["goals"][0]["reached"]
    assert len(loop_of(goals=(RelativePrecision(1.0, mass_alone),)).run(TRUTH, tmp_path).steps) == 1


@pytest.mark.usefixtures("slow")
def test_a_loop_waits_for_a_recording_and_refuses_a_changed_one(done, tmp_path: Path):
    class Nobody:
        def execute(self, plan: Recording) -> Recording:
            raise NotFlown

    for name in ("loop.json", "step-1-plan.csv", "step-1-recording.csv", "step-1-posterior.nc", "step-2-plan.csv"):
        (tmp_path / name).write_bytes((done.folder / name).read_bytes())
    history = loop_of().run(Nobody(), tmp_path)
    assert history.status == "waiting"
    assert "recording" not in history.steps[1]
    file = tmp_path / "step-1-recording.csv"
    file.write_text(file.read_text().replace("0.25,", "0.26,", 1))
    with pytest.raises(InputError, match="the recording of step 1 was changed after it was used"):
        loop_of().run(Nobody(), tmp_path)
    with pytest.raises(InputError, match="it belongs to another loop"):
        loop_of(seed=5).run(Nobody(), tmp_path)


@pytest.mark.usefixtures("slow")
def test_a_no_go_is_not_flown(done, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name in ("loop.json", "step-1-plan.csv"):
        (tmp_path / name).write_bytes((done.folder / name).read_bytes())
    content = json.loads((tmp_path / "loop.json").read_text())
    content["steps"][0]["plan"]["go"] = False
    (tmp_path / "loop.json").write_text(json.dumps(content))
    history = loop_of().run(TRUTH, tmp_path)
    assert history.status == "no-go"
    assert not (tmp_path / "step-1-recording.csv").exists()


def test_a_plan_is_flown_as_it_was_planned():
    robot = robot_of(TRUE)
    family = BSplines([0.3, -0.6], (0, 1), 12.0, points=3)
    motion = family.motion(np.array([0.4, -0.2, 0.3, 0.1, 0.5, -0.3]))
    plan = plan_recording(motion, robot, np.arange(0.0, 12.01, 0.25), "step-1")
    between = np.linspace(0.0, 12.0, 331)
    joints = [joint.name for joint in robot.joints]
    for mine, theirs in zip(PlannedMotion(plan, joints).evaluate(between), motion.evaluate(between), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-4)
    with pytest.raises(InputError, match=r"a plan has no velocity\.joint1"):
        PlannedMotion(Recording("bare", None, plan.time, {"position.joint1": plan.time}), joints)


@pytest.mark.usefixtures("slow")
def test_noise_follows_from_seed_and_step(done):
    plan = replace(Recording.read(done.path(1, "plan")), name="step-2")
    first, other = Recording.read(done.path(1, "recording")), TRUTH.execute(plan)
    assert np.abs(first.channels["rate.z"] - other.channels["rate.z"]).max() > 1e-6


def test_what_is_known_takes_the_place_of_the_prior():
    """Half as wide in every coordinate, and elsewhere."""
    unknowns, body = PROBLEM.plan.unknowns, PROBLEM.plan.model.priors[0]
    rng = np.random.default_rng(2)
    z = np.zeros((400, unknowns.size))
    z[:, :10] = 0.3 + 0.5 * rng.normal(size=(400, 10))
    values = np.stack([np.asarray(unknowns.values(row).inertial) for row in z])
    known = known_of(unknowns, InertialDraws((body.name,), values[:, None]))
    np.testing.assert_allclose(known.centre, z.mean(axis=0), atol=1e-8)
    np.testing.assert_allclose(known.precision[:10, :10], np.linalg.inv(np.cov(z[:, :10].T)), rtol=1e-6)
    problem = Problem(PROBLEM.plan, LIMITS, PROBLEM.criteria, known)
    draws = problem.draws(4000, rng)
    np.testing.assert_allclose(draws[:, :10].mean(axis=0), z[:, :10].mean(axis=0), atol=0.05)
    np.testing.assert_allclose(draws[:, :10].std(axis=0), z[:, :10].std(axis=0), atol=0.04)
    nothing = Outcome(None, np.zeros((unknowns.size, unknowns.size)), known.precision)
    np.testing.assert_allclose(
        covariance(PROBLEM.plan, nothing), body.spread**2 * np.cov(z[:, :10].T), rtol=1e-6, atol=1e-12
    )
