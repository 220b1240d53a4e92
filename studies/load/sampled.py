"""The loop with real sensors: plans from the posterior, flown by MuJoCo with noise, sampled by emcee."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid.design import BSplines, Criterion, DOptimal, Limits, Loop, Paper26Intended, Sampled, Search
from bayesid.design.knowledge_update import bodies_of_draws
from bayesid.inference.body_quantities import BodyDraws
from bayesid.inference.posterior_as_prior import InertialDraws
from bayesid.recording.recording import Recording
from studies.common.ets7 import ENCODER, extended_wrist
from studies.load import paper
from studies.load.setting import DURATION, LIMITS, LOAD, MuJoCoSpacecraft, excitation, model, problem

__all__ = ["Flight", "fly_all"]

Floats = NDArray[np.floating]

SPREAD = 2.0
"""Of the load's prior in log-Cholesky coordinates: from a tenth to thirty times of the truth is within one width."""

RATE = 1e-3
"""Of the prior of the initial rate [rad/s]. The base is at rest, but joints measured to a micro-radian are known to
rest only to some 1e-5 rad/s at time 0, which an initial rate of exactly zero would make an error of the momentum."""

CAREFUL = Limits(joint_speed=LIMITS.joint_speed, base_rotation=0.5)
"""And how far the base may turn [rad], whatever load it is."""


@dataclass(frozen=True)
class Flight:
    """A loop that was flown.

    Attributes
    ----------
    status : str
    plans : list of dict
        What was planned, of every step.
    identifications : list of dict
    bodies : list of BodyDraws
        Posterior of the load after every step.
    recordings : list of Recording
    """

    status: str
    plans: list[dict[str, Any]]
    identifications: list[dict[str, Any]]
    bodies: list[BodyDraws]
    recordings: list[Recording]

    def shift(self, step: int) -> Floats:
        """Return how far the posterior mean is from the truth, in standard deviations, shape (10,)."""
        body = self.bodies[step]
        return (body.mean - paper.TRUTH) / body.sd

    def relative(self, step: int) -> Floats:
        """Return standard deviations relative to the truth; of products of inertia to the moments, shape (10,)."""
        return self.bodies[step].sd / np.where(paper.TRUTH == 0.0, paper.TRUTH[4], np.abs(paper.TRUTH))


def fly_all(
    *, seed: int = 0, search: Search, effective_samples: float = 2000.0, at_most: int = 2
) -> Mapping[str, Flight]:
    """Fly the paper's way, its criterion on its family; and ours, d-optimal B-splines of all joints, within limits."""
    known = replace(model(SPREAD), rate_sigma=RATE)
    start = [0.0, 0.0, 0.0, *extended_wrist()]
    paper_motion = excitation()
    jolts = (paper_motion.ramp, DURATION - paper_motion.ramp)
    cases: dict[str, tuple[Any, Criterion, Limits, MuJoCoSpacecraft]] = {
        "paper": (paper_motion, Paper26Intended(), LIMITS, MuJoCoSpacecraft(seed, jolts)),
        "careful": (BSplines(start, range(6), DURATION, points=5), DOptimal(), CAREFUL, MuJoCoSpacecraft(seed)),
    }
    flights = {}
    for name, (family, criterion, limits, spacecraft) in cases.items():
        loop = Loop(
            problem(known, family, criterion, limits=limits),
            {0: ENCODER},
            seed=seed,
            wanted=1e-6,
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
            bodies=[bodies_of_draws(loop.problem.plan.model, InertialDraws.read(file))[LOAD] for file in files],
            recordings=[Recording.read(history.path(step["step"], "recording")) for step in flown],
        )
