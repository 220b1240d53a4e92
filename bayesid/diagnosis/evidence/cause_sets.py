"""Sets of causes that could be at work: their prior and posterior probabilities, and which of them are weighed.

All sets of one size share the prior of the size, which pays for the number of candidates (J. G. Scott and J. O. Berger,
Bayes and empirical-Bayes multiplicity adjustment in the variable-selection problem, Annals of Statistics 38, 2010).
Sets far less probable than the best so far are not extended (D. Madigan and A. E. Raftery, Model selection and
accounting for model uncertainty in graphical models using Occam's window, JASA 89, 1994).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from bayesid._math.arrays import log_sum
from bayesid._math.threads import in_threads
from bayesid.diagnosis.evidence.set_evidence import SetEvidence, near_best

__all__ = ["NEAR", "CausePrior", "CauseSet", "SetProbabilities", "enumerate_sets"]

MOST_CAUSES = 3
"""Most causes of the catalogue in one set; a generic candidate may stand beside them."""

FEW = 300  # extensions of all sets of one size up to which none is left out
BEST = 20  # sets of two and more candidates that are extended where there are more extensions than few
BESIDE = 4  # best sets without a generic candidate beside which the forms of each are chosen
SINGLES = 16  # single candidates that are extended to pairs where there are many

PROMISING = 1e-4
"""Probability relative to the most probable set so far down to which a set is extended, apart from the best of its
size: what is added to a less probable one would have to earn some 15 nats to matter."""

NEAR = 6.0
"""Logarithm of the probability relative to the most probable set so far down to which a set that the screening has
weighed is evaluated in full. The screening is off by about one nat at most in such sets, bodies apart, where it is an
upper bound."""

_Key = tuple[tuple[str, ...], str | None]
"""Causes and generic candidate of a set."""


@dataclass(frozen=True)
class CausePrior:
    """Prior probability of one more cause, and of a cause outside the catalogue.

    The number of causes is geometric: one more is at work with the same probability, regardless of how many there are.
    All sets of one size are equally probable. With the default of 0.1, the named causes have the reliability of the
    alarm: a cause with a probability of 0.9 permits less than 0.1 for no cause, and the average evidence of any set is
    1 if the model lacks nothing, so that by Markov's inequality at most one such study in ``9 * 0.81 / 0.1 = 73`` names
    a cause without rivals, regardless of the number of candidates. Among 40, one must gain 8.2 nats over no cause for
    that, and a second one 7.5 over the first.

    A generic candidate, which is outside the catalogue, is at work in addition to any causes with the other
    probability, shared equally among the generic candidates. Its default of 0.1 means that the missing cause is outside
    the catalogue as often as it is in it: the least presumptuous choice for a catalogue of unknown completeness.

    Attributes
    ----------
    one_more : float
        Probability that a study has one more cause.
    generic : float
        Probability that something generic is at work.
    """

    one_more: float = 0.1
    generic: float = 0.1

    def __post_init__(self) -> None:
        for name in ("one_more", "generic"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"{name} is a probability in (0, 1), received {getattr(self, name)}")

    def log_probability(self, size: int, causes: int, generic: bool, generics: int) -> float:
        """Return the logarithm of the prior probability of one set.

        Parameters
        ----------
        size, causes : int
            Number of causes in the set and in the catalogue.
        generic : bool
            Whether the set contains a generic candidate.
        generics : int
            Number of generic candidates.
        """
        log_prior = math.log1p(-self.one_more) + size * math.log(self.one_more) - math.log(math.comb(causes, size))
        if generic:
            log_prior += math.log(self.generic / generics)
        elif generics:
            log_prior += math.log1p(-self.generic)
        return log_prior


@dataclass(frozen=True)
class CauseSet:
    """One set of causes.

    Attributes
    ----------
    causes : tuple of str
        Causes of the catalogue, sorted.
    generic : str or None
        Generic candidate in addition to them.
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
        """Return the probabilities of sets of known evidence.

        Parameters
        ----------
        sets : iterable of CauseSet
            The empty one among them.
        causes, generics : iterable of str
            Names of all candidates of the catalogue and of all generic ones.
        prior : CausePrior
        """
        causes, generics, sets = tuple(sorted(causes)), tuple(sorted(generics)), list(sets)
        sizes = [(len(cause_set.causes), cause_set.generic is not None) for cause_set in sets]
        log_priors = {size: prior.log_probability(size[0], len(causes), size[1], len(generics)) for size in set(sizes)}
        totals = [log_priors[size] + cause_set.log_evidence for size, cause_set in zip(sizes, sets, strict=True)]
        shares = np.exp(np.array(totals) - logsumexp(totals)).tolist()
        rows = sorted(zip(sets, sizes, totals, shares, strict=True), key=lambda row: (-row[2], row[0].names))
        ranked = tuple(
            replace(cause_set, log_prior=log_priors[size], probability=share) for cause_set, size, _, share in rows
        )
        return SetProbabilities(ranked, causes, generics, prior)

    def under(self, prior: CausePrior) -> SetProbabilities:
        """Return the probabilities of the same sets under another prior of causes, without computing new evidence."""
        return SetProbabilities.of(self.sets, self.causes, self.generics, prior)

    def with_sets(self, sets: Iterable[CauseSet]) -> SetProbabilities:
        """Return the probabilities of other sets of the same causes and generic candidates, under the same prior."""
        return SetProbabilities.of(sets, self.causes, self.generics, self.prior)

    @property
    def nothing(self) -> float:
        """Probability that the model lacks nothing."""
        return _total(cause_set for cause_set in self.sets if not cause_set.names)

    @property
    def unknown(self) -> float:
        """Probability that something generic is at work, whatever causes accompany it."""
        return _total(cause_set for cause_set in self.sets if cause_set.generic is not None)

    def of_any(self, names: Collection[str]) -> float:
        """Return the probability that at least one of some candidates is at work, such as a class of equivalents."""
        candidates = set(names)
        return _total(cause_set for cause_set in self.sets if not candidates.isdisjoint(cause_set.names))

    @property
    def inclusion(self) -> dict[str, float]:
        """Probability of each candidate, generic ones included, to be at work, whatever accompanies it."""
        holding: dict[str, list[CauseSet]] = {name: [] for name in (*self.causes, *self.generics)}
        for cause_set in self.sets:
            for name in cause_set.names:
                holding[name].append(cause_set)
        return {name: _total(sets) for name, sets in holding.items()}


