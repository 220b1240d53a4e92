"""Probability that the alarm would have found a cause, averaged over the prior of its size."""

from __future__ import annotations

import numpy as np

from bayesid.diagnosis.evidence.evidence_alarm import FAMILY_LEVEL, EvidenceAlarm
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.set_evidence import SetEvidence

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
        Family-wise level of the alarm among candidates.
    draws : int
        Number of draws; 2,000 are good to 0.011.
    """
    gram, cause = evidence.gram, evidence.causes[name]
    own_columns = np.unique(np.concatenate([gram.groups[g.name] for v in cause.variants for g in v.groups]))
    scores = np.zeros((draws, len(gram.score)))
    part = Gram(gram.matrix[np.ix_(own_columns, own_columns)], gram.score[own_columns], {})
    scores[:, own_columns] = part.null_scores(rng, draws)
    shares = np.exp([variant.log_weight for variant in cause.variants])
    counts = rng.multinomial(draws, shares / shares.sum())
    for form, drawn in enumerate(np.split(np.arange(draws), np.cumsum(counts)[:-1])):
        for own in evidence.spectra([name], {name: form}):
            scales = np.exp(rng.uniform(np.log(own.range.low), np.log(own.range.high), size=(len(drawn), 1)))
            amplitudes = scales * own.root * rng.normal(size=(len(drawn), len(own.columns)))
            amplitudes = np.ones_like(amplitudes) if cause.fixed else amplitudes
            scores[np.ix_(drawn, own_columns)] -= amplitudes @ gram.matrix[np.ix_(own.columns, own_columns)]
    return float(np.mean(evidence.log_evidences([name], scores) > alarm.largest.threshold(level)))
