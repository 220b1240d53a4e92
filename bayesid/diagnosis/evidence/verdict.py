"""From the probabilities of sets of causes to the verdict, and how it rests on what had to be chosen.

The alternatives of an ambiguous verdict are the smallest credible set among sets of causes (J. A. Hoeting et al.,
Bayesian model averaging: a tutorial, Statistical Science 14, 1999, on the probabilities behind it).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.evidence.cause_sets import CausePrior, SetProbabilities
from bayesid.diagnosis.evidence.gram import Gram, independent_directions
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings

__all__ = [
    "UNKNOWN",
    "ProbableVerdict",
    "Remainder",
    "Rest",
    "Status",
    "VerdictSensitivity",
    "classes_of_equivalents",
    "probable_verdict",
    "verdict_sensitivity",
]

UNKNOWN = "unknown"
"""Name of the generic candidates among the alternatives."""

DECADE = 10.0  # factor by which the ranges of the scales are widened, at either end
ROUNDING = 1e-9  # share of a cause's whole information below which what another leaves of it is rounding


class Status(Enum):
    """Verdicts, as in diagnosis.json."""

    ADEQUATE = "adequate"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly-explained"
    AMBIGUOUS = "ambiguous"
    UNRESOLVED = "unresolved"
    UNKNOWN = "unknown"


class Rest(Enum):
    """Whether something unnamed acts in addition to the named causes."""

    NONE = "none"
    UNDECIDED = "undecided"
    PRESENT = "present"


@dataclass(frozen=True)
class Remainder:
    """What acts in addition to the named causes, stated separately.

    Attributes
    ----------
    probability : float
        Probability that an unnamed cause is at work. If a cause is certain and those accompanying it are not, the
        probability that anything accompanies it.
    verdict : Rest
        None below `DiagnosisSettings.remainder_from`, present above `DiagnosisSettings.unknown_from`.
    """

    probability: float = 0.0
    verdict: Rest = Rest.NONE

    @staticmethod
    def of(probability: float, settings: DiagnosisSettings = DEFAULT_SETTINGS) -> Remainder:
        """Return the remainder of a probability.

        Parameters
        ----------
        probability : float
        settings : DiagnosisSettings, optional
        """
        if probability < settings.remainder_from:
            return Remainder(probability, Rest.NONE)
        return Remainder(probability, Rest.PRESENT if probability > settings.unknown_from else Rest.UNDECIDED)


@dataclass(frozen=True)
class ProbableVerdict:
    """Verdict that follows from the probabilities.

    Attributes
    ----------
    status : Status
    causes : tuple of str
        Best set of causes, one for each class, the most probable first; empty if adequate, unresolved or unknown.
    equivalent_to : dict of str to tuple of str
        Causes with the same effect on the model, by cause; only causes that have any.
    ambiguous_with : tuple of tuples of str
        Other alternatives, the most probable first. An empty one means that the model may lack nothing, and the name
        "unknown" represents any candidate outside the catalogue.
    remainder : Remainder
        Whether something acts in addition to the named causes.
    """

    status: Status
    causes: tuple[str, ...] = ()
    equivalent_to: dict[str, tuple[str, ...]] = field(default_factory=dict)
    ambiguous_with: tuple[tuple[str, ...], ...] = ()
    remainder: Remainder = Remainder()


def probable_verdict(
    probabilities: SetProbabilities,
    classes: Sequence[Sequence[str]],
    silent: bool,
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
    noise: Collection[str] = (),
) -> ProbableVerdict:
    """Return the verdict on sets of causes.

    Sets are first merged: equivalent causes count as one class, and all generic candidates as one more, the unknown.

    - adequate: the alarm is silent.
    - explained: every class of the best set has a probability of 0.9 or more, whatever accompanies it, and something
      generic has less than 0.1. The best set is the most probable one without anything generic, or, where generic
      candidates hold the majority and may imitate a part of it, the classes that have 0.9.
    - partly-explained: the same, and something generic has more: what remains is undecided up to 0.5, then present.
      Also where classes of 0.9 stand beside causes that are too many to name.
    - unknown: generic candidates hold the majority, and no class has 0.9, or more than two have: several that leave
      the majority unexplained are what the catalogue offers for one effect from outside. Faults of the noise do not
      count: a disturbance has parts faster than the courses of a generic candidate, and these look like noise.
    - ambiguous: two to four alternatives hold 0.95. They are merged sets, taken in the order of their probability; each
      holds whatever includes it, so that the many improbable companions of a cause count for it and not against it, and
      what an earlier one holds is no alternative of its own. Nothing and the unknown may be among them.
    - unresolved: more than four would be needed, or nothing is the most probable in spite of the alarm.

    Parameters
    ----------
    probabilities : SetProbabilities
    classes : sequence of sequences of str
        Classes of equivalent causes, which hold every cause of the catalogue once.
    silent : bool
        Whether the alarm is silent.
    settings : DiagnosisSettings, optional
        With the thresholds, of which the defaults are named above.
    noise : collection of str, optional
        Causes that are faults of the noise.
    """
    if silent:
        return ProbableVerdict(Status.ADEQUATE, remainder=Remainder(probabilities.unknown))
    merged = _merged(probabilities, classes)
    at_work = _at_work(merged, classes)
    certain = frozenset(key for key, probability in at_work.items() if probability >= settings.named_from)
    remainder = Remainder.of(probabilities.unknown, settings)
    best = next((names for names in merged if UNKNOWN not in names), frozenset[str]())
    named, others = best if best <= certain else frozenset[str](), list[frozenset[str]]()
    if remainder.verdict is Rest.PRESENT:
        certain -= frozenset(noise)
        named = certain if len(certain) <= settings.most_beside_unnamed else frozenset()
        status = Status.PARTLY_EXPLAINED if named else Status.UNKNOWN
    elif named:
        status = Status.EXPLAINED if remainder.verdict is Rest.NONE else Status.PARTLY_EXPLAINED
    else:
        alternatives = _alternatives(merged, settings.covered)
        if best and 2 <= len(alternatives) <= settings.most_alternatives:
            named, status = best, Status.AMBIGUOUS
            others = [alternative for alternative in alternatives if alternative != best]
        elif certain:
            beside = 1.0 - sum(probability for causes, probability in merged.items() if causes <= certain)
            named, status, remainder = certain, Status.PARTLY_EXPLAINED, Remainder.of(beside, settings)
        else:
            status = Status.UNRESOLVED
    causes, *alternatives_said = (_said(names, at_work, probabilities, classes) for names in (named, *others))
    mentioned = set(causes).union(*alternatives_said)
    ordered = (_ordered(members, probabilities) for members in classes)
    equivalent = {first: tuple(same) for first, *same in ordered if same and first in mentioned}
    return ProbableVerdict(status, causes, equivalent, tuple(alternatives_said), remainder)


def _ordered(members: Sequence[str], probabilities: SetProbabilities) -> list[str]:
    """Return the members of a class, the most probable first."""
    inclusion = probabilities.inclusion
    return sorted(members, key=lambda name: (-inclusion[name], name))


def _said(
    alternative: frozenset[str],
    at_work: Mapping[str, float],
    probabilities: SetProbabilities,
    classes: Sequence[Sequence[str]],
) -> tuple[str, ...]:
    """Return an alternative by the most probable name of each of its classes, the most probable class first."""
    names = {min(members): members for members in classes}
    known = sorted(alternative - {UNKNOWN}, key=lambda key: (-at_work[key], key))
    return (*(_ordered(names[key], probabilities)[0] for key in known), *(alternative & {UNKNOWN}))


def _at_work(merged: Mapping[frozenset[str], float], classes: Sequence[Sequence[str]]) -> dict[str, float]:
    """Return the probability of each class, by its first name, whatever accompanies it."""
    total = {min(members): 0.0 for members in classes}
    for alternative, probability in merged.items():
        for key in alternative - {UNKNOWN}:
            total[key] += probability
    return total


def _merged(probabilities: SetProbabilities, classes: Sequence[Sequence[str]]) -> dict[frozenset[str], float]:
    """Return the probabilities of sets of classes, each by its first name, the most probable first."""
    key = {name: min(members) for members in classes for name in members}
    total: dict[frozenset[str], float] = {}
    for cause_set in probabilities.sets:
        unknown = [] if cause_set.generic is None else [UNKNOWN]
        classes_at_work = frozenset([*(key[name] for name in cause_set.causes), *unknown])
        total[classes_at_work] = total.get(classes_at_work, 0.0) + cause_set.probability
    return dict(sorted(total.items(), key=lambda pair: (-pair[1], sorted(pair[0]))))


def _alternatives(merged: dict[frozenset[str], float], enough: float) -> list[frozenset[str]]:
    """Return the fewest of the most probable sets that hold enough probability with all that include one of them."""
    chosen: list[frozenset[str]] = []
    covered = 0.0
    left = dict(merged)
    while left and covered < enough:
        likeliest = next(iter(left))
        chosen.append(likeliest)
        within = [other for other in left if other == likeliest or (likeliest and likeliest <= other)]
        covered += sum(left.pop(other) for other in within)
    return chosen


@dataclass(frozen=True)
class VerdictSensitivity:
    """The verdict, and what it would have been under other choices.

    Attributes
    ----------
    verdict : ProbableVerdict
    others : mapping of str to ProbableVerdict
        Verdicts under the other choices, by a description of the choice.
    varied : tuple of str
        What the other choices change; all of `DiagnosisSettings` keep their values.
    """

    verdict: ProbableVerdict
    others: Mapping[str, ProbableVerdict]
    varied: tuple[str, ...] = ("prior.one_more_cause", "prior.generic", "bounds", "floors")

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
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
    noise: Collection[str] = (),
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
    settings : DiagnosisSettings, optional
    noise : collection of str, optional
        Causes that are faults of the noise.
    """
    others = {
        name: probable_verdict(probabilities.under(changed), classes, silent, settings, noise)
        for name, changed in _other_priors(probabilities.prior).items()
    }
    for name, bound, floor in (("bounds a decade higher", DECADE, 1.0), ("floors a decade lower", 1.0, 1.0 / DECADE)):
        others[name] = probable_verdict(widened(bound, floor), classes, silent, settings, noise)
    return VerdictSensitivity(probable_verdict(probabilities, classes, silent, settings, noise), others)


