"""Section 4.2 without noise and without prior: plan, execute, identify, twice, from the paper's initial guess."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design import Criterion, Paper26Intended, PlannedMotion, Search, optimise
from bayesid.design.design_problem import Known
from bayesid.design.simulated_spacecraft import plan_recording
from bayesid.inference.mode import fit
from bayesid.inference.posterior import Posterior
from bayesid.recording.recording import Recording
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.model import Manoeuvre
from studies.load import paper
from studies.load.setting import DURATION, INTERVAL, MuJoCoSpacecraft, excitation, model, problem

__all__ = ["Iteration", "iterate"]

STEP = 0.5
"""Integration step of the fit [s]."""

SEARCHED = (
    (0.5889, -0.9512, -1.388, -0.1733, 0.2603, -0.9514),
    (0.6149, -0.952, -1.3178, 0.241, 0.3158, -0.9504),
)
"""Results of the full study's searches, used by a quick one: q1 and q2 of the first three joints [rad] in both
iterations."""


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
    misfit : float
        Root mean square residual over 1e-5 rad/s and 1e-5 m/s2.
    excursion : (6,) array
        Largest displacement [m] and rotation [rad] of the base that was planned, by axis.
    """

    parameters: Floats
    recording: Recording
    estimate: Floats
    misfit: float
    excursion: Floats

    @property
    def worst(self) -> float:
        """Largest relative error of the estimate."""
        return float(np.abs(paper.errors(self.estimate)).max())


def iterate(
    criterion: Criterion = Paper26Intended(),  # noqa: B008  (immutable)
    *,
    seed: int = 0,
    search: Search | None = None,
) -> list[Iteration]:
    """Plan by a criterion of the paper, fly with MuJoCo, fit by least squares; then again from the estimate.

    Where no search is given, the manoeuvres are those of `SEARCHED`.
    """
    known, spacecraft = model(1.0), MuJoCoSpacecraft()
    present = problem(known, excitation(), criterion)
    z: Floats = np.zeros(10)
    iterations = []
    time = np.arange(0.0, DURATION + 1e-9, INTERVAL)
    streams = np.random.SeedSequence(seed).spawn(len(SEARCHED))
    for number, (stream, searched) in enumerate(zip(streams, SEARCHED, strict=True), start=1):
        best: Floats = np.array(searched)
        if search is not None:
            best = optimise(present, criterion, np.random.default_rng(stream), search).parameters
        plan = plan_recording(present.plan.family.motion(best), known.robot, time, f"iteration {number}")
        recording = spacecraft.execute(plan)
        motion = PlannedMotion(plan, [joint.name for joint in known.robot.joints])
        posterior = Posterior.of(known, [Manoeuvre(recording, motion)], step=STEP, flat_prior=True)
        optimum = fit(posterior, z)
        z = optimum.z
        iterations.append(
            Iteration(
                parameters=best,
                recording=recording,
                estimate=mass_com_inertia(np.asarray(posterior.unknowns.values_at(z).inertial)),
                misfit=float(np.sqrt(optimum.chi2 / posterior.samples)),
                excursion=np.abs(present.trajectory(best).excursion).max(axis=0),
            )
        )
        present = present.knowing(Known(z, np.eye(10)))
    return iterations
