"""Enumeration of the sets of causes that could be at work."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace

import numpy as np

from bayesid._math.log_sum import log_sum
from bayesid._math.threads import in_threads
from bayesid.diagnosis.evidence.cause_prior import CausePrior
from bayesid.diagnosis.evidence.set_evidence import SetEvidence, near_best
from bayesid.diagnosis.evidence.set_probabilities import CauseSet, SetProbabilities

__all__ = ["enumerate_sets"]

MOST_CAUSES = 3
"""Most causes of the catalogue in one set; a generic candidate may stand beside them."""

FEW = 300
"""Number of extensions of all sets of one size up to which none is left out."""

BEST = 20
"""Most sets of two and more candidates that are extended where there are more extensions than few."""

SINGLES = 16
"""Most single candidates that are extended to pairs where there are many."""

PROMISING = 1e-4
"""Probability relative to the most probable set so far down to which a set is extended, apart from the best of its
size: what is added to a less probable one would have to earn some 15 nats to matter."""


NEAR = 6.0
"""Logarithm of the probability relative to the most probable set so far down to which a set that the screening has
weighed is evaluated in full. The screening is off by about one nat at most in such sets, bodies apart, where it is an
upper bound."""


def enumerate_sets(
    evidence: SetEvidence,
    prior: CausePrior | None = None,
    largest: int = MOST_CAUSES + 1,
    beside: Collection[str] = (),
) -> SetProbabilities:
    """Return the probabilities of nothing, of all single candidates, all pairs, and larger sets grown from the best.

    Sets grow by one candidate at a time, of which at most one is generic. All single candidates are considered, and
    all pairs, a cause beside a generic candidate among them; where the forms of candidates make the pairs too many,
    those with one of the best single candidates. Larger ones are the extensions of the best sets of one
    fewer: of the most probable one, of the most probable one without anything generic, of up to 19 others that are not
    much less probable than the most probable set of any size, and of all where their extensions are few. A large set is
    missed only if none of those within it is among these.

    Where there are many, all are weighed first by what their last member adds to the others at the others' most
    probable scales (`SetEvidence.gains_beside`). Only those whose weight matters are then integrated over all scales.

    Parameters
    ----------
    evidence : SetEvidence
    prior : CausePrior, optional
        Prior of sets; by default `CausePrior` with its defaults.
    largest : int
        Most candidates in one set.
    beside : collection of str, optional
        Causes of the catalogue that are in every set; sets grow from these in place of nothing.
    """
    prior = CausePrior() if prior is None else prior
    found = [_whole((tuple(sorted(beside)), None), evidence) if beside else CauseSet((), None, 0.0)]
    last = found
    for size in range(len(beside) + 1, largest + 1):
        keys = _extensions(last, evidence)
        many = size > 1 and sum(_cost(key, evidence) for key in keys) > FEW
        if many and size == 2:
            last = _strongest(found, evidence, prior)
        elif size > 2 and len(keys) > FEW:
            last = _best(found, size - 1, evidence, prior)
            keys = _extensions(last, evidence)
        last = _screened(last, found, evidence, prior) if many else [_whole(key, evidence) for key in keys]
        found = found + last
    return SetProbabilities.of(found, evidence.catalogue, evidence.generics, prior)


def _cost(key: tuple[tuple[str, ...], str | None], evidence: SetEvidence) -> int:
    """Return the number of combinations of forms of a set."""
    count = 1
    for name in _names(key):
        count *= len(evidence.causes[name].variants)
    return count


def _names(key: tuple[tuple[str, ...], str | None]) -> tuple[str, ...]:
    return key[0] if key[1] is None else (*key[0], key[1])


def _whole(key: tuple[tuple[str, ...], str | None], evidence: SetEvidence) -> CauseSet:
    """Return a set with its evidence integrated over all scales and forms."""
    return CauseSet(*key, evidence.log_evidence(_names(key)))


def _screened(
    parents: list[CauseSet], found: list[CauseSet], evidence: SetEvidence, prior: CausePrior
) -> list[CauseSet]:
    """Return the sets of one candidate more than their parents; those that matter are integrated in full."""
    weighed: dict[tuple[tuple[str, ...], str | None], tuple[float, list[dict[str, int]]]] = {}
    grown = [parent for parent in parents if len(parent.causes) < MOST_CAUSES and _others(parent, evidence)]
    for parent, (forms, gains) in zip(grown, in_threads(lambda own: _gains(own, evidence), grown), strict=True):
        for name, values in gains.items():
            key = (tuple(sorted((*parent.causes, name))), parent.generic)
            gain = log_sum(list(values.values())) + max(evidence.bodily.get(name, 0.0), 0.0)
            choices = [{**forms, name: form} for form in near_best(values)]
            before, others_choices = weighed.get(key, (-np.inf, []))
            weighed[key] = (
                max(before, parent.log_evidence + gain),
                others_choices + [choice for choice in choices if choice not in others_choices],
            )
    sets = [
        CauseSet(*key, value)
        for key, (value, _) in sorted(weighed.items(), key=lambda item: (item[0][0], item[0][1] or ""))
    ]
    whole: set[tuple[tuple[str, ...], str | None]] = set()
    while True:
        # a bound that was too high hides others, so that the best one must have been evaluated
        everything = SetProbabilities.of(found + sets, evidence.catalogue, evidence.generics, prior).sets
        least = np.exp(-NEAR) * everything[0].probability
        likely = {(item.causes, item.generic) for item in everything if item.probability >= least}
        matter = likely & weighed.keys() - whole
        if not matter:
            return sets
        ordered = sorted(matter, key=lambda key: (key[0], key[1] or ""))
        totals = in_threads(lambda key: evidence.log_evidence(_names(key), weighed[key][1]), ordered)
        exact = dict(zip(ordered, totals, strict=True))
        sets = [replace(item, log_evidence=exact.get((item.causes, item.generic), item.log_evidence)) for item in sets]
        whole |= matter


def _others(parent: CauseSet, evidence: SetEvidence) -> list[str]:
    """Return the causes of the catalogue that a set does not hold."""
    return [name for name in evidence.catalogue if name not in parent.causes]


def _gains(parent: CauseSet, evidence: SetEvidence) -> tuple[dict[str, int], dict[str, dict[int, float]]]:
    """Return the forms of a set, and what every other cause adds to it, by the forms of that cause."""
    forms = evidence.forms(parent.names)
    return forms, evidence.gains_beside(parent.names, forms, _others(parent, evidence))


def _best(found: list[CauseSet], size: int, evidence: SetEvidence, prior: CausePrior) -> list[CauseSet]:
    """Return the sets of one size that are worth extending.

    Where several causes are at work, something generic beside one of them takes the place of the others. The most
    probable set without it is therefore extended, too, however improbable it is.
    """
    ranked = SetProbabilities.of(found, evidence.catalogue, evidence.generics, prior).sets
    least = PROMISING * ranked[0].probability
    last = [item for item in ranked if len(item.names) == size]
    named = [item for item in last if item.generic is None]
    always = (*last[:1], *named[:1])
    return [item for place, item in enumerate(last) if item in always or (place < BEST and item.probability >= least)]


def _strongest(found: list[CauseSet], evidence: SetEvidence, prior: CausePrior) -> list[CauseSet]:
    """Return the single candidates that are worth extending, the most probable first."""
    ranked = SetProbabilities.of(found, evidence.catalogue, evidence.generics, prior).sets
    return [item for item in ranked if len(item.names) == 1][:SINGLES]


def _extensions(sets: Iterable[CauseSet], evidence: SetEvidence) -> list[tuple[tuple[str, ...], str | None]]:
    """Return all sets with one candidate more, each once, in the order of their names."""
    keys: set[tuple[tuple[str, ...], str | None]] = set()
    for item in sets:
        if len(item.causes) < MOST_CAUSES:
            others = [name for name in evidence.catalogue if name not in item.causes]
            keys.update((tuple(sorted((*item.causes, name))), item.generic) for name in others)
        if item.generic is None:
            keys.update((item.causes, name) for name in evidence.generics)
    return sorted(keys, key=lambda key: (key[0], key[1] or ""))
