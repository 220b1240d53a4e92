"""Linearisation about a fit with the signatures of all kinds of causes, or along the motion that the data show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bayesid._math.arrays import Floats
from bayesid._math.memory import give_back_memory
from bayesid._math.threads import in_threads
from bayesid.diagnosis.candidates.cause_kind import CauseKind, cause_kinds, kind_of
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank, Signatures
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.response.present_fit import follow, with_bodies_held
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound

__all__ = ["Catalogue", "linearise", "linearise_along_data"]


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
    def weighed_by_fits(self) -> list[str]:
        """Labels of the candidates whose evidence takes a fit, such as vibrations."""
        return [effect.label for effect in self.effects if kind_of(effect).weighed_by_fits]


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
    for effect in catalogue.effects:
        kind_of(effect)  # refuse one of an unknown kind

    def signatures(kind: CauseKind) -> SignatureBank:
        return kind.signatures(perturbed, fit, kind.of(catalogue.effects), catalogue.bounds)

    bank = SignatureBank.joined([*in_threads(signatures, cause_kinds()), beside or SignatureBank()])
    give_back_memory()  # of the responses
    present: dict[str, Floats] = {}
    for kind in cause_kinds():
        present |= kind.present(fit)
    where = with_bodies_held(fit) if bodies_fixed else fit
    return Linearisation.of(perturbed, where, bank, present, bodies_fixed, far)


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