def _other_priors(prior: CausePrior) -> dict[str, CausePrior]:
    """Return the prior with each of its numbers halved and doubled; a probability stays below one."""
    priors = {}
    for number, words in (("one_more", "causes"), ("generic", "unknown")):
        for factor, verb in ((0.5, "half"), (2.0, "twice")):
            value = getattr(prior, number) * factor
            changed = min(value, 0.5 * (1.0 + getattr(prior, number)))
            priors[f"{words} {verb} as probable"] = replace(prior, **{number: changed})
    return priors


def classes_of_equivalents(
    evidence: SetEvidence,
    seen: float = DEFAULT_SETTINGS.visible_information,
    forms: Mapping[str, int] | None = None,
) -> tuple[tuple[str, ...], ...]:
    """Return the causes of the catalogue in classes, each sorted, in the order of their first names.

    A cause of several forms is compared in one of them: a fast train of pulses is the same as a leak, a slow one is
    not. Two causes are equivalent where neither offers anything visible, at the bounds of its scales, beyond what
    amplitudes of any size of the other can imitate. A joint effect of two causes is not compared with a third. What the
    data cannot see at all is equivalent to nothing, and each such cause is a class of its own. A cause joins a class if
    it is equivalent to every member.

    Parameters
    ----------
    evidence : SetEvidence
    seen : float
        Information on the amplitudes in units of their largest scale, in the most visible direction, from which on the
        data see a difference.
    forms : mapping of str to int, optional
        Form in which a cause is compared; by default the most probable one by itself.
    """
    columns, units, directions = {}, {}, {}
    for name in evidence.catalogue:
        spectra = evidence.spectra([name], None if forms is None or name not in forms else {name: forms[name]})
        columns[name] = np.concatenate([spectrum.columns for spectrum in spectra])
        units[name] = np.concatenate([spectrum.root * spectrum.range.high for spectrum in spectra])
        directions[name] = independent_directions(evidence.gram.matrix[np.ix_(columns[name], columns[name])])
    visible = {name for name in evidence.catalogue if _largest(evidence.gram, columns[name], units[name]) >= seen}

    def imitated(name: str, other: str) -> bool:
        left = _largest(evidence.gram, columns[name], units[name], columns[other], directions[other])
        return left < max(seen, ROUNDING * _largest(evidence.gram, columns[name], units[name]))

    classes: list[list[str]] = []
    for name in evidence.catalogue:
        for members in classes if name in visible else ():
            equivalent = (imitated(name, other) and imitated(other, name) for other in members)
            if members[0] in visible and all(equivalent):
                members.append(name)
                break
        else:
            classes.append([name])
    return tuple(tuple(members) for members in classes)


def _largest(
    gram: Gram, columns: Integers, units: Floats, others: Integers | None = None, directions: Floats | None = None
) -> float:
    """Return the largest eigenvalue of the information on columns, after others have taken their share."""
    matrix = gram.matrix[np.ix_(columns, columns)]
    if others is not None and directions is not None:
        shared = gram.matrix[np.ix_(columns, others)] @ directions
        matrix = matrix - shared @ shared.T
    return float(np.linalg.eigvalsh(units[:, None] * matrix * units).max(initial=0.0))
