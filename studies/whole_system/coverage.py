"""Whether the stated uncertainty holds the truth: systems drawn from the prior, flown and identified."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bayesid import Posterior, Robot
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.inference.parameterisation import LinearParameterisation
from bayesid.robot.body_prior import draw_inertial
from studies.common.ets7 import BASE
from studies.common.monte_carlo import run_trials
from studies.whole_system.sampled import distance, true_point
from studies.whole_system.setting import LOAD, bodies, model_of, spreads
from studies.whole_system.world import START_RATE, fly, record

__all__ = ["Coverage", "covered"]

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Coverage:
    """Over K drawn systems, whose bodies have n unknowns.

    Attributes
    ----------
    distances : (K,) array
        Squared distance of the true bodies from the mode; chi-square with n degrees of freedom if all is right.
    scores : (K, 3) array
        Errors of the masses of base, load and whole system in their standard deviations.
    unknowns : int
    """

    distances: Floats
    scores: Floats
    unknowns: int

    @property
    def p_value(self) -> float:
        """Of the distances being chi-square (Kolmogorov-Smirnov)."""
        return float(stats.kstest(self.distances, stats.chi2(self.unknowns).cdf).pvalue)


def covered(
    drawings: Robot, count: int, seed: int, *, torques: bool, duration: float, progress: Callable[[str], None]
) -> Coverage:
    """Draw systems from the prior about the drawings, fly, record and identify each.

    The posterior is the normal approximation in coordinates linear in the parameters. The fit starts at the truth, to
    save time: another start finds the same mode.
    """
    first: list[Posterior] = []  # its compiled functions serve all systems

    def system(number: int, rng: np.random.Generator) -> dict[str, Any]:
        """Distance and scores of one system."""
        truth = drawings
        for name, spread in spreads(drawings).items():
            truth = truth.with_inertial(name, draw_inertial(drawings.link(name).inertial, spread, rng))
        run = fly(truth, int(rng.integers(1000)), duration=duration, joints=tuple(range(len(drawings.joints))))
        manoeuvre = record(run, truth, "drawn", rng)
        if not first:
            first.append(Posterior.of(model_of(drawings, torques=torques), [manoeuvre]))
        posterior = with_manoeuvres(first[0], [manoeuvre])
        z = true_point(posterior, truth, START_RATE)
        refined = relinearised(posterior, z)
        optimum = fit(refined, z)
        proposal = LinearParameterisation(refined).proposal(optimum)
        covariance = proposal.factor @ proposal.factor.T
        own = slice(0, 10 * len(posterior.model.priors))  # not the initial rate: errors of joint speed enter it
        return {
            "distance": distance(
                posterior.unknowns.to_linear(z[None])[0, own], proposal.mean[own], covariance[own, own]
            ),
            "scores": _mass_scores(posterior, proposal.mean, covariance, truth),
        }

    trials = run_trials(system, range(count), seed=seed, progress=lambda text: progress(f"coverage: {text}"))
    outcomes = trials.complete()
    distances, scores = (np.array([outcome[key] for outcome in outcomes]) for key in ("distance", "scores"))
    return Coverage(distances, scores, 10 * len(spreads(drawings)))


def _mass_scores(posterior: Posterior, mean: Floats, covariance: Floats, truth: Robot) -> Floats:
    """Errors of three masses; a body's mass is linear in its ten linear coordinates."""
    names = bodies(truth)
    scores = []
    for members in ((BASE,), (LOAD,), names):

        def total(y: Floats, members: tuple[str, ...] = members) -> float:
            bodies_there = posterior.unknowns.inertials(posterior.unknowns.from_linear(y[None])[0])
            return sum(b.mass for name, b in zip(names, bodies_there, strict=True) if name in members)

        here, slope = total(mean), np.zeros(len(mean))
        for index in range(10 * len(names)):
            step = 1e-4 * np.sqrt(covariance[index, index])
            slope[index] = (total(mean + step * np.eye(len(mean))[index]) - here) / step
        true = sum(truth.link(name).inertial.mass for name in members)
        scores.append((here - true) / np.sqrt(slope @ covariance @ slope))
    return np.array(scores)
