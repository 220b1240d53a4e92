"""From the probabilities of sets of causes to the verdict of diagnosis.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from bayesid.diagnosis.evidence.set_probabilities import SetProbabilities
from bayesid.diagnosis.evidence.status import Status

__all__ = ["UNKNOWN", "ProbableVerdict", "probable_verdict"]

NAMED = 0.9
"""Probability of its class from which on a cause is named without rivals."""

COVERED = 0.95
"""Probability that the alternatives of an ambiguous verdict hold together."""

MOST_ALTERNATIVES = 4
"""Most alternatives that are named; among more, none is."""

UNKNOWN = "unknown"
"""Name of the generic candidates among the alternatives."""


@dataclass(frozen=True)
class ProbableVerdict:
    """What the probabilities say.

    Attributes
    ----------
    status : Status
    causes : tuple of str
        Best set of causes, one for each class, the most probable first; empty unless explained or ambiguous.
    equivalent_to : dict of str to tuple of str
        Other names for the same change of the model, by cause; only causes that have any.
    ambiguous_with : tuple of tuples of str
        Other alternatives, the most probable first. An empty one says that nothing may be lacking, and the name
        "unknown" stands for any generic candidate.
    """

    status: Status
    causes: tuple[str, ...] = ()
    equivalent_to: dict[str, tuple[str, ...]] = field(default_factory=dict)
    ambiguous_with: tuple[tuple[str, ...], ...] = ()


def probable_verdict(
    probabilities: SetProbabilities, classes: Sequence[Sequence[str]], silent: bool
) -> ProbableVerdict:
    """Return the verdict on sets of causes.

    Sets are first merged: equivalent causes count as one class, and all generic candidates as one more, the unknown.

    - adequate: the alarm is silent.
    - unknown: generic candidates hold the majority.
    - explained: every class of the best set has a probability of 0.9 or more, whatever accompanies it. The best set is
      the most probable one without anything generic.
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
    """
    if silent:
        return ProbableVerdict(Status.ADEQUATE)
    if probabilities.unknown > 0.5:
        return ProbableVerdict(Status.UNKNOWN)
    merged = _merged(probabilities, classes)
    alternatives = _alternatives(merged)
    best = next(item for item in merged if UNKNOWN not in item)
    inclusion = probabilities.inclusion
    ordered = [sorted(members, key=lambda name: (-inclusion[name], name)) for members in classes]
    names = {members[0]: ordered[index] for index, members in enumerate(map(sorted, classes))}
    held = dict.fromkeys(names, 0.0)
    for item, probability in merged.items():
        for key in item - {UNKNOWN}:
            held[key] += probability

    def named(item: frozenset[str]) -> tuple[str, ...]:
        known = sorted(item - {UNKNOWN}, key=lambda key: (-held[key], key))
        return (*(names[key][0] for key in known), *([UNKNOWN] if UNKNOWN in item else []))

    explained = bool(best) and all(held[key] >= NAMED for key in best)
    if not explained and (not best or not 2 <= len(alternatives) <= MOST_ALTERNATIVES):
        return ProbableVerdict(Status.UNRESOLVED)
    others = () if explained else tuple(named(item) for item in alternatives if item != best)
    mentioned = {name for item in (named(best), *others) for name in item}
    equivalent = {members[0]: tuple(members[1:]) for members in ordered if len(members) > 1 and members[0] in mentioned}
    return ProbableVerdict(Status.EXPLAINED if explained else Status.AMBIGUOUS, named(best), equivalent, others)


def _merged(probabilities: SetProbabilities, classes: Sequence[Sequence[str]]) -> dict[frozenset[str], float]:
    """Return the probabilities of sets of classes, each by its first name, the most probable first."""
    key = {name: min(members) for members in classes for name in members}
    total: dict[frozenset[str], float] = {}
    for item in probabilities.sets:
        own = frozenset([*(key[name] for name in item.causes), *([UNKNOWN] if item.generic is not None else [])])
        total[own] = total.get(own, 0.0) + item.probability
    return dict(sorted(total.items(), key=lambda pair: (-pair[1], sorted(pair[0]))))


def _alternatives(merged: dict[frozenset[str], float]) -> list[frozenset[str]]:
    """Return the fewest of the most probable sets that hold 0.95 with all that include one of them."""
    chosen: list[frozenset[str]] = []
    covered = 0.0
    left = dict(merged)
    while left and covered < COVERED:
        item = next(iter(left))
        chosen.append(item)
        within = [other for other in left if other == item or (item and item <= other)]
        covered += sum(left.pop(other) for other in within)
    return chosen
