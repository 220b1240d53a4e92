"""Evidence of the rivals in linear theory, before and after a flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayesid import Manoeuvre
from bayesid._math.arrays import Floats
from studies.common.repeated_fits import Reference
from studies.separating.setting import rival_of

__all__ = ["Expected", "Linearised", "unexplained_information"]


@dataclass(frozen=True)
class Expected:
    """Expectations for one truth and a set of manoeuvres."""

    alone: float  # noncentrality lambda of the effect against a model without it, everything else marginalised
    apart: float  # noncentrality lambda (1 - rho^2) against a model with the rival in its place
    log_factor: float  # mean log Bayes factor of the truth against the rival, what each prior costs included

    @property
    def sd(self) -> float:
        """Standard deviation of the log Bayes factor, from noise alone."""
        return float(np.sqrt(self.apart))

    def exceeding(self, limit: float) -> float:
        """Return the share of flights whose log Bayes factor exceeds a limit, taken as normal about its mean."""
        return float(stats.norm.sf(limit, self.log_factor, self.sd)) if self.sd else float(self.log_factor > limit)

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
    """Manoeuvres linearised about the drifting base, in the unknowns of a model with both rivals."""

    information: Floats  # (n, n): information in coordinates whose prior is standard normal, without that prior
    names: tuple[str, ...]  # names of the unknowns
    # (n,): Jacobian transposed times the whitened data, in coordinates counted from zero; zero where nothing was
    # recorded
    score: Floats

    @classmethod
    def of(cls, reference: Reference, manoeuvre: Manoeuvre | None = None) -> Linearised:
        """Linearise one manoeuvre about a plan, with what was recorded of it if it was flown."""
        jacobian = reference.jacobian[: -reference.posterior.size]
        score = np.zeros(reference.posterior.size)
        if manoeuvre is not None:
            residual = reference.given(manoeuvre).residuals(reference.z).ravel()
            score = jacobian.T @ (jacobian @ reference.z - residual)
        return cls(jacobian.T @ jacobian, reference.posterior.unknowns.names, score)

    def with_another(self, other: Linearised) -> Linearised:
        """Join two manoeuvres, which share all unknowns but the initial rates."""
        count = len(self.names)
        fresh = [index for index, name in enumerate(other.names) if name.startswith("initial-rate")]
        place = [count + fresh.index(index) if index in fresh else index for index in range(len(other.names))]
        total, score = np.pad(self.information, (0, len(fresh))), np.pad(self.score, (0, len(fresh)))
        total[np.ix_(place, place)] += other.information
        score[place] += other.score
        return Linearised(total, (*self.names, *(f"second {other.names[index]}" for index in fresh)), score)

    def group(self, label: str) -> list[int]:
        """Return the indices of an effect's unknowns."""
        return [index for index, name in enumerate(self.names) if name.startswith(f"{label}.")]

    def without(self, labels: Sequence[str]) -> list[int]:
        """Return the indices of all unknowns but those of some effects."""
        gone = {index for label in labels for index in self.group(label)}
        return [index for index in range(len(self.names)) if index not in gone]

    def expect(self, truth: str, amplitude: Floats) -> Expected:
        """Return the expectations where one of the rivals acts with an amplitude, in prior standard deviations."""
        hidden, rival = self.group(truth), self.group(rival_of(truth))
        rest = self.without([truth, rival_of(truth)])
        signal = self.information[:, hidden] @ amplitude
        mean = [self._expected_evidence([*rest, *rows], signal) for rows in (hidden, rival)]
        alone, apart = (
            float(amplitude @ unexplained_information(self.information, hidden, known) @ amplitude)
            for known in (rest, [*rest, *rival])
        )
        return Expected(alone, apart, mean[0] - mean[1])

    def log_evidence(self, rows: Sequence[int]) -> float:
        """Return the log evidence of the model with some unknowns given what was recorded, up to a common constant."""
        total, score = self.information[np.ix_(rows, rows)] + np.eye(len(rows)), self.score[list(rows)]
        return float(0.5 * score @ np.linalg.solve(total, score) - 0.5 * np.linalg.slogdet(total)[1])

    def _expected_evidence(self, rows: list[int], signal: Floats) -> float:
        """Return the mean log evidence of the model with some unknowns, up to what all models share."""
        within = self.information[np.ix_(rows, rows)]
        total = within + np.eye(len(rows))
        fitted = signal[rows] @ np.linalg.solve(total, signal[rows]) + np.trace(np.linalg.solve(total, within))
        return float(0.5 * fitted - 0.5 * np.linalg.slogdet(total)[1])
