"""Tests of a residual, and the alarm: everything that a model may lack and all faults of its noise as one family.

The smallest of some p-values counts by Šidák's formula for independent ones (Šidák 1967, Rectangular confidence regions
for the means of multivariate normal distributions, Journal of the American Statistical Association 62).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid._math.chi_square import log_tail
from bayesid.diagnosis.evidence.evidence_alarm import EvidenceAlarm
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.noise import noise_faults
from bayesid.diagnosis.noise.noise_fault import FitResidual
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.settings import DEFAULT_SETTINGS

__all__ = ["FamilyAlarm", "log_p_of_a_period", "log_p_of_an_event", "noise_tests", "structure_tests"]

MOST_FREQUENCIES = 500
"""Largest number of frequencies of which a period is looked for, the lowest first."""

LONGEST_EVENT = 0.25
"""Longest event, as a fraction of the samples of a recording."""


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
        residual = FitResidual(fit)
        tests = noise_tests(residual) | _variance_tests(residual) | noise_tests(residual, in_residual=False)
        tests |= structure_tests(fit)
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
        each = {name: (local, _of_many(all_, 2)) for name, (local, all_) in self.candidates.log_p_values().items()}
        return each | {name: (local, _of_many(local, 2 * len(self.noise))) for name, local in self.noise.items()}


def _of_many(log_p: float, count: int) -> float:
    """Return the logarithm of the probability that the smallest of some independent p-values is at most this."""
    if log_p < -30.0:
        return min(0.0, log_p + float(np.log(count)))
    rest = -np.expm1(min(log_p, 0.0))
    return float(np.log(-np.expm1(count * np.log(rest)))) if rest > 0.0 else 0.0


def noise_tests(residual: FitResidual, *, in_residual: bool = True) -> dict[str, float]:
    """Return the logarithms of the p-values of the faults of the noise, by their labels.

    Parameters
    ----------
    residual : FitResidual
    in_residual : bool
        Whether of the faults that show in the residual, or of the others.
    """
    posterior = residual.fit.posterior
    faults = noise_faults(residual.fit.view.kinds).values()
    tested = [fault for fault in faults if fault.in_residual == in_residual and fault.occurs(posterior)]
    each = {fault.label: fault.log_p(residual) for fault in tested}
    return {label: log_p for label, log_p in each.items() if log_p is not None}


def _variance_tests(residual: FitResidual) -> dict[str, float]:
    """Return the logarithm of the p-value of the variance in each recording and sensor axis, pooled into one test."""
    whole, share = residual.fit.view, residual.share
    smallest, count = 0.0, 0
    for recording, channel in np.argwhere(whole.mask.any(axis=1)).tolist():
        samples = whole.samples(recording, channel)
        degrees, energy = len(samples) - share.samples(recording, channel).sum(), float((samples**2).sum())
        both = 2.0 * min(stats.chi2.sf(energy, degrees), stats.chi2.cdf(energy, degrees))
        smallest, count = min(smallest, float(np.log(max(both, 1e-300)))), count + 1
    # the smallest of n independent p-values
    return {"variance by axis": float(np.log(-np.expm1(count * np.log1p(-np.exp(smallest)))))} if smallest < 0.0 else {}


def structure_tests(fit: Fit) -> dict[str, float]:
    """Logarithms of the p-values of a period and of an event in the residual of each sensor, by names.

    The residual of a model that holds is white with unit variance. A fit takes some of that, more at low frequencies,
    so that the p-values are at least as large as they should be.
    """
    log_p_values = {}
    for kind in fit.posterior.model.channels.kinds:
        view = fit.view
        parts = [view.complete(kind, recording) for recording in range(view.recordings)]
        pieces = [(time, residual) for time, residual in parts if len(time) > 4]
        if pieces:
            log_p_values[f"period in {kind.value}"] = log_p_of_a_period(pieces)
            log_p_values[f"event in {kind.value}"] = log_p_of_an_event([residual for _, residual in pieces])
    return log_p_values


def log_p_of_a_period(pieces: list[tuple[Floats, Floats]]) -> float:
    """Log p-value of the strongest period that all recordings share, with any size and phase in each axis of each.

    Parameters
    ----------
    pieces : list of ((n,) array, (n, axes) array)
        Times [s] and whitened residuals of each recording.

    Notes
    -----
    At every frequency the energy in phase and out of phase is chi-square; the smallest p-value counts as often as
    frequencies were tried (Lomb 1976, Astrophysics and Space Science 39; Scargle 1982, Astrophysical Journal 263).
    """
    longest = max(float(np.ptp(time)) for time, _ in pieces)
    interval = min(float(np.median(np.diff(time))) for time, _ in pieces)
    count = int(np.clip(longest / interval, 1, MOST_FREQUENCIES))
    energy, degrees = np.zeros(count), 0
    for time, residual in pieces:
        omega = 2.0 * np.pi * 0.5 * np.arange(1, count + 1) / longest
        # the shift that makes sine and cosine orthogonal at these instants
        twice = 2.0 * omega[:, None] * time
        shift = 0.5 * np.arctan2(np.sin(twice).sum(axis=1), np.cos(twice).sum(axis=1))
        phase = omega[:, None] * time - shift[:, None]
        for wave in (np.cos(phase), np.sin(phase)):
            norm = np.maximum((wave**2).sum(axis=1), 1e-9)
            energy += ((wave @ residual) ** 2).sum(axis=1) / norm
        degrees += 2 * residual.shape[1]
    return float(min(0.0, np.log(count) + log_tail(energy.max(), degrees)))


def log_p_of_an_event(residuals: list[Floats]) -> float:
    """Log p-value of the strongest shift of the mean in any stretch of any recording, of either sign in each axis.

    Parameters
    ----------
    residuals : list of (n, axes) array
        Whitened residuals of each recording.
    """
    strongest, tried, axes = 0.0, 0, residuals[0].shape[1]
    for residual in residuals:
        sums = np.concatenate([np.zeros((1, axes)), np.cumsum(residual, axis=0)])
        width = 2
        while width <= max(2, LONGEST_EVENT * len(residual)):
            energy = ((sums[width:] - sums[:-width]) ** 2).sum(axis=1) / width
            if len(energy):
                strongest, tried = max(strongest, float(energy.max())), tried + len(energy)
            width *= 2
    return float(min(0.0, np.log(max(tried, 1)) + log_tail(strongest, axes)))
