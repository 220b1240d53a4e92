"""Alarm that something other than the declared noise is in the data.

The statistic is the largest evidence among all single candidates, generic ones included. Its distribution where nothing
is lacking follows from draws of the score, normal with covariance ``A``, without simulation: `Gram.null_scores` derives
why, for unknowns drawn from their prior. The promise is a frequentist one: whatever the prior of causes, of the studies
that lack nothing one in a hundred raises the alarm at the level of 1 %, all candidates together.

That the largest of many statistics holds its level however they correlate: P. H. Westfall and S. S. Young,
Resampling-Based Multiple Testing, 1993. The tail beyond the draws is that of exceedances over a threshold: J. Pickands,
Statistical inference using extreme order statistics, Annals of Statistics 3, 1975.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.settings import DEFAULT_SETTINGS

__all__ = ["EvidenceAlarm", "NullTail"]

REACH = 20  # draws beyond a value below which its p-value comes from the tail; counting more is good to a fifth
TAIL = 0.05  # share of the draws that the decay length of the tail is fitted to


@dataclass(frozen=True)
class NullTail:
    """Distribution of a log evidence where nothing is lacking, with its tail.

    Where fewer than 20 draws lie beyond, the tail is exponential. Its decay length is the mean excess of the highest
    twentieth of the draws, but at least 1: under a normal prior of deviation ``d`` along an eigenvector with
    information ``v``, the log evidence grows with half of chi-square times ``d^2 v / (1 + d^2 v)``, so that far out it
    decays at least as fast as ``exp(-x)``. Down to 1e-5 the fitted p-value is rather too large, by up to a factor of
    about 3. The average evidence where nothing is lacking is exactly 1, so that by Markov's inequality the number of
    candidates times ``exp(-x)`` bounds the p-value from above in any case.

    Attributes
    ----------
    values : (d,) array
        Draws, in increasing order.
    candidates : int
        Number of candidates of which the draws are the largest.
    """

    values: Floats
    candidates: int

    def _beyond(self, value: float) -> int:
        return len(self.values) - int(np.searchsorted(self.values, value, side="left"))

    def log_p(self, value: float) -> float:
        """Return the logarithm of the probability that nothing but noise gives at least this value."""
        if not self.extrapolated(value):
            return float(np.log((self._beyond(value) + 1.0) / (len(self.values) + 1.0)))
        first, log_first, length = self._tail
        fitted = log_first - (value - first) / length
        return min(fitted, float(np.log(self.candidates)) - value, 0.0)

    def extrapolated(self, value: float) -> bool:
        """Return whether the p-value of a value comes from the fitted tail rather than from counted draws."""
        return self._beyond(value) < REACH

    def threshold(self, level: float) -> float:
        """Return the value beyond which `log_p` is at most the logarithm of a level, by counting or in the tail."""
        if not 0.0 < level < 1.0:
            raise ValueError(f"the level of an alarm must lie in (0, 1), received {level}")
        draws = len(self.values)
        beyond = int(level * (draws + 1.0)) - 1
        if beyond >= REACH:
            return float(self.values[draws - 1 - beyond])
        first, log_first, length = self._tail
        return min(first + length * (log_first - float(np.log(level))), float(np.log(self.candidates / level)))

    @property
    def _tail(self) -> tuple[float, float, float]:
        """Value where the tail begins, the logarithm of its p-value, and the decay length."""
        low = float(np.quantile(self.values, 1.0 - TAIL))
        length = max(float(np.mean(self.values[self.values >= low]) - low), 1.0)
        return float(self.values[-REACH]), float(np.log((REACH + 1.0) / (len(self.values) + 1.0))), length


@dataclass(frozen=True)
class EvidenceAlarm:
    """Whether anything is lacking, and which candidate says so.

    Attributes
    ----------
    log_evidence : dict of str to float
        Evidence of each single candidate relative to nothing.
    each : dict of str to NullTail
        Distribution of each where nothing is lacking.
    largest : NullTail
        Distribution of the largest of them.
    """

    log_evidence: dict[str, float]
    each: dict[str, NullTail]
    largest: NullTail

    @staticmethod
    def of(evidence: SetEvidence, rng: np.random.Generator, draws: int = 4000) -> EvidenceAlarm:
        """Test all single candidates together.

        Parameters
        ----------
        evidence : SetEvidence
            With at least one candidate.
        rng : Generator
        draws : int
            Draws of the score, at least 1,000.
        """
        if not evidence.causes:
            raise ValueError("an alarm needs at least one candidate, received none")
        if draws < 1000:
            raise ValueError(f"the tail of an alarm needs at least 1000 draws, received {draws}")
        names = sorted(evidence.causes)
        scores = np.concatenate([evidence.gram.score[None], evidence.gram.null_scores(rng, draws)])
        values = np.stack([evidence.log_evidences([name], scores) for name in names])
        each = {name: NullTail(np.sort(drawn[1:]), 1) for name, drawn in zip(names, values, strict=True)}
        largest = NullTail(np.sort(values[:, 1:].max(axis=0)), len(names))
        return EvidenceAlarm(dict(zip(names, values[:, 0].tolist(), strict=True)), each, largest)

    @property
    def loudest(self) -> str:
        """Name of the candidate with the largest evidence."""
        return max(self.log_evidence, key=lambda name: self.log_evidence[name])

    @property
    def log_p_value(self) -> float:
        """Logarithm of the family-wise p-value of the loudest candidate."""
        return self.largest.log_p(self.log_evidence[self.loudest])

    def log_p_values(self) -> dict[str, tuple[float, float]]:
        """Return the logarithms of the local and of the family-wise p-value of each candidate."""
        return {name: (self.each[name].log_p(x), self.largest.log_p(x)) for name, x in self.log_evidence.items()}

    def silent(self, level: float = DEFAULT_SETTINGS.alarm_level) -> bool:
        """Return whether nothing but the declared noise is seen at a family-wise level."""
        return self.log_p_value > np.log(level)
