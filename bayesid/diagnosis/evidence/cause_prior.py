"""Prior probability of sets of causes: two numbers to choose, and no others."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

__all__ = ["CausePrior"]


@dataclass(frozen=True)
class CausePrior:
    """How many causes a study has, and whether something generic is at work.

    The number of causes is geometric: one more is at work with one probability, however many there are. All sets of
    one size are equally probable. The default of 0.1 keeps the promise of the alarm in the names as well: a cause with
    a probability of 0.9 leaves nothing with less than 0.1, and the average evidence of any set where nothing is lacking
    is 1, so that by Markov's inequality at most one such study in ``9 * 0.81 / 0.1 = 73`` names a cause without rivals,
    however many candidates there are. Among 40, one has to earn 8.2 nats beyond nothing for that, and a second one 7.5
    beyond the first.

    Something generic is at work, beside any causes, with the other probability, shared equally among the generic
    candidates. Its default of 0.1 says that what is lacking lies outside the catalogue as often as it is one of its
    causes: the least presumptuous choice for a catalogue whose completeness nobody knows.

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
            Whether the set holds a generic candidate.
        generics : int
            Number of generic candidates.
        """
        found = np.log1p(-self.one_more) + size * np.log(self.one_more) - np.log(comb(causes, size))
        if generic:
            found += np.log(self.generic / generics)
        elif generics:
            found += np.log1p(-self.generic)
        return float(found)