def _total(sets: Iterable[CauseSet]) -> float:
    """Return the probability of any of some sets, which rounding does not lift above one."""
    return min(math.fsum(cause_set.probability for cause_set in sets), 1.0)


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
    largest : int
        Most candidates in one set.
    beside : collection of str, optional
        Causes of the catalogue that are in every set; sets grow from these in place of nothing.
    """
    prior = CausePrior() if prior is None else prior
    sets = [_whole((tuple(sorted(beside)), None), evidence) if beside else CauseSet((), None, 0.0)]
    last = sets
    for size in range(len(beside) + 1, largest + 1):
        keys = _extensions(last, evidence)
        many = size > 1 and sum(_combinations(key, evidence) for key in keys) > FEW
        if many and size == 2:
            last = [cause_set for cause_set in _ranked(sets, evidence, prior) if len(cause_set.names) == 1][:SINGLES]
        elif size > 2 and len(keys) > FEW:
            last = _best(_ranked(sets, evidence, prior), size - 1)
            keys = _extensions(last, evidence)
        last = _screened(last, sets, evidence, prior) if many else [_whole(key, evidence) for key in keys]
        sets = sets + last
    return SetProbabilities.of(sets, evidence.catalogue, evidence.generics, prior)


def _ranked(sets: list[CauseSet], evidence: SetEvidence, prior: CausePrior) -> tuple[CauseSet, ...]:
    """Return sets with their probabilities among themselves, the most probable first."""
    return SetProbabilities.of(sets, evidence.catalogue, evidence.generics, prior).sets


def _names(key: _Key) -> tuple[str, ...]:
    return key[0] if key[1] is None else (*key[0], key[1])


def _in_order(keys: Iterable[_Key]) -> list[_Key]:
    return sorted(keys, key=lambda key: (key[0], key[1] or ""))


def _combinations(key: _Key, evidence: SetEvidence) -> int:
    """Return the number of combinations of forms of a set."""
    return math.prod(len(evidence.causes[name].variants) for name in _names(key))


def _whole(key: _Key, evidence: SetEvidence) -> CauseSet:
    """Return a set with its evidence integrated over all scales and forms."""
    return CauseSet(*key, evidence.log_evidence(_names(key)))


def _others(parent: CauseSet, evidence: SetEvidence) -> list[str]:
    """Return the causes of the catalogue by which a set can grow."""
    return [name for name in evidence.catalogue if name not in parent.causes and len(parent.causes) < MOST_CAUSES]


def _extensions(sets: Iterable[CauseSet], evidence: SetEvidence) -> list[_Key]:
    """Return all sets with one candidate more, each once, in the order of their names."""
    keys: set[_Key] = set()
    for cause_set in sets:
        keys.update(
            (tuple(sorted((*cause_set.causes, name))), cause_set.generic) for name in _others(cause_set, evidence)
        )
        if cause_set.generic is None:
            keys.update((cause_set.causes, name) for name in evidence.generics)
    return _in_order(keys)


def _best(ranked: Iterable[CauseSet], size: int) -> list[CauseSet]:
    """Return the sets of one size that are worth extending, among sets in the order of their probability.

    Where several causes are at work, something generic beside one of them takes the place of the others. The most
    probable set without it is therefore extended, too, however improbable it is.
    """
    ranked = list(ranked)
    last = [cause_set for cause_set in ranked if len(cause_set.names) == size]
    always = (*last[:1], *[cause_set for cause_set in last if cause_set.generic is None][:1])
    least = PROMISING * ranked[0].probability
    promising = [cause_set for cause_set in last[:BEST] if cause_set.probability >= least]
    return [cause_set for cause_set in last if cause_set in always or cause_set in promising]


def _screened(
    parents: list[CauseSet], sets: list[CauseSet], evidence: SetEvidence, prior: CausePrior
) -> list[CauseSet]:
    """Return the sets of one candidate more than their parents; those that matter are integrated in full.

    A generic candidate has other forms beside a cause than by itself: beside the best sets that have none it is added
    last, too.
    """
    named = sorted((one for one in parents if one.generic is None), key=lambda one: -one.log_evidence)[:BESIDE]

    def others(parent: CauseSet) -> list[str]:
        return [*_others(parent, evidence), *(evidence.generics if parent in named else ())]

    def gains(parent: CauseSet) -> tuple[dict[str, int], dict[str, dict[int, float]]]:
        forms = evidence.forms(parent.names)
        return forms, evidence.gains_beside(parent.names, forms, others(parent))

    weighed: dict[_Key, tuple[float, list[dict[str, int]]]] = {}
    grown = [parent for parent in parents if others(parent)]
    for parent, (forms, each) in zip(grown, in_threads(gains, grown), strict=True):
        for name, values in each.items():
            generic = name in evidence.generics
            key = (parent.causes, name) if generic else (tuple(sorted((*parent.causes, name))), parent.generic)
            gain = log_sum(list(values.values())) + max(evidence.bodily.get(name, 0.0), 0.0)
            before, choices = weighed.get(key, (-np.inf, []))
            more = [{**forms, name: form} for form in near_best(values)]
            choices = choices + [choice for choice in more if choice not in choices]
            weighed[key] = max(before, parent.log_evidence + gain), choices
    new = {key: CauseSet(*key, weighed[key][0]) for key in _in_order(weighed)}
    whole: set[_Key] = set()
    while True:
        # a bound that was too high hides others, so that the best one must have been evaluated
        ranked = _ranked([*sets, *new.values()], evidence, prior)
        least = np.exp(-NEAR) * ranked[0].probability
        likely = {(cause_set.causes, cause_set.generic) for cause_set in ranked if cause_set.probability >= least}
        matter = _in_order(likely & weighed.keys() - whole)
        if not matter:
            return list(new.values())
        totals = in_threads(lambda key: evidence.log_evidence(_names(key), weighed[key][1]), matter)
        new |= {key: replace(new[key], log_evidence=total) for key, total in zip(matter, totals, strict=True)}
        whole.update(matter)
