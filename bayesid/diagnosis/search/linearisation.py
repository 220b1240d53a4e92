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
from bayesid.diagnosis.candidates.signature_bank import SignatureBank
from bayesid.diagnosis.candidates.signature_products import SignatureProducts
from bayesid.diagnosis.candidates.vibration_signatures import vibration_signatures
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.response.present_fit import with_bodies_held
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["Linearisation", "amplitudes_at", "linearise"]


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
        Of all signatures of the bank, while banks that differ little from it are still wanted.
    held : bool
        Whether the bodies are held where the fit has them, since the present model's own fit diverged.
    far : bool
        Whether the present model's own fit diverged, so that fits find the data from the motion here alone.
    """

    perturbed: PerturbedModel
    fit: Fit
    bank: SignatureBank
    evidence: SetEvidence
    log_nothing: float
    products: SignatureProducts | None
    held: bool = False
    far: bool = False

    def with_bank(self, bank: SignatureBank) -> Linearisation:
        """Return the linearisation with another bank about the same fit."""
        return _assembled(self.perturbed, self.fit, bank, self.held, self.far, self.products, self.evidence)

    def without_products(self) -> Linearisation:
        """Return the linearisation without the products, which take as much memory as the Gram."""
        return replace(self, products=None)

    def holding_bodies(self) -> Linearisation:
        """Return the linearisation about the same fit with the bodies held there."""
        return _assembled(self.perturbed, with_bodies_held(self.fit), self.bank, True, self.far)


def linearise(
    perturbed: PerturbedModel,
    fit: Fit,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    *,
    held: bool = False,
    far: bool = False,
    beside: SignatureBank | None = None,
) -> Linearisation:
    """Linearise the model and all candidates about a fit.

    Where the fit holds effects, their amplitudes there are not zero. The likelihood is quadratic about them, and the
    linear terms that this leaves at zero belong to the score: with ``a`` the amplitudes at the fit, the score is
    ``g - A a``, and the evidence of nothing holds ``g'a - a'A a / 2``.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
    effects : sequence of Effect
        Candidates of the catalogue.
    bounds : mapping of str to sequence of PhysicalBound
        Of each candidate, by its label.
    held : bool
        Whether the bodies stay where the fit has them. A body of another size would make up for the lack of a large
        cause in the linear model, and only there.
    far : bool
        Whether the present model's own fit diverged.
    beside : SignatureBank, optional
        Further signatures, such as those of what the fit holds beside the candidates.
    """
    parts: list[Callable[[], SignatureBank]] = [
        lambda: catalogue_signatures(perturbed, fit, effects, bounds),
        lambda: initial_rate_signatures(perturbed, fit),
        lambda: vibration_signatures(perturbed, fit, effects, bounds),
        lambda: mass_shift_signatures(perturbed, fit, effects, bounds),
        lambda: generic_signatures(perturbed, fit),
    ]
    bank = SignatureBank.joined([*in_threads(lambda part: part(), parts), beside or SignatureBank()])
    give_back_memory()  # of the responses
    return _assembled(perturbed, with_bodies_held(fit) if held else fit, bank, held, far)


def _assembled(
    perturbed: PerturbedModel,
    fit: Fit,
    bank: SignatureBank,
    held: bool,
    far: bool,
    products: SignatureProducts | None = None,
    evidence: SetEvidence | None = None,
) -> Linearisation:
    products = SignatureProducts.of(bank.signatures, fit, products)
    gram = products.gram()
    amplitudes = amplitudes_at(fit, gram)
    unknowns = GaussianBlock.of(fit.own.T @ fit.own)
    moved = unknowns.share(fit.own.T @ fit.residual + fit.own_coordinates)
    z = fit.own_coordinates
    cost = 0.5 * float(fit.residual @ fit.residual + z @ z - moved @ moved)
    constant = float(fit.posterior.log_normalisation.sum()) - unknowns.half_log_det
    taken = gram.matrix @ amplitudes
    log_nothing = constant - cost + float(gram.score @ amplitudes - 0.5 * amplitudes @ taken)
    gram = replace(gram, score=gram.score - taken)
    return Linearisation(
        perturbed, fit, bank, SetEvidence(gram, bank.causes, evidence), log_nothing, products, held, far
    )


def amplitudes_at(fit: Fit, gram: Gram) -> Floats:
    """Return the amplitudes of all columns of the Gram at a fit, shape (m,)."""
    found = np.zeros(len(gram.score))
    if INITIAL_RATE in gram.groups:
        found[gram.groups[INITIAL_RATE]] = fit.posterior.unknowns.rate_sigma * fit.z[fit.frozen]
    for index, effect in enumerate(fit.effects):
        names = group_names(effect)
        if not effect.parameters:
            found[gram.groups[effect.label]] = 1.0
            continue
        values = fit.values(index).ravel()
        units = np.resize([parameter.unit for parameter in effect.parameters], len(values))
        for name in dict.fromkeys(names.values()):
            own = np.isin(units, [unit for unit, other in names.items() if other == name])
            found[gram.groups[name]] += values[own]
    return found
