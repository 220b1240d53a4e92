"""The loop with real sensors: every manoeuvre planned from the posterior, and flown only if all limits hold."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.design import DOptimal, Laplace, Loop, RelativePrecision, Search
from bayesid.design.excitation_loop import flown
from bayesid.design.knowledge_update import bodies_of_draws, updated_model
from bayesid.diagnosis import DiagnosisReview
from bayesid.inference.body_quantities import BodyDraws
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.recording.recording import Recording
from studies.common import mission
from studies.common.errors_in_deviations import squared_distances
from studies.common.models import ARM_SPREAD
from studies.common.quantities import JUDGED
from studies.common.tip_watch import flown_along
from studies.load import paper
from studies.load.setting import LOAD, SAFE, MuJoCoSpacecraft, load_unknown

__all__ = ["AT_MOST", "GOAL", "SPREAD", "Flight", "fly_again", "fly_loop"]

SPREAD = 2.0
"""Relative width of the load's prior: a tenth to thirty times of the truth lies within one width."""

GOAL, AT_MOST = 1e-3, 5
"""Relative precision to reach, and the largest number of manoeuvres."""


LIMITED = ("tip_speed", "tip_rate", "base_rotation")
"""Names of the limits of `SAFE` that depend on the load."""


@dataclass(frozen=True)
class Flight:
    """Manoeuvres that were flown one after the other, and what was known of the load after each.

    Attributes
    ----------
    status : str
        Status with which the loop ended.
    plans : list of dict
        Entry of every step's plan in the loop's history.
    bodies : list of BodyDraws
        Posterior of the load after every manoeuvre.
    chi2 : list of float
        Chi-square per sample of every fit.
    largest : list of dict
        Largest values of the limited quantities in MuJoCo, by limit.
    reviews : list of dict
        Entry of every step's diagnosis in the loop's history; empty where the steps are not diagnosed.
    samples : list of int
        Number of samples of every fit.
    """

    status: str
    plans: list[dict[str, Any]]
    bodies: list[BodyDraws]
    chi2: list[float]
    largest: list[dict[str, float]]
    reviews: list[dict[str, Any]] = field(default_factory=list)
    samples: list[int] = field(default_factory=list)

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
    folder : Path
        Folder of the loop's files; an interrupted run goes on there.
    seed : int
        Seed of all random numbers.
    search : Search
        Effort of each design.
    progress : Progress
        Receiver of the fraction done.
    """
    own = mission.problem(load_unknown(SPREAD, ARM_SPREAD), mission.splines(), DOptimal(), limits=SAFE)
    loop = Loop(
        own,
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
        bodies=[bodies_of_draws(own.plan.model, item)[LOAD] for item in draws],
        chi2=[step["identification"]["chi2"] / step["identification"]["samples"] for step in done],
        largest=[_largest(spacecraft, folder / f"step-{step['step']}-plan.csv") for step in done],
        reviews=[step["diagnosis"] for step in done],
        samples=[step["identification"]["samples"] for step in done],
    )


def fly_again(folder: Path, flight: Flight, *, seed: int) -> Flight:
    """Fly the loop's manoeuvres with the arm known exactly, which is the idealised case.

    Parameters
    ----------
    folder : Path
        Folder of the loop's files.
    flight : Flight
        The loop's flight.
    seed : int
        Seed of bias and noise.
    """
    own = mission.problem(load_unknown(SPREAD, 0.0), mission.splines(), DOptimal(), limits=SAFE)
    spacecraft, model, bodies, chi2, largest = MuJoCoSpacecraft(seed), own.plan.model, [], [], []
    for number in range(1, len(flight.bodies) + 1):
        file = folder / f"step-{number}-plan.csv"
        plan = Recording.read(file)
        posterior = Posterior.of(model, [flown(own.plan, spacecraft.execute(plan), mission.ENCODERS)])
        kept = folder / f"exact-{number}-posterior.nc"
        entry = Laplace().identify(posterior, seed + number, kept)
        draws = InertialDraws.read(kept)
        model = updated_model(own.plan.model, draws)
        bodies.append(bodies_of_draws(own.plan.model, draws)[LOAD])
        chi2.append(entry["chi2"] / entry["samples"])
        largest.append(_largest(spacecraft, file))
    return Flight(flight.status, flight.plans, bodies, chi2, largest)


def _largest(spacecraft: MuJoCoSpacecraft, file: Path) -> dict[str, float]:
    course = flown_along(spacecraft.robot, spacecraft.motion(Recording.read(file)), mission.DURATION)
    return {name: course.largest(name) for name in LIMITED}
