"""Bank of signatures: what every candidate would change in the residual, per unit of its amplitudes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.gram import Gram
from bayesid.diagnosis.scale_prior import CandidateCause
from bayesid.inference.posterior import Posterior

__all__ = ["Fitted", "SignatureBank", "Signatures"]


class Fitted(Protocol):
    """A fitted model beside which signatures are weighed, such as a `Fit`."""

    @property
    def posterior(self) -> Posterior:
        """Posterior of whose recordings the rows of the residual are, one after the other."""

    @property
    def residual(self) -> Floats:
        """Whitened residual, shape (N,)."""

    @property
    def own(self) -> Floats:
        """Derivatives of the residual in the model's n unknowns, each with a standard normal prior, shape (N, n)."""

    @property
    def own_coordinates(self) -> Floats:
        """Those unknowns, shape (n,)."""


@dataclass(frozen=True)
class Signatures:
    """Columns of one group of amplitudes, or of those of its amplitudes that act in one recording alone.

    Attributes
    ----------
    name : str
        Name of the group in the Gram, which holds all columns of that name, recording after recording.
    columns : (N, k) array
        Derivatives of the whitened residual in the amplitudes: of all recordings, or of one, the others being zero.
    recording : int, optional
        Number of that one recording.
    tone : pair of float, optional
        Frequency [Hz] and damping ratio of a vibration.
    instants : tuple of float, optional
        Instant of a jump in each recording [s], infinite where it does not jump.
    """

    name: str
    columns: Floats
    recording: int | None = None
    tone: tuple[float, float] | None = None
    instants: tuple[float, ...] | None = None


@dataclass(frozen=True)
class SignatureBank:
    """Signatures of all groups of amplitudes, and the candidate causes that they belong to.

    Attributes
    ----------
    signatures : tuple of Signatures
    causes : tuple of CandidateCause
    """

    signatures: tuple[Signatures, ...] = ()
    causes: tuple[CandidateCause, ...] = ()

    @staticmethod
    def joined(banks: Iterable[SignatureBank]) -> SignatureBank:
        """Return several banks as one; groups of one name are the same and kept once."""
        found: dict[str, list[Signatures]] = {}
        causes: list[CandidateCause] = []
        for bank in banks:
            new: dict[str, list[Signatures]] = {}
            for item in bank.signatures:
                new.setdefault(item.name, []).append(item)
            found = new | found
            causes += bank.causes
        return SignatureBank(tuple(item for items in found.values() for item in items), tuple(causes))

    def gram(self, fit: Fitted) -> Gram:
        """Return the Gram of all signatures beside the model's own unknowns at a fit.

        The products of signatures less those of what the unknowns take are exact to a part in 1e16 of the former. Only
        a signature that the unknowns imitate to a part in 1e6 of its length would be lost in that; at the physical
        bounds, signatures are shorter than a million standard deviations of the noise.
        """
        recordings = len(fit.posterior.manoeuvres)
        rows = len(fit.residual) // recordings
        unknowns = fit.own.shape[1]
        upper = np.asarray(np.linalg.qr(np.concatenate([fit.own, np.eye(unknowns)]), mode="r"))
        places: list[Integers] = []
        for item in self.signatures:
            first = places[-1][-1] + 1 if places else 0
            places.append(np.arange(first, first + item.columns.shape[1]))
        size = sum(map(len, places))
        matrix, score, shared = np.zeros((size, size)), np.zeros(size), np.zeros((unknowns, size))
        for r in range(recordings):
            block = slice(r * rows, (r + 1) * rows)
            here = [index for index, item in enumerate(self.signatures) if item.recording in (None, r)]
            at = np.concatenate([np.zeros(0, dtype=int), *(places[index] for index in here)])
            own = (self.signatures[index] for index in here)
            parts = [item.columns[block] if item.recording is None else item.columns for item in own]
            columns = np.concatenate([np.zeros((rows, 0)), *parts], axis=1)
            matrix[np.ix_(at, at)] += columns.T @ columns
            score[at] += columns.T @ fit.residual[block]
            shared[:, at] += fit.own[block].T @ columns
        taken = np.linalg.solve(upper.T, shared)
        pull = np.linalg.solve(upper.T, fit.own.T @ fit.residual + fit.own_coordinates)
        groups: dict[str, Integers] = {}
        for item, where in zip(self.signatures, places, strict=True):
            groups[item.name] = np.concatenate([groups.get(item.name, np.zeros(0, dtype=int)), where])
        return Gram(matrix - taken.T @ taken, score - taken.T @ pull, groups)
