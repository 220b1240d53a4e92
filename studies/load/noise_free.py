"""Section 4.2 without noise and without prior: plan, execute, identify, twice, from the paper's initial guess."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design import Paper26Intended, PlannedMotion, Search, optimise
from bayesid.design.design_problem import Known
from bayesid.design.designed import sample_times
from bayesid.design.simulated_spacecraft import plan_recording
from bayesid.inference.mode import fit
from bayesid.inference.posterior import Posterior
from bayesid.recording.recording import Recording
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.model import Manoeuvre
from studies.common import mission
from studies.common.ets7 import INTERVAL
from studies.load import paper
from studies.load.setting import MuJoCoSpacecraft, excitation, ideal

__all__ = ["STEP", "TRUTH_STEP", "Iteration", "iterate"]

ITERATIONS = 2
"""Number of iterations, as in the paper."""

STEP = 0.5
"""Integration step of the fit [s]."""

TRUTH_STEP = 0.25
"""MuJoCo's integration step [s]; with twice that its own error is up to 5e-6 of the load's quantities."""


@dataclass(frozen=True)
class Iteration:
    """One plan, execution and identification.

    Attributes
    ----------
    parameters : (6,) array
        Parameters q1 and q2 of the first three joints [rad].
    recording : Recording
    estimate : (10,) array
        Estimated quantities of the load, in the order of `paper.TRUTH`.
    """

    parameters: Floats
    recording: Recording
    estimate: Floats

    @property
    def worst(self) -> float:
        """Largest relative error of the estimate."""
        return float(np.abs(paper.errors(self.estimate)).max())


def iterate(*, seed: int, search: Search) -> list[Iteration]:
    """Plan by the paper's criterion as intended, fly with MuJoCo, fit by least squares; then again from the estimate.

    Parameters
    ----------
    seed : int
        Seed of the searches.
    search : Search
        Effort of each design.
    """
    known, spacecraft, criterion = ideal(), MuJoCoSpacecraft(step=TRUTH_STEP), Paper26Intended()
    present = mission.problem(known, excitation(), criterion)
    z: Floats = np.zeros(10)
    iterations = []
    for number, stream in enumerate(np.random.SeedSequence(seed).spawn(ITERATIONS), start=1):
        best = optimise(present, criterion, np.random.default_rng(stream), search).parameters
        time = sample_times(mission.DURATION, INTERVAL)
        plan = plan_recording(present.plan.family.motion(best), known.robot, time, f"iteration {number}")
        recording = spacecraft.execute(plan)
        motion = PlannedMotion(plan, [joint.name for joint in known.robot.joints])
        posterior = Posterior.of(known, [Manoeuvre(recording, motion)], step=STEP, flat_prior=True)
        z = fit(posterior, z).z
        estimate = mass_com_inertia(np.asarray(posterior.unknowns.values_at(z).inertial))
        iterations.append(Iteration(best, recording, estimate))
        present = present.knowing(Known(z, np.eye(10)))
    return iterations
