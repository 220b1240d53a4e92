"""Problem 2 of the paper on MuJoCo as the spacecraft: without noise as in the paper, and in the loop that is safe."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bayesid import BodyPrior, Load, Model, Recording, Robot
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.design import (
    DOptimal,
    Laplace,
    Loop,
    Paper26Intended,
    PaperExcitation,
    PlannedMotion,
    RelativePrecision,
    Search,
    optimise,
)
from bayesid.design.design_problem import Known
from bayesid.design.design_result import sample_times
from bayesid.design.excitation_loop import flown
from bayesid.design.knowledge_update import bodies_of_draws, updated_model
from bayesid.design.simulated_spacecraft import plan_recording
from bayesid.diagnosis import DiagnosisReview
from bayesid.inference.body_quantities import BodyDraws
from bayesid.inference.mode import fit
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.effects import SensorBias
from bayesid.simulation.model import RATE_SIGMA, Manoeuvre, spread_links
from bayesid.simulation.sensors import SensorKind
from studies.common import mission
from studies.common.ets7 import BASE, BIAS, INTERVAL, LIMITS
from studies.common.flight import flown_along, readings
from studies.common.models import ARM_SPREAD, NOISE, orbiting_model
from studies.common.quantities import JUDGED, body_of, squared_distances
from studies.load import paper

LOAD, LINK = "load", "link6"  # name of the load, and link that carries it

# rule of the flight, and a bound on the rotation of the base [rad], which depends on the load
SAFE = replace(LIMITS, base_rotation=0.5)

LIMITED = ("tip_speed", "tip_rate", "base_rotation")  # names of the limits of `SAFE` that depend on the load
SPREAD = 2.0  # relative width of the load's prior: a tenth to thirty times of the truth lies within one width
GOAL, AT_MOST = 1e-3, 5  # relative precision to reach, and the largest number of manoeuvres

# MuJoCo's step without noise [s]; with twice that its own error is up to 5e-6 of the load's quantities
TRUTH_STEP = 0.25


def robot_with_load(load: Floats = paper.GUESS, robot: Robot | None = None) -> Robot:
    """Return ETS-VII, by default with the nominal arm, and a load of ten quantities."""
    return (mission.published_robot() if robot is None else robot).with_load(Load(LOAD, LINK, body_of(load)))


def load_unknown(spread: float, arm_spread: float) -> Model:
    """Return what is known before the first manoeuvre: the base exactly, the arm to some width, the paper's guess.

    Parameters
    ----------
    spread, arm_spread : float; relative widths of the priors of the load and of the links
    """
    robot = robot_with_load()
    links = spread_links(robot, arm_spread, (BASE, LOAD))
    prior = BodyPrior(LOAD, body_of(paper.GUESS), spread)
    return orbiting_model(robot, [prior, *links], SensorBias.of(SensorKind.ACCEL)(BIAS), rate_sigma=RATE_SIGMA)


def excitation() -> PaperExcitation:
    """Return the paper's motion (27): the first three joints oscillate, the wrist is extended."""
    return PaperExcitation(mission.start(), mission.DURATION)


