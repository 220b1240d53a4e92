"""Alarm of a diagnosis: everything that a model may lack and all faults of its noise, tested as one family."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid.diagnosis.evidence.evidence_alarm import EvidenceAlarm
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.noise.encoder_fault import encoder_test
from bayesid.diagnosis.noise.noise_tests import noise_tests, variance_tests
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.settings import DEFAULT_SETTINGS

__all__ = ["FamilyAlarm"]


@dataclass(frozen=True)
class FamilyAlarm:
    """Whether data hold more than the declared noise.

    Attributes
    ----------
    candidates : EvidenceAlarm
        Of all single candidates.
    noise : dict of str to float
        Logarithms of the local p-values of the tests of the noise.
    level : float
        Family-wise probability of an alarm where nothing is lacking.
    """

    candidates: EvidenceAlarm
    noise: dict[str, float]
    level: float = DEFAULT_SETTINGS.alarm_level

    @staticmethod
    def of(
        evidence: SetEvidence,
        fit: Fit,
        rng: np.random.Generator,
        draws: int = 2000,
        level: float = DEFAULT_SETTINGS.alarm_level,
    ) -> FamilyAlarm:
        """Test the present model: candidates by their evidence, the noise by the residual of the fit.

        Parameters
        ----------
        evidence : SetEvidence
            Of all candidates about the fit.
        fit : Fit
            Of the present model.
        rng : Generator
        draws : int
            Simulated studies without any cause.
        level : float
            Family-wise probability of an alarm where nothing is lacking.
        """
        posterior = fit.posterior
        tests = noise_tests(posterior, fit) | variance_tests(posterior, fit) | encoder_test(posterior)
        return FamilyAlarm(EvidenceAlarm.of(evidence, rng, draws), tests, level)

    @property
    def candidates_level(self) -> float:
        """Level of the test of the candidates, which with that of the noise has the family-wise one."""
        return float(-np.expm1(0.5 * np.log1p(-self.level)))

    @property
    def log_p_noise(self) -> float:
        """Logarithm of the p-value of the smallest among the tests of the noise, which are taken as independent."""
        if not self.noise:
            return 0.0
        return _of_many(min(self.noise.values()), len(self.noise))

    @property
    def log_p_value(self) -> float:
        """Logarithm of the family-wise p-value: candidates and noise each have half of the level."""
        return _of_many(min(self.candidates.log_p_value, self.log_p_noise), 2)

    @property
    def p_value(self) -> float:
        """Family-wise p-value."""
        return float(np.exp(self.log_p_value))

    @property
    def loudest(self) -> str:
        """Name of the most significant candidate or test."""
        if self.noise and self.log_p_noise < self.candidates.log_p_value:
            return min(self.noise, key=lambda name: self.noise[name])
        return self.candidates.loudest

    @property
    def silent(self) -> bool:
        """Whether nothing but the declared noise is seen."""
        return self.log_p_value > np.log(self.level)

    @property
    def tests(self) -> int:
        """Number of candidates and tests."""
        return len(self.candidates.log_evidence) + len(self.noise)

    def log_p_values(self) -> dict[str, tuple[float, float]]:
        """Return the logarithms of the local and of the family-wise p-value of each candidate and test."""
        found = {name: (own, _of_many(all_, 2)) for name, (own, all_) in self.candidates.log_p_values().items()}
        return found | {name: (own, _of_many(own, 2 * len(self.noise))) for name, own in self.noise.items()}


def _of_many(log_p: float, count: int) -> float:
    """Return the logarithm of the probability that the smallest of some independent p-values is at most this."""
    if log_p < -30.0:
        return min(0.0, log_p + float(np.log(count)))
    rest = -np.expm1(min(log_p, 0.0))
    return float(np.log(-np.expm1(count * np.log(rest)))) if rest > 0.0 else 0.0
