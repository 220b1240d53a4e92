"""How the verdict changes with what had to be chosen: two prior numbers and the ranges of the scales."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from bayesid.diagnosis.evidence.cause_prior import CausePrior
from bayesid.diagnosis.evidence.probable_verdict import ProbableVerdict, probable_verdict
from bayesid.diagnosis.evidence.set_probabilities import SetProbabilities

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
    probabilities: SetProbabilities,
    classes: Sequence[Sequence[str]],
    silent: bool,
    widened: Callable[[float, float], SetProbabilities],
) -> VerdictSensitivity:
    """Return the verdict with each prior number halved and doubled, and with scales a decade wider at either end.

    The prior numbers only weigh the sets anew; other ranges of the scales need their evidence once more.

    Parameters
    ----------
    probabilities : SetProbabilities
    classes : sequence of sequences of str
        Classes of equivalent causes.
    silent : bool
        Whether the alarm is silent.
    widened : callable
        Probabilities with the bounds and the floors of all scales multiplied by two factors.
    """
    others = {
        name: probable_verdict(probabilities.under(changed), classes, silent)
        for name, changed in _other_priors(probabilities.prior).items()
    }
    for name, factors in {
        "bounds a decade higher": (DECADE, 1.0),
        "floors a decade lower": (1.0, 1.0 / DECADE),
    }.items():
        others[name] = probable_verdict(widened(*factors), classes, silent)
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
