"""The loop with real sensors: plans from the posterior, flown by MuJoCo with noise, sampled by emcee."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bayesid._math.arrays import Floats
from bayesid.design import (
    BSplines,
    Criterion,
    DOptimal,
    Limits,
    Loop,
    Paper26Intended,
    RelativePrecision,
    Sampled,
    Search,
)
from bayesid.design.knowledge_update import bodies_of_draws
from bayesid.inference.body_quantities import BodyDraws
from bayesid.inference.posterior_as_prior import InertialDraws
from studies.common.ets7 import ENCODER
from studies.common.ets7_model import extended_start
from studies.load import paper
from studies.load.setting import DURATION, LIMITS, LOAD, MuJoCoSpacecraft, excitation, model, problem

__all__ = ["Flight", "fly_all"]

SPREAD = 2.0
"""Relative width of the load's prior: a tenth to thirty times of the truth lies within one width."""

RATE = 1e-3
"""Standard deviation of the prior of the initial rate [rad/s]. The base is at rest, but joints measured to a
micro-radian are known to rest only to some 1e-5 rad/s at time 0; if the initial rate were taken for exactly zero, that
would become an error of the momentum."""

CAREFUL = Limits(joint_speed=LIMITS.joint_speed, base_rotation=0.5)
"""Limits that also bound the rotation of the base [rad], whatever the load is."""


@dataclass(frozen=True)
class Flight:
    """A loop that was flown.

    Attributes
    ----------
    status : str
        Status with which the loop ended.
    plans : list of dict
        Entry of every step's plan in the loop's history.
    identifications : list of dict
        Entry of every identification in the loop's history.
    precisions : list of float
        Worst relative standard deviation of mass and principal moments after every identification.
    bodies : list of BodyDraws
        Posterior of the load after every identification.
    """

    status: str
    plans: list[dict[str, Any]]
    identifications: list[dict[str, Any]]
    precisions: list[float]
    bodies: list[BodyDraws]

    def shift(self, step: int) -> Floats:
        """Return the posterior mean less the truth, in standard deviations, shape (10,)."""
        return (self.bodies[step].mean - paper.TRUTH) / self.bodies[step].sd

    def relative(self, step: int) -> Floats:
        """Return the posterior standard deviations over `paper.SCALE`, shape (10,)."""
        return self.bodies[step].sd / paper.SCALE


def fly_all(
    *, seed: int = 0, search: Search, effective_samples: float = 2000.0, at_most: int = 2
) -> Mapping[str, Flight]:
    """Fly the loop in the paper's way, its criterion on its motion, and with d-optimal B-splines of all joints."""
    known, paper_motion = model(SPREAD, RATE), excitation()
    jolts = (paper_motion.ramp, DURATION - paper_motion.ramp)
    splines = BSplines(extended_start(), range(6), DURATION, points=5)
    cases: dict[str, tuple[Any, Criterion, Limits, MuJoCoSpacecraft]] = {
        "paper": (paper_motion, Paper26Intended(), LIMITS, MuJoCoSpacecraft(seed, jolts)),
        "careful": (splines, DOptimal(), CAREFUL, MuJoCoSpacecraft(seed)),
    }
    flights = {}
    for name, (family, criterion, limits, spacecraft) in cases.items():
        loop = Loop(
            problem(known, family, criterion, limits=limits),
            {0: ENCODER},
            seed=seed,
            goals=(RelativePrecision(1e-6),),
            at_most=at_most,
            search=search,
            identifier=Sampled(effective_samples),
        )
        flights[name] = _fly(loop, spacecraft)
    return flights


def _fly(loop: Loop, spacecraft: MuJoCoSpacecraft) -> Flight:
    with TemporaryDirectory() as folder:
        history = loop.run(spacecraft, Path(folder))
        flown = [step for step in history.steps if "identification" in step]
        files = [history.path(step["step"], "identification") for step in flown]
        return Flight(
            status=history.status,
            plans=[step["plan"] for step in history.steps],
            identifications=[step["identification"] for step in flown],
            precisions=[step["goals"][0]["value"] for step in flown],
            bodies=[bodies_of_draws(loop.problem.plan.model, InertialDraws.read(file))[LOAD] for file in files],
        )
