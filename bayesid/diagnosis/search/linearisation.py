"""The model linearised about a fit: bank of signatures, its Gram, and the evidence of every set of causes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.memory import give_back_memory
from bayesid._math.threads import in_threads
from bayesid.diagnosis.candidates.catalogue_signatures import catalogue_signatures, group_names
from bayesid.diagnosis.candidates.generic_signatures import generic_signatures
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE, initial_rate_signatures
from bayesid.diagnosis.candidates.mass_shift_signatures import mass_shift_signatures
from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.candidates.signature_products import SignatureProducts
from bayesid.diagnosis.candidates.vibration_signatures import vibration_signatures
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.response.followed_motion import follow
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.response.present_fit import with_bodies_held
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.residual_view import rows_of
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound

__all__ = ["Catalogue", "Linearisation", "Remaining", "linearise", "linearise_along_data"]


@dataclass(frozen=True)
class Catalogue:
    """Causes that a diagnosis considers.

    Attributes
    ----------
    effects : tuple of Effect
        Candidates, attached to the model's robot.
    bounds : mapping of str to sequence of PhysicalBound
        Largest plausible sizes of each candidate, by its label.
    prior : CausePrior
        Of the number of causes, and of something generic.
    settings : DiagnosisSettings
        By which the search among them decides.
    """

    effects: tuple[Effect, ...]
    bounds: Mapping[str, Sequence[PhysicalBound]]
    prior: CausePrior
    settings: DiagnosisSettings = DEFAULT_SETTINGS

    @property
    def vibrations(self) -> list[str]:
        """Labels of the hidden vibrations."""
        return [effect.label for effect in self.effects if effect.modes_count]


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
    products: SignatureProducts | None
    bodies_fixed: bool = False
    far: bool = False

    @staticmethod
    def of(
        perturbed: PerturbedModel,
        fit: Fit,
        bank: SignatureBank,
        bodies_fixed: bool,
        far: bool,
        products: SignatureProducts | None = None,
        evidence: SetEvidence | None = None,
    ) -> Linearisation:
        """Return the linear model of a bank of signatures about a fit.

        Where the fit holds effects, their amplitudes there are not zero. The likelihood is quadratic about them, and
        the linear terms that this leaves at zero belong to the score: with ``a`` the amplitudes at the fit, the score
        is ``g - A a``, and the evidence of nothing holds ``g'a - a'A a / 2``.

        Parameters
        ----------
        perturbed, fit, bank, bodies_fixed, far
            As the attributes.
        products : SignatureProducts, optional
            Of a bank about the same fit that differs little.
        evidence : SetEvidence, optional
            Likewise.
        """
        products = SignatureProducts.of(bank.signatures, fit, products)
        gram = products.gram()
        amplitudes = _amplitudes_at(fit, gram)
        unknowns, z = GaussianBlock.of(fit.own.T @ fit.own), fit.own_coordinates
        moved = unknowns.share(fit.own.T @ fit.residual + z)
        cost = 0.5 * float(fit.residual @ fit.residual + z @ z - moved @ moved)
        constant = float(fit.posterior.log_normalisation.sum()) - unknowns.half_log_det
        taken = gram.matrix @ amplitudes
        log_nothing = constant - cost + float(gram.score @ amplitudes - 0.5 * amplitudes @ taken)
        gram = replace(gram, score=gram.score - taken)
        weighed = SetEvidence(gram, bank.causes, evidence)
        return Linearisation(perturbed, fit, bank, weighed, log_nothing, products, bodies_fixed, far)

    def with_bank(self, bank: SignatureBank) -> Linearisation:
        """Return the linearisation with another bank about the same fit."""
        return Linearisation.of(
            self.perturbed, self.fit, bank, self.bodies_fixed, self.far, self.products, self.evidence
        )

    def without_products(self) -> Linearisation:
        """Return the linearisation without the products, which take as much memory as the Gram."""
        return replace(self, products=None)

    def with_bodies_fixed(self) -> Linearisation:
        """Return the linearisation about the same fit with the bodies fixed there."""
        return Linearisation.of(self.perturbed, with_bodies_held(self.fit), self.bank, True, self.far)

    @property
    def predicted_cost(self) -> float:
        """Half of chi-square and squared unknowns of the present model at its mode, by the linear model."""
        own = self.fit.own
        constant = float(self.fit.posterior.log_normalisation.sum())
        return constant - GaussianBlock.of(own.T @ own).half_log_det - self.log_nothing


def linearise(
    perturbed: PerturbedModel,
    fit: Fit,
    catalogue: Catalogue,
    *,
    bodies_fixed: bool = False,
    far: bool = False,
    beside: SignatureBank | None = None,
) -> Linearisation:
    """Linearise the model and all candidates about a fit.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
    catalogue : Catalogue
    bodies_fixed : bool
        Whether the bodies stay where the fit has them. A body of another size would make up for the lack of a large
        cause in the linear model, and only there.
    far : bool
        Whether the present model's own fit diverged.
    beside : SignatureBank, optional
        Further signatures, such as those of what the fit holds beside the candidates.
    """
    effects, bounds = catalogue.effects, catalogue.bounds
    parts: list[Callable[[], SignatureBank]] = [
        lambda: catalogue_signatures(perturbed, fit, effects, bounds),
        lambda: initial_rate_signatures(perturbed, fit),
        lambda: vibration_signatures(perturbed, fit, effects, bounds),
        lambda: mass_shift_signatures(perturbed, fit, effects, bounds),
        lambda: generic_signatures(perturbed, fit),
    ]
    bank = SignatureBank.joined([*in_threads(lambda part: part(), parts), beside or SignatureBank()])
    give_back_memory()  # of the responses
    return Linearisation.of(perturbed, with_bodies_held(fit) if bodies_fixed else fit, bank, bodies_fixed, far)


def linearise_along_data(perturbed: PerturbedModel, catalogue: Catalogue) -> Linearisation:
    """Linearise the model and all candidates about the motion that the data show, bodies fixed at their prior's centre.

    Parameters
    ----------
    perturbed : PerturbedModel
    catalogue : Catalogue
    """
    fit = follow(perturbed)
    (torque,) = fit.effects
    columns = fit.added[0] / torque.parameters[0].sigma
    beside = SignatureBank((Signatures(torque.label, columns),))
    return linearise(perturbed, fit, catalogue, bodies_fixed=True, far=True, beside=beside)


def _amplitudes_at(fit: Fit, gram: Gram) -> Floats:
    """Return the amplitudes of all columns of the Gram at a fit, shape (m,)."""
    amplitudes = np.zeros(len(gram.score))
    if INITIAL_RATE in gram.groups:
        amplitudes[gram.groups[INITIAL_RATE]] = fit.posterior.unknowns.rate_sigma * fit.z[fit.frozen]
    for index, effect in enumerate(fit.effects):
        names = group_names(effect)
        if not effect.parameters:
            amplitudes[gram.groups[effect.label]] = 1.0
            continue
        values = fit.values(index).ravel()
        units = np.resize([parameter.unit for parameter in effect.parameters], len(values))
        for name in dict.fromkeys(names.values()):
            columns = np.isin(units, [unit for unit, other in names.items() if other == name])
            amplitudes[gram.groups[name]] += values[columns]
    return amplitudes


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
        shift = -_amplitudes_at(fit, evidence.gram)  # the fit may hold effects, which are no part of the set by that
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
