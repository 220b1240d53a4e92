"""Linear theory of rivals before anything is flown: how alike effects are, and the expected Bayes factor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import jax
import numpy as np

from bayesid import Manoeuvre, Model, Recording
from bayesid._math.arrays import Floats
from bayesid.design import Plan, Separation, Tip, planned_posterior
from bayesid.design.designed import sample_times
from bayesid.design.plan import PlannedOutcome
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.simulated_recordings import blank_channels
from bayesid.recording.joint_motion import Motion
from studies.common.ets7 import TIP
from studies.ets7_limits.setting import INTERVAL
from studies.separating.setting import CANDIDATES, FlightFamily, drifting, rival_model, rival_of

__all__ = ["Expected", "Linearised", "Pair", "pairs", "unexplained_information"]


@dataclass(frozen=True)
class Expected:
    """Expectations for one truth and a set of manoeuvres.

    Attributes
    ----------
    alone : float
        Noncentrality lambda of the effect against a model without it, everything else marginalised.
    apart : float
        Noncentrality lambda (1 - rho^2) against a model with the rival in its place.
    log_factor : float
        Mean log Bayes factor of the truth against the rival, what each prior costs included.
    """

    alone: float
    apart: float
    log_factor: float

    @property
    def sd(self) -> float:
        """Standard deviation of the log Bayes factor, from noise alone."""
        return float(np.sqrt(self.apart))

    @property
    def energy(self) -> float:
        """Half of `apart`."""
        return 0.5 * self.apart


def unexplained_information(information: Floats, group: Sequence[int], rest: Sequence[int]) -> Floats:
    """Return the information about a group of unknowns that the rest cannot imitate, shape (group, group).

    Parameters
    ----------
    information : (n, n) array
        Information about all unknowns, without their prior.
    group, rest : sequences of int
        Unknowns of interest, and those to be marginalised with a standard normal prior.
    """
    inner = information[np.ix_(rest, rest)] + np.eye(len(rest))
    cross = information[np.ix_(rest, group)]
    return np.asarray(information[np.ix_(group, group)] - cross.T @ np.linalg.solve(inner, cross))


@dataclass(frozen=True)
class Linearised:
    """Information of manoeuvres about all unknowns of a model with both rivals.

    Attributes
    ----------
    information : (n, n) array
        Information in coordinates whose prior is standard normal, without that prior.
    names : tuple of str
        Names of the unknowns.
    """

    information: Floats
    names: tuple[str, ...]

    @classmethod
    def of(cls, model: Model, motion: Motion, duration: float) -> Linearised:
        """Linearise one manoeuvre about the drifting base."""
        time = sample_times(duration, INTERVAL)
        blank = Recording("manoeuvre", None, time, blank_channels(model.sensors, len(time)))
        posterior = planned_posterior(model, [Manoeuvre(blank, motion)])
        z = drifting(posterior.unknowns)
        jacobian = relinearised(posterior, z).jacobian(z)[: -posterior.size]
        return cls(jacobian.T @ jacobian, posterior.unknowns.names)

    def with_another(self, other: Linearised) -> Linearised:
        """Join two manoeuvres, which share all unknowns but the initial rates."""
        count = len(self.names)
        fresh = [index for index, name in enumerate(other.names) if name.startswith("initial-rate")]
        place = [count + fresh.index(index) if index in fresh else index for index in range(len(other.names))]
        total = np.pad(self.information, (0, len(fresh)))
        total[np.ix_(place, place)] += other.information
        return Linearised(total, (*self.names, *(f"second {other.names[index]}" for index in fresh)))

    def expect(self, truth: str, amplitude: Floats) -> Expected:
        """Return the expectations where one of the rivals acts with an amplitude, in prior standard deviations."""
        hidden, rival = (
            [i for i, name in enumerate(self.names) if name.startswith(f"{label}.")]
            for label in (truth, rival_of(truth))
        )
        rest = [index for index in range(len(self.names)) if index not in (*hidden, *rival)]
        mean = [self._log_evidence([*rest, *rows], hidden, amplitude) for rows in (hidden, rival)]
        alone, apart = (
            float(amplitude @ unexplained_information(self.information, hidden, others) @ amplitude)
            for others in (rest, [*rest, *rival])
        )
        return Expected(alone, apart, mean[0] - mean[1])

    def _log_evidence(self, rows: list[int], hidden: list[int], amplitude: Floats) -> float:
        """Return the mean log evidence of the model with some unknowns, up to what all models share."""
        within = self.information[np.ix_(rows, rows)]
        total, signal = within + np.eye(len(rows)), self.information[np.ix_(rows, hidden)] @ amplitude
        fitted = signal @ np.linalg.solve(total, signal) + np.trace(np.linalg.solve(total, within))
        return float(0.5 * fitted - 0.5 * np.linalg.slogdet(total)[1])


@dataclass(frozen=True)
class Pair:
    """Two effects on the first manoeuvre.

    Attributes
    ----------
    labels : (str, str)
        Labels of the effects.
    alone : (float, float)
        Noncentrality of each at its prior's amplitude, in the direction that shows least, with base, initial rate and
        gradient marginalised.
    apart : (float, float)
        Noncentrality of each with the rival, of any size, marginalised too.
    """

    labels: tuple[str, str]
    alone: tuple[float, float]
    apart: tuple[float, float]

    @property
    def left(self) -> float:
        """Smaller of the two fractions of a signal that the rival cannot imitate."""
        return min(part / whole for part, whole in zip(self.apart, self.alone, strict=True))


def pairs(duration: float, thinning: int = 2) -> list[Pair]:
    """Return all pairs of the candidates, the most alike first."""
    labels = [effect.label for effect in CANDIDATES]
    model, family = rival_model(labels), FlightFamily(duration)
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, TIP), thinning=thinning)
    outcome = jax.jit(plan.outcome)(family.centre, drifting(plan.unknowns))

    def having(*present: str) -> tuple[Plan, PlannedOutcome]:
        """Return plan and outcome of the model with some of the candidates."""
        smaller = replace(plan, model=rival_model(present))
        rows = np.array([plan.unknowns.names.index(name) for name in smaller.unknowns.names])
        return smaller, outcome._replace(information=np.asarray(outcome.information)[np.ix_(rows, rows)])

    alone = {}
    for label in labels:
        single, cut = having(label)
        group = list(single.effect(label))
        rest = [index for index in range(len(cut.information)) if index not in group]
        left = unexplained_information(np.asarray(cut.information), group, rest)
        alone[label] = float(np.linalg.eigvalsh(left)[0])
    rows = []
    for first, second in combinations(labels, 2):
        apart = np.asarray(Separation((first, second)).noncentrality(*having(first, second)))
        rows.append(Pair((first, second), (alone[first], alone[second]), (float(apart[0]), float(apart[1]))))
    return sorted(rows, key=lambda pair: pair.left)