@dataclass(frozen=True)
class MuJoCoSpacecraft:
    """ETS-VII with the true load in MuJoCo, at rest before every manoeuvre."""

    seed: int | None = None  # seed of arm, bias and noise; the arm is nominal and there is no noise where left out
    arm_spread: float = 0.0  # relative width of the distribution from which the true arm is drawn
    step: float = mission.TRUTH_STEP  # MuJoCo's integration step [s]

    @cached_property
    def robot(self) -> Robot:
        """The robot as it truly is."""
        if self.seed is None or self.arm_spread == 0.0:
            return robot_with_load(paper.TRUTH)
        return robot_with_load(
            paper.TRUTH, mission.true_arm(mission.published_robot(), np.random.default_rng(self.seed), self.arm_spread)
        )

    def motion(self, plan: Recording) -> PlannedMotion:
        """Return the motion of the joints that a plan leads to."""
        return PlannedMotion(plan, [joint.name for joint in self.robot.joints])

    def execute(self, plan: Recording) -> Recording:
        """Fly a plan and return its recording."""
        truth = mission.fly(self.motion(plan), self.robot, step=self.step)
        rng = None if self.seed is None else np.random.default_rng([self.seed, *plan.name.encode()])
        if self.seed is not None:
            bias = BIAS * np.random.default_rng([self.seed, 1]).standard_normal(3)
            truth = truth._replace(accel=truth.accel + bias)
        channels = readings(truth, [joint.name for joint in self.robot.joints], NOISE, rng, by_channel=NOISE)
        return Recording(plan.name, None, plan.time, channels)

    def largest(self, file: Path) -> dict[str, float]:
        """Return the largest values of the limited quantities along a plan of a file, by limit."""
        course = flown_along(self.robot, self.motion(Recording.read(file)), mission.DURATION)
        return {name: course.largest(name) for name in LIMITED}


@dataclass(frozen=True)
class Iteration:
    """One plan, execution and identification without noise."""

    parameters: Floats  # (6,): parameters q1 and q2 of the first three joints [rad]
    estimate: Floats  # (10,): estimated quantities of the load, in the order of `paper.TRUTH`

    @property
    def worst(self) -> float:
        """Largest relative error of the estimate."""
        return float(np.abs(paper.errors(self.estimate)).max())


def iterate(*, seed: int, search: Search) -> list[Iteration]:
    """Plan by the paper's criterion as intended, fly with MuJoCo, fit by least squares; then again from the estimate.

    The arm is known exactly, the base starts at rest, and there is neither noise nor bias nor prior.

    Parameters
    ----------
    seed : int; seed of the searches
    search : Search; effort of each design
    """
    known = orbiting_model(robot_with_load(), [BodyPrior(LOAD, body_of(paper.GUESS), 1.0)], rate_sigma=0.0)
    spacecraft, criterion = MuJoCoSpacecraft(step=TRUTH_STEP), Paper26Intended()
    present = mission.problem(known, excitation(), criterion)
    z: Floats = np.zeros(10)
    iterations = []
    for number, stream in enumerate(np.random.SeedSequence(seed).spawn(2), start=1):  # two, as in the paper
        best = optimise(present, criterion, np.random.default_rng(stream), search).parameters
        time = sample_times(mission.DURATION, INTERVAL)
        plan = plan_recording(present.plan.family.motion(best), known.robot, time, f"iteration {number}")
        motion = PlannedMotion(plan, [joint.name for joint in known.robot.joints])
        recorded = Manoeuvre(spacecraft.execute(plan), motion)
        posterior = Posterior.of(known, [recorded], step=0.5, flat_prior=True)
        z = fit(posterior, z).z
        iterations.append(Iteration(best, mass_com_inertia(np.asarray(posterior.unknowns.values_at(z).inertial))))
        present = present.knowing(Known(z, np.eye(10)))
    return iterations


