"""Whether the stated uncertainty holds the truth: systems drawn from the prior, flown and identified."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from bayesid import Posterior, Robot
from bayesid._math.arrays import Floats
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.inference.parameterisation import LinearParameterisation
from bayesid.robot.body_prior import draw_inertial
from studies.common.monte_carlo import run_trials
from studies.common.quantities import squared_distances
from studies.whole_system.sampled import true_point
from studies.whole_system.setting import bodies, groups, model_of, spreads
from studies.whole_system.world import fly, record

__all__ = ["SCORED", "TAIL", "Coverage", "covered"]

TAIL = 0.95  # quantile of the distances beyond which their number is tested, as it is below one minus this
SCORED = ("base", "load", "whole system")  # groups of bodies whose masses are scored


@dataclass(frozen=True)
class Coverage:
    """Errors over K drawn systems, whose bodies have n unknowns."""

    # (K,): squared distances of the true bodies from the mode; chi-square with n degrees of freedom if all is right
    distances: Floats
    scores: Floats  # (K, 3): errors of the masses of the groups `SCORED` in their standard deviations
    unknowns: int  # number n of unknowns

    @property
    def p_value(self) -> float:
        """P-value of the distances being chi-square (Kolmogorov-Smirnov)."""
        return float(stats.kstest(self.distances, stats.chi2(self.unknowns).cdf).pvalue)

    @property
    def far(self) -> int:
        """Number of distances beyond the `TAIL` quantile, where too narrow a posterior shows first."""
        return int((self.distances > stats.chi2(self.unknowns).ppf(TAIL)).sum())

    @property
    def near(self) -> int:
        """Number of distances below the quantile of one minus `TAIL`, where too wide a posterior shows first."""
        return int((self.distances < stats.chi2(self.unknowns).ppf(1.0 - TAIL)).sum())

    @property
    def tail_p_value(self) -> float:
        """P-value of so many distances or more in either tail: twice the smaller of both, at most one."""
        chances = stats.binom.sf(np.array([self.far, self.near]) - 1, len(self.distances), 1.0 - TAIL)
        return min(1.0, 2.0 * float(chances.min()))


def covered(
    drawings: Robot, count: int, seed: int, *, torques: bool, duration: float, progress: Callable[[str], None]
) -> Coverage:
    """Draw systems from the prior about the drawings, fly, record and identify each.

    The posterior is the normal approximation in coordinates linear in the parameters. The fit starts at the truth, to
    save time: another start leads to the same mode.
    """
    unknowns = 10 * len(bodies(drawings))
    first: list[Posterior] = []  # its compiled functions serve all systems

    def system(number: int, rng: np.random.Generator) -> dict[str, Any]:
        """Return the distance and the scores of one system."""
        truth = drawings
        for name, spread in spreads(drawings).items():
            truth = truth.with_inertial(name, draw_inertial(drawings.link(name).inertial, spread, rng))
        run = fly(truth, int(rng.integers(1000)), duration=duration, joints=tuple(range(len(drawings.joints))))
        manoeuvre = record(run, truth, "drawn", rng)
        if not first:
            first.append(Posterior.of(model_of(drawings, torques=torques), [manoeuvre]))
        posterior = with_manoeuvres(first[0], [manoeuvre])
        z = true_point(posterior, truth)
        refined = relinearised(posterior, z)
        proposal = LinearParameterisation(refined).proposal(fit(refined, z))
        covariance = proposal.factor @ proposal.factor.T
        # the bodies alone: errors of the joints' speed at the start enter the initial rate
        errors = (posterior.unknowns.to_linear(z[None])[0] - proposal.mean)[:unknowns]
        return {
            "distance": squared_distances(errors, covariance[:unknowns, :unknowns]),
            "scores": _mass_scores(posterior, proposal.mean, covariance, truth),
        }

    trials = run_trials(system, range(count), seed=seed, progress=lambda text: progress(f"coverage: {text}"))
    outcomes = trials.complete()
    distances, scores = (np.array([outcome[key] for outcome in outcomes]) for key in ("distance", "scores"))
    return Coverage(distances, scores, unknowns)


def _mass_scores(posterior: Posterior, mean: Floats, covariance: Floats, truth: Robot) -> Floats:
    """Return the errors of the masses of `SCORED` over their standard deviations, shape (3,).

    Differences give the derivatives of the masses exactly, since a mass is linear in the linear coordinates.
    """
    names, members = bodies(truth), groups(truth)
    gather = np.array([[float(name in members[group]) for name in names] for group in SCORED])

    def masses(y: Floats) -> Floats:
        inertial = np.asarray(posterior.unknowns.values_of(posterior.unknowns.from_linear(y)).inertial)
        return inertial.reshape(len(y), -1, 10)[:, :, 0] @ gather.T

    count = 10 * len(names)
    step = 1e-4 * np.sqrt(np.diag(covariance)[:count])
    (here,), ahead = masses(mean[None]), masses(mean + np.eye(count, len(mean)) * step[:, None])
    slope = (ahead - here) / step[:, None]
    true = gather @ np.array([truth.link(name).inertial.mass for name in names])
    return np.asarray((here - true) / np.sqrt(np.diag(slope.T @ covariance[:count, :count] @ slope)))
