"""How the verdict changes with what had to be chosen: two prior numbers and the ranges of the scales."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayesid.diagnosis.cause_prior import CausePrior
from bayesid.diagnosis.equivalent_causes import classes_of_equivalents
from bayesid.diagnosis.evidence_alarm import FAMILY_LEVEL, EvidenceAlarm
from bayesid.diagnosis.probable_verdict import ProbableVerdict, probable_verdict
from bayesid.diagnosis.set_enumeration import enumerate_sets
from bayesid.diagnosis.set_evidence import SetEvidence
from bayesid.diagnosis.set_probabilities import SetProbabilities

__all__ = ["VerdictSensitivity", "verdict_sensitivity"]

DECADE = 10.0
"""Factor by which the ranges of the scales are widened, at either end."""


@dataclass(frozen=True)
class VerdictSensitivity:
    """The verdict, and what it would have been under other choices.

    Attributes
    ----------
    verdict : ProbableVerdict
    others : mapping of str to ProbableVerdict
        Verdicts under the other choices, by a description of the choice.
    """

    verdict: ProbableVerdict
    others: Mapping[str, ProbableVerdict]

    @property
    def changes(self) -> tuple[str, ...]:
        """Choices under which the status, or the set of causes that are named, is another."""
        base = (self.verdict.status, frozenset(self.verdict.causes))
        return tuple(name for name, other in self.others.items() if (other.status, frozenset(other.causes)) != base)


def verdict_sensitivity(
    evidence: SetEvidence,
    probabilities: SetProbabilities,
    alarm: EvidenceAlarm,
    rng: np.random.Generator,
    level: float = FAMILY_LEVEL,
) -> VerdictSensitivity:
    """Return the verdict with each prior number halved and doubled, and with scales a decade wider at either end.

    The prior numbers only weigh the sets anew. Other ranges need all evidences, the alarm and the classes of
    equivalents once more.

    Parameters
    ----------
    evidence : SetEvidence
    probabilities : SetProbabilities
        Of the sets of the same candidates.
    alarm : EvidenceAlarm
        Of the same candidates.
    rng : Generator
        For the alarms of other ranges.
    level : float
        Family-wise level of the alarm.
    """
    classes, prior = classes_of_equivalents(evidence), probabilities.prior
    silent = alarm.silent(level)
    others = {
        name: probable_verdict(probabilities.under(changed), classes, silent)
        for name, changed in _other_priors(prior).items()
    }
    for name, factors in {
        "bounds a decade higher": (DECADE, 1.0),
        "floors a decade lower": (1.0, 1.0 / DECADE),
    }.items():
        causes = [cause.rescaled(evidence.gram, *factors) for cause in evidence.causes.values()]
        wider = SetEvidence(evidence.gram, causes)
        quiet = EvidenceAlarm.of(wider, rng, len(alarm.largest.values)).silent(level)
        others[name] = probable_verdict(enumerate_sets(wider, prior), classes_of_equivalents(wider), quiet)
    return VerdictSensitivity(probable_verdict(probabilities, classes, silent), others)


def _other_priors(prior: CausePrior) -> dict[str, CausePrior]:
    """Return the prior with each of its numbers halved and doubled; a probability stays below one."""
    found = {}
    for field, words in (("one_more", "causes"), ("generic", "unknown")):
        for factor, verb in ((0.5, "half"), (2.0, "twice")):
            value = getattr(prior, field) * factor
            changed = min(value, 0.5 * (1.0 + getattr(prior, field)))
            found[f"{words} {verb} as probable"] = replace(prior, **{field: changed})
    return found