@dataclass(frozen=True)
class Flight:
    """Manoeuvres that were flown one after the other, and what was known of the load after each."""

    status: str  # status with which the loop ended
    plans: list[dict[str, Any]]  # entry of every step's plan in the loop's history
    bodies: list[BodyDraws]  # posterior of the load after every manoeuvre
    chi2: list[float]  # chi-square per sample of every fit
    largest: list[dict[str, float]]  # largest values of the limited quantities in MuJoCo, by limit
    # entry of every step's diagnosis in the loop's history; empty where the steps are not diagnosed
    reviews: list[dict[str, Any]] = field(default_factory=list)
    samples: list[int] = field(default_factory=list)  # number of samples of every fit

    def error(self, step: int) -> Floats:
        """Return the posterior mean less the truth over `paper.SCALE`, shape (10,)."""
        return paper.errors(self.bodies[step].mean)

    def relative(self, step: int) -> Floats:
        """Return the posterior standard deviations over `paper.SCALE`, shape (10,)."""
        return self.bodies[step].sd / paper.SCALE

    def chi2_errors(self) -> list[float]:
        """Return by how much each chi-square per sample is off one, in the standard deviation that is due."""
        return [(value - 1.0) / np.sqrt(2.0 / count) for value, count in zip(self.chi2, self.samples, strict=True)]

    def distance(self, step: int) -> float:
        """Return the squared Mahalanobis distance of the truth from the posterior mean; ten on average."""
        body = self.bodies[step]
        return float(squared_distances(body.mean - paper.TRUTH, np.cov(body.values.T)))

    def worst(self, step: int) -> tuple[float, float]:
        """Return largest relative error and standard deviation of mass and moments of inertia."""
        return float(np.abs(self.error(step)[JUDGED]).max()), float(self.relative(step)[JUDGED].max())

    @property
    def used(self) -> dict[str, float]:
        """Largest fraction of every limit that was used in MuJoCo, by limit."""
        return {name: max(row[name] for row in self.largest) / getattr(SAFE, name) for name in self.largest[0]}


def fly_loop(folder: Path, *, seed: int, search: Search, progress: Progress = silent) -> Flight:
    """Fly the loop with the arm known to 5 %, on a spacecraft whose arm is drawn from that; every step is diagnosed.

    Parameters
    ----------
    folder : Path; folder of the loop's files; an interrupted run goes on there
    seed : int; seed of all random numbers
    search : Search; effort of each design
    progress : Progress; receiver of the fraction done
    """
    problem = mission.problem(load_unknown(SPREAD, ARM_SPREAD), mission.splines(), DOptimal(), limits=SAFE)
    loop = Loop(
        problem,
        mission.ENCODERS,
        seed=seed,
        goals=(RelativePrecision(GOAL),),
        at_most=AT_MOST,
        search=search,
        identifier=Laplace(),
        reviewer=DiagnosisReview(knows_latitude=True),
    )
    spacecraft = MuJoCoSpacecraft(seed, ARM_SPREAD)
    history = loop.run(spacecraft, folder, progress)
    done = [step for step in history.steps if "identification" in step]
    draws = [InertialDraws.read(history.path(step["step"], "identification")) for step in done]
    return Flight(
        status=history.status,
        plans=[step["plan"] for step in history.steps],
        bodies=[bodies_of_draws(problem.plan.model, drawn)[LOAD] for drawn in draws],
        chi2=[step["identification"]["chi2"] / step["identification"]["samples"] for step in done],
        largest=[spacecraft.largest(folder / f"step-{step['step']}-plan.csv") for step in done],
        reviews=[step["diagnosis"] for step in done],
        samples=[step["identification"]["samples"] for step in done],
    )


def fly_again(folder: Path, flight: Flight, *, seed: int) -> Flight:
    """Fly the loop's manoeuvres with the arm known exactly, which is the idealised case.

    Parameters
    ----------
    folder : Path; folder of the loop's files
    flight : Flight; the loop's flight
    seed : int; seed of bias and noise
    """
    problem = mission.problem(load_unknown(SPREAD, 0.0), mission.splines(), DOptimal(), limits=SAFE)
    spacecraft, model, bodies, chi2, largest = MuJoCoSpacecraft(seed), problem.plan.model, [], [], []
    for number in range(1, len(flight.bodies) + 1):
        file = folder / f"step-{number}-plan.csv"
        plan = Recording.read(file)
        posterior = Posterior.of(model, [flown(problem.plan, spacecraft.execute(plan), mission.ENCODERS)])
        kept = folder / f"exact-{number}-posterior.nc"
        entry = Laplace().identify(posterior, seed + number, kept)
        draws = InertialDraws.read(kept)
        model = updated_model(problem.plan.model, draws)
        bodies.append(bodies_of_draws(problem.plan.model, draws)[LOAD])
        chi2.append(entry["chi2"] / entry["samples"])
        largest.append(spacecraft.largest(file))
    return Flight(flight.status, flight.plans, bodies, chi2, largest)
