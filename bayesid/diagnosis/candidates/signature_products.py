"""Products of signatures with one another, with the residual and with the unknowns of a fit, which give their Gram."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid._math.threads import several_threads
from bayesid.diagnosis.candidates.signature_bank import Signatures
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import rows_of

__all__ = ["Fitted", "SignatureProducts"]


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
class SignatureProducts:
    """Products of all signatures at a fit.

    Attributes
    ----------
    fit : Fitted
    signatures : tuple of Signatures
    places : tuple of arrays of int
        Places of the columns of each signature in the products.
    matrix : (m, m) array
        Of the columns of all signatures with one another.
    score : (m,) array
        With the residual.
    shared : (n, m) array
        With the derivatives in the model's unknowns.
    """

    fit: Fitted
    signatures: tuple[Signatures, ...]
    places: tuple[Integers, ...]
    matrix: Floats
    score: Floats
    shared: Floats

    @classmethod
    def of(
        cls, signatures: Sequence[Signatures], fit: Fitted, known: SignatureProducts | None = None
    ) -> SignatureProducts:
        """Return the products, of which those of signatures among the known ones at the same fit are taken from there.

        The columns that are known come first, then those that act in all recordings, then those of each recording, so
        that most products are written to contiguous blocks.
        """
        if known is None or known.fit is not fit:
            known = cls(fit, (), (), np.zeros((0, 0)), np.zeros(0), np.zeros((fit.own.shape[1], 0)))
        new = [item for item in signatures if id(item) not in known._at]
        with several_threads(sum(item.columns.shape[1] for item in new)):
            found = known._only(signatures)._with(new)
        places = tuple(found._at[id(item)] for item in signatures)
        return replace(found, signatures=tuple(signatures), places=places)

    @property
    def _at(self) -> dict[int, Integers]:
        """Places of the columns of each signature, by its identity."""
        return {id(item): where for item, where in zip(self.signatures, self.places, strict=True)}

    def _only(self, signatures: Sequence[Signatures]) -> SignatureProducts:
        """Return the products of those signatures that are known, without the columns of others."""
        at = self._at
        kept = tuple(item for item in signatures if id(item) in at)
        there = np.sort(np.concatenate([np.arange(0), *(at[id(item)] for item in kept)]))
        if len(there) == len(self.score):
            return self
        places = tuple(np.searchsorted(there, at[id(item)]) for item in kept)
        return SignatureProducts(
            self.fit, kept, places, self.matrix[np.ix_(there, there)], self.score[there], self.shared[:, there]
        )

    def _with(self, new: Sequence[Signatures]) -> SignatureProducts:
        """Return the products with those of further signatures."""
        fit, old = self.fit, len(self.score)
        recordings = len(fit.posterior.manoeuvres)
        parts = [[item for item in new if item.recording == r] for r in (None, *range(recordings))]
        ordered = [item for part in parts for item in part]
        places, size = [], old
        for item in ordered:
            places.append(np.arange(size, size + item.columns.shape[1]))
            size += item.columns.shape[1]
        matrix, score, shared = np.zeros((size, size)), np.zeros(size), np.zeros((fit.own.shape[1], size))
        matrix[:old, :old], score[:old], shared[:, :old] = self.matrix, self.score, self.shared
        ends = old + np.cumsum([sum(item.columns.shape[1] for item in part) for part in parts])
        for r in range(recordings):
            block = rows_of(fit.posterior, r)
            known = [item for item in self.signatures if item.recording in (None, r)]
            at = self._at
            before = np.concatenate([np.arange(0), *(at[id(item)] for item in known)])
            beside = [(before, _columns(known, block))]
            for own, first, last in ((parts[0], old, ends[0]), (parts[r + 1], ends[r], ends[r + 1])):
                here, columns = slice(first, last), _columns(own, block)
                matrix[here, here] += columns.T @ columns
                score[here] += columns.T @ fit.residual[block]
                shared[:, here] += fit.own[block].T @ columns
                for other, further in beside:
                    cross = further.T @ columns
                    matrix[other, here] += cross
                    matrix[here, other] += cross.T
                beside.append((np.arange(first, last), columns))
        return SignatureProducts(fit, (*self.signatures, *ordered), (*self.places, *places), matrix, score, shared)

    def gram(self) -> Gram:
        """Return the Gram of all signatures beside the model's own unknowns.

        The products of signatures less those of what the unknowns take are exact to a part in 1e16 of the former. Only
        a signature that the unknowns imitate to a part in 1e6 of its length would be lost in that; at the physical
        bounds, signatures are shorter than a million standard deviations of the noise.
        """
        fit = self.fit
        upper = np.asarray(np.linalg.qr(np.concatenate([fit.own, np.eye(fit.own.shape[1])]), mode="r"))
        taken = np.linalg.solve(upper.T, self.shared)
        pull = np.linalg.solve(upper.T, fit.own.T @ fit.residual + fit.own_coordinates)
        groups: dict[str, Integers] = {}
        for item, where in zip(self.signatures, self.places, strict=True):
            groups[item.name] = np.concatenate([groups.get(item.name, np.zeros(0, dtype=int)), where])
        matrix = taken.T @ taken
        np.subtract(self.matrix, matrix, out=matrix)
        return Gram.owning(matrix, self.score - taken.T @ pull, groups)


def _columns(signatures: Sequence[Signatures], block: slice) -> Floats:
    """Return the columns of signatures in the rows of one recording."""
    parts = [item.columns[block] if item.recording is None else item.columns for item in signatures]
    return np.concatenate([np.zeros((block.stop - block.start, 0)), *parts], axis=1)
