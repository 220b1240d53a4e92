"""Enumeration of the sets of causes that could be at work."""

from __future__ import annotations

from collections.abc import Iterable

from bayesid.diagnosis.cause_prior import CausePrior
from bayesid.diagnosis.set_evidence import SetEvidence
from bayesid.diagnosis.set_probabilities import CauseSet, SetProbabilities

__all__ = ["enumerate_sets"]

MOST_CAUSES = 3
"""Most causes of the catalogue in one set; a generic candidate may stand beside them."""

FEW = 300
"""Number of extensions of all sets of one size up to which none is left out."""

BEST = 20
"""Most sets of two and more candidates that are extended where there are more extensions than few."""

PROMISING = 1e-4
"""Probability relative to the most probable set so far down to which a set is extended, apart from the best of its
size: what is added to a less probable one would have to earn some 15 nats to matter."""


def enumerate_sets(evidence: SetEvidence, prior: CausePrior | None = None) -> SetProbabilities:
    """Return the probabilities of nothing, of all single candidates, all pairs, and larger sets grown from the best.

    Sets grow by one candidate at a time, of which at most one is generic. All sets of up to two candidates are
    considered, a cause beside a generic candidate among them. Larger ones are the extensions of the best sets of one
    fewer: of the most probable one, of up to 19 others that are not much less probable than the most probable set of
    any size, and of all where their extensions are few. A large set is missed only if none of those within it is among
    these.

    Parameters
    ----------
    evidence : SetEvidence
    prior : CausePrior, optional
        Prior of sets; by default `CausePrior` with its defaults.
    """
    prior = CausePrior() if prior is None else prior
    found = [CauseSet((), None, 0.0)]
    last = found
    for size in range(1, MOST_CAUSES + 2):
        keys = _extensions(last, evidence)
        if size > 2 and len(keys) > FEW:
            keys = _extensions(_best(found, size - 1, evidence, prior), evidence)
        last = [
            CauseSet(causes, generic, evidence.log_evidence(causes if generic is None else (*causes, generic)))
            for causes, generic in keys
        ]
        found = found + last
    return SetProbabilities.of(found, evidence.catalogue, evidence.generics, prior)


def _best(found: list[CauseSet], size: int, evidence: SetEvidence, prior: CausePrior) -> list[CauseSet]:
    """Return the sets of one size that are worth extending."""
    ranked = SetProbabilities.of(found, evidence.catalogue, evidence.generics, prior).sets
    least = PROMISING * ranked[0].probability
    last = [item for item in ranked if len(item.names) == size][:BEST]
    return [item for place, item in enumerate(last) if place == 0 or item.probability >= least]


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
