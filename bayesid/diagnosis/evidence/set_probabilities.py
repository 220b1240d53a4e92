"""Posterior probabilities of sets of causes."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from bayesid.diagnosis.evidence.cause_prior import CausePrior

__all__ = ["CauseSet", "SetProbabilities"]


@dataclass(frozen=True)
class CauseSet:
    """One set of causes.

    Attributes
    ----------
    causes : tuple of str
        Causes of the catalogue, sorted.
    generic : str or None
        Generic candidate beside them.
    log_evidence : float
        Relative to nothing.
    log_prior : float
        Logarithm of its prior probability.
    probability : float
        Posterior probability among all sets considered.
    """

    causes: tuple[str, ...]
    generic: str | None
    log_evidence: float
    log_prior: float = 0.0
    probability: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """All candidates in the set."""
        return self.causes if self.generic is None else (*self.causes, self.generic)


@dataclass(frozen=True)
class SetProbabilities:
    """Probabilities of all sets considered.

    Attributes
    ----------
    sets : tuple of CauseSet
        Sets, the most probable first. The empty one is always among them.
    causes, generics : tuple of str
        Names of all candidates of the catalogue and of all generic ones, sorted.
    prior : CausePrior
    """

    sets: tuple[CauseSet, ...]
    causes: tuple[str, ...]
    generics: tuple[str, ...]
    prior: CausePrior

    @staticmethod
    def of(
        sets: Iterable[CauseSet], causes: Iterable[str], generics: Iterable[str], prior: CausePrior
    ) -> SetProbabilities:
        """Return the probabilities of sets of known evidence, the empty one among them."""
        causes, generics = tuple(sorted(causes)), tuple(sorted(generics))
        sets = list(sets)
        sizes = [(len(item.causes), item.generic is not None) for item in sets]
        log_priors = {own: prior.log_probability(own[0], len(causes), own[1], len(generics)) for own in set(sizes)}
        own_priors = [log_priors[own] for own in sizes]
        totals = [log_prior + item.log_evidence for log_prior, item in zip(own_priors, sets, strict=True)]
        shares = np.exp(np.array(totals) - logsumexp(totals)).tolist()
        order = sorted(range(len(sets)), key=lambda index: (-totals[index], sets[index].names))
        found = tuple(
            CauseSet(item.causes, item.generic, item.log_evidence, own_priors[index], shares[index])
            for index, item in ((index, sets[index]) for index in order)
        )
        return SetProbabilities(found, causes, generics, prior)

    def under(self, prior: CausePrior) -> SetProbabilities:
        """Return the probabilities of the same sets under another prior of causes; no evidence is computed anew."""
        return SetProbabilities.of(self.sets, self.causes, self.generics, prior)

    @property
    def nothing(self) -> float:
        """Probability that nothing is lacking."""
        return _total(item for item in self.sets if not item.names)

    @property
    def unknown(self) -> float:
        """Probability that something generic is at work, whatever causes accompany it."""
        return _total(item for item in self.sets if item.generic is not None)

    def of_any(self, names: Collection[str]) -> float:
        """Return the probability that at least one of some candidates is at work, such as a class of equivalents."""
        wanted = set(names)
        return _total(item for item in self.sets if not wanted.isdisjoint(item.names))

    @property
    def inclusion(self) -> dict[str, float]:
        """Probability of each candidate, generic ones included, to be at work, whatever accompanies it."""
        holding: dict[str, list[CauseSet]] = {name: [] for name in (*self.causes, *self.generics)}
        for item in self.sets:
            for name in item.names:
                holding[name].append(item)
        return {name: _total(sets) for name, sets in holding.items()}


def _total(sets: Iterable[CauseSet]) -> float:
    """Return the probability of any of some sets, which rounding does not lift above one."""
    return min(math.fsum(item.probability for item in sets), 1.0)
