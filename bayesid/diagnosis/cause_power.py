"""Probability that the alarm would have found a cause, averaged over the prior of its size."""

from __future__ import annotations

import numpy as np

from bayesid.diagnosis.evidence_alarm import FAMILY_LEVEL, EvidenceAlarm
from bayesid.diagnosis.set_evidence import SetEvidence

__all__ = ["cause_power"]


def cause_power(
    name: str,
    evidence: SetEvidence,
    alarm: EvidenceAlarm,
    rng: np.random.Generator,
    level: float = FAMILY_LEVEL,
    draws: int = 2000,
) -> float:
    """Return the probability that the evidence of a cause exceeds the family-wise threshold when it is at work alone.

    Scales and amplitudes are drawn from the cause's prior, the rest of the score as where nothing is lacking. Small
    scales count as much as their prior says: a cause of low power cannot be excluded by silence.

    Parameters
    ----------
    name : str
    evidence : SetEvidence
    alarm : EvidenceAlarm
        Of the same candidates.
    rng : Generator
    level : float
        Family-wise level of the alarm.
    draws : int
        Number of draws; 2,000 are good to 0.011.
    """
    gram, spectra = evidence.gram, evidence.spectra([name])
    groups = [evidence.causes[name].groups[place].name for _, place in evidence.places([name])]
    scores = np.zeros((draws, len(gram.score)))
    columns = np.concatenate([own.columns for own in spectra])
    amplitudes = [
        np.exp(rng.uniform(np.log(own.range.low), np.log(own.range.high), size=(draws, 1)))
        * own.root
        * rng.normal(size=(draws, len(own.columns)))
        for own in spectra
    ]
    signal = np.concatenate(amplitudes, axis=1) @ gram.matrix[np.ix_(columns, columns)]
    scores[:, columns] = gram.keeping(groups).null_scores(rng, draws) - signal
    return float(np.mean(evidence.log_evidences([name], scores) > alarm.largest.threshold(level)))
