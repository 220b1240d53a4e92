"""The model linearised about a fit: signatures of all candidates, their products and Gram, evidence, what is left.

A signature is what a candidate would change in the whitened residual, per unit of its amplitudes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid._math.threads import several_threads
from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram
from bayesid.diagnosis.evidence.scales import CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.response.present_fit import with_bodies_held
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import rows_of
from bayesid.simulation.effects.effect import Effect

__all__ = ["Fitted", "Linearisation", "Remaining", "SignatureBank", "SignatureProducts", "Signatures"]

LARGE = 2e8
"""Memory of columns that are computed anew where they are wanted again [bytes]."""


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
    order : float, optional
        Order of a line: its speed over that of a wheel.
    effect : Effect, optional
        The effect in this form, of a cause that has a shape.
    """

    name: str
    columns: Floats
    recording: int | None = None
    tone: tuple[float, float] | None = None
    instants: tuple[float, ...] | None = None
    order: float | None = None
    effect: Effect | None = None

    @property
    def is_linear(self) -> bool:
        """Whether the columns have neither a frequency, nor an instant, nor any other shape."""
        return all(shape is None for shape in (self.tone, self.instants, self.order, self.effect))


@dataclass(frozen=True)
class SignatureBank:
    """Signatures of all groups of amplitudes, and the candidate causes that they belong to.

    Attributes
    ----------
    signatures : tuple of Signatures
    causes : tuple of CandidateCause
    unions : mapping of str to tuple of str
        Groups that consist of other groups, by their names.
    """

    signatures: tuple[Signatures, ...] = ()
    causes: tuple[CandidateCause, ...] = ()
    unions: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @staticmethod
    def joined(banks: Iterable[SignatureBank]) -> SignatureBank:
        """Return several banks as one; groups of one name are the same and kept once."""
        found: dict[str, list[Signatures]] = {}
        causes: list[CandidateCause] = []
        unions: dict[str, tuple[str, ...]] = {}
        for bank in banks:
            new: dict[str, list[Signatures]] = {}
            for item in bank.signatures:
                new.setdefault(item.name, []).append(item)
            found = new | found
            causes += bank.causes
            unions |= bank.unions
        return SignatureBank(tuple(item for items in found.values() for item in items), tuple(causes), unions)

    @property
    def memory(self) -> int:
        """Memory of the columns [bytes]."""
        return sum(one.columns.nbytes for one in self.signatures)

    def without_columns(self) -> SignatureBank:
        """Return the bank with the names, tones and instants of its signatures alone."""
        bare = tuple(replace(item, columns=np.zeros((0, item.columns.shape[1]))) for item in self.signatures)
        return replace(self, signatures=bare)


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

    def gram(self, unions: Mapping[str, tuple[str, ...]] | None = None) -> Gram:
        """Return the Gram of all signatures beside the model's own unknowns, with groups that consist of others.

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
        for name, parts in (unions or {}).items():
            groups[name] = np.concatenate([groups[part] for part in parts])
        matrix = taken.T @ taken
        np.subtract(self.matrix, matrix, out=matrix)
        return Gram.owning(matrix, self.score - taken.T @ pull, groups)


def _columns(signatures: Sequence[Signatures], block: slice) -> Floats:
    """Return the columns of signatures in the rows of one recording."""
    parts = [item.columns[block] if item.recording is None else item.columns for item in signatures]
    return np.concatenate([np.zeros((block.stop - block.start, 0)), *parts], axis=1)


@dataclass(frozen=True)
class Linearisation:
    """A model and all that it may lack, linear about one fit.

    Attributes
    ----------
    perturbed : PerturbedModel
    fit : Fit
        With no effect or with some that are linear in their parameters.
    bank : SignatureBank
    evidence : SetEvidence
        Of sets of causes relative to nothing, by the linear model.
    log_nothing : float
        Logarithm of the evidence of the present model without any cause, by the linear model.
    present : mapping of str to array
        Amplitudes of what the fit holds, by the names of their groups.
    products : SignatureProducts or None
        Of all signatures of the bank, as long as further banks that differ little from it are made.
    bodies_fixed : bool
        Whether the bodies stay where the fit has them, since the present model's own fit diverged.
    far : bool
        Whether the present model's own fit diverged, so that fits find the data from the motion here alone.
    """

    perturbed: PerturbedModel
    fit: Fit
    bank: SignatureBank
    evidence: SetEvidence
    log_nothing: float
    present: Mapping[str, Floats]
    products: SignatureProducts | None
    bodies_fixed: bool = False
    far: bool = False

    @staticmethod
    def of(
        perturbed: PerturbedModel,
        fit: Fit,
        bank: SignatureBank,
        present: Mapping[str, Floats],
        bodies_fixed: bool,
        far: bool,
        like: Linearisation | None = None,
    ) -> Linearisation:
        """Return the linear model of a bank of signatures about a fit.

        Where the fit holds effects, their amplitudes there are not zero. The likelihood is quadratic about them, and
        the linear terms that this leaves at zero belong to the score: with ``a`` the amplitudes at the fit, the score
        is ``g - A a``, and the evidence of nothing holds ``g'a - a'A a / 2``.

        Parameters
        ----------
        perturbed, fit, bank, present, bodies_fixed, far
            As the attributes.
        like : Linearisation, optional
            About the same fit with a bank that differs little, of which what agrees is taken.
        """
        products = SignatureProducts.of(bank.signatures, fit, None if like is None else like.products)
        gram = products.gram(bank.unions)
        amplitudes = _amplitudes(present, gram)
        unknowns, z = GaussianBlock.of(fit.own.T @ fit.own), fit.own_coordinates
        moved = unknowns.share(fit.own.T @ fit.residual + z)
        cost = 0.5 * float(fit.residual @ fit.residual + z @ z - moved @ moved)
        constant = float(fit.posterior.log_normalisation.sum()) - unknowns.half_log_det
        taken = gram.matrix @ amplitudes
        log_nothing = constant - cost + float(gram.score @ amplitudes - 0.5 * amplitudes @ taken)
        gram = replace(gram, score=gram.score - taken)
        weighed = SetEvidence(gram, bank.causes, None if like is None else like.evidence)
        return Linearisation(perturbed, fit, bank, weighed, log_nothing, present, products, bodies_fixed, far)

    def with_bank(self, bank: SignatureBank) -> Linearisation:
        """Return the linearisation with another bank about the same fit."""
        return Linearisation.of(self.perturbed, self.fit, bank, self.present, self.bodies_fixed, self.far, self)

    def without_products(self) -> Linearisation:
        """Return the linearisation without the products, which take as much memory as the Gram.

        Columns that take much memory go as well, unless other fits are to be made about the motion here.
        """
        large = self.bank.memory > LARGE and not self.far
        return replace(self, products=None, bank=self.bank.without_columns() if large else self.bank)

    def with_bodies_fixed(self) -> Linearisation:
        """Return the linearisation about the same fit with the bodies fixed there."""
        return Linearisation.of(self.perturbed, with_bodies_held(self.fit), self.bank, self.present, True, self.far)

    @property
    def predicted_cost(self) -> float:
        """Half of chi-square and squared unknowns of the present model at its mode, by the linear model."""
        own = self.fit.own
        constant = float(self.fit.posterior.log_normalisation.sum())
        return constant - GaussianBlock.of(own.T @ own).half_log_det - self.log_nothing

    def mean_amplitudes(self, label: str, names: Sequence[str]) -> Floats:
        """Return the mean amplitudes of one cause beside the others of a set, in the order of its columns."""
        free = [name for name in names if not self.evidence.causes[name].fixed]
        posterior, forms = AmplitudePosterior.of(self.evidence, free), self.evidence.forms(free)
        groups = self.evidence.causes[label].variants[forms[label]].groups
        mean = posterior.mean
        return np.concatenate([mean[posterior.amplitudes[label, group.name]] for group in groups])

    def most_probable_form(self, label: str, names: Sequence[str]) -> Signatures:
        """Return the signatures of the first group of a cause in its most probable form beside the others of a set."""
        form = self.evidence.forms(names)[label]
        group = self.evidence.causes[label].variants[form].groups[0].name
        return next(item for item in self.bank.signatures if item.name == group)


def _amplitudes(present: Mapping[str, Floats], gram: Gram) -> Floats:
    """Return the amplitudes of all columns of a Gram, (m,), from those of some groups; the others have none."""
    found = np.zeros(len(gram.score))
    for name, values in present.items():
        if name in gram.groups:
            found[gram.groups[name]] = values
    return found


@dataclass(frozen=True)
class Remaining:
    """What a set of causes at its most probable scales leaves, for weighing signatures that are in no bank.

    Attributes
    ----------
    residual : (N,) array
        Whitened, at the mode of the model's unknowns and the causes' amplitudes.
    basis : (N, m) array
        Such that the information on further columns ``T`` is ``T'T`` less the products of ``basis' T``.
    """

    residual: Floats
    basis: Floats

    @staticmethod
    def of(point: Linearisation, names: Sequence[str], forms: Mapping[str, int]) -> Remaining:
        """Return what a set of causes leaves.

        Parameters
        ----------
        point : Linearisation
        names : sequence of str
            Causes of the set, generic ones among them.
        forms : mapping of str to int
            Form of each.
        """
        evidence, fit = point.evidence, point.fit
        shift = -_amplitudes(point.present, evidence.gram)  # what the fit holds is no part of the set by that
        for name in names:
            if evidence.causes[name].fixed:
                shift[evidence.gram.groups[evidence.causes[name].groups[0].name]] += 1.0
        chosen, deviations = evidence.most_probable(names, forms)
        scale = np.zeros(len(shift))
        scale[chosen] = deviations
        place = np.full(len(shift), -1)  # of each column of the Gram among those chosen
        place[chosen] = np.arange(len(chosen))
        residual, scaled = fit.residual.copy(), np.zeros((len(fit.residual), len(chosen)))
        first = dict.fromkeys(evidence.gram.groups, 0)
        for item in point.bank.signatures:
            columns = slice(first[item.name], first[item.name] + item.columns.shape[1])
            where, first[item.name] = evidence.gram.groups[item.name][columns], columns.stop
            used = place[where] >= 0
            if not (used.any() or shift[where].any()):
                continue
            own = slice(None) if item.recording is None else rows_of(fit.posterior, item.recording)
            residual[own] += item.columns @ shift[where]
            scaled[own, place[where][used]] = item.columns[:, used] * scale[where][used]
        whole = np.concatenate([fit.own, scaled], axis=1)
        block = GaussianBlock.of(whole.T @ whole)
        basis = block.share(whole.T).T
        pull = np.concatenate([fit.own_coordinates, np.zeros(len(chosen))])
        moved = basis.T @ residual + block.share(pull)
        return Remaining(residual - basis @ moved, basis)

    def gram(self, columns: Floats, name: str) -> Gram:
        """Return the Gram of one group of further columns (N, k) after the set has taken its share."""
        shared = self.basis.T @ columns
        matrix = columns.T @ columns - shared.T @ shared
        return Gram(matrix, columns.T @ self.residual, {name: np.arange(columns.shape[1])})
