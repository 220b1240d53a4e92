"""A kind of cause: what the search has to know of it, in one class; kinds are registered, effects choose theirs.

Most causes are linear in amplitudes that vanish with them (`bayesid.diagnosis.candidates.linear_cause`). One that is
not has forms, such as a frequency or an instant, which its kind lays out on a grid, resolves in Gram space, and hands
to the fit. To add a kind, derive a class, usually from `LinearCause` or `InstantCause`, register an instance of it, and
set its name as ``cause_kind`` of the effects.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound, Quantity
from bayesid.simulation.effects.register import known_effects
from bayesid.simulation.model import Model
from bayesid.simulation.own_effects import check_own_effect

__all__ = ["CauseAmplitude", "CauseKind", "candidates", "cause_kinds", "companies", "kind_of", "register_kind"]

Bounds = Mapping[str, Sequence[PhysicalBound]]
"""Largest plausible sizes of effects, by their labels."""


class CauseAmplitude(NamedTuple):
    """One quantity of a cause, with its mean and standard deviation in the quantity's unit."""

    quantity: Quantity
    mean: float
    sd: float

    @property
    def distance(self) -> float:
        """Distance from zero in standard deviations, infinite for an exact value."""
        return abs(self.mean) / self.sd if self.sd > 0.0 else float("inf")


class CauseKind:
    """What a diagnosis does with causes of one kind. Every method has a default that does nothing.

    The prior of a cause is in its `CandidateCause`: the bounds of its scales, and the shares of its forms.

    Attributes
    ----------
    name : str
        By which effects choose the kind (`Effect.cause_kind`).
    one_form : bool
        Whether its causes have a single form, so that a set of them is fitted in its amplitudes.
    weighed_by_fits : bool
        Whether the evidence of its causes is corrected by fits, since that of their signatures is not good enough.
    linearised_beside : bool
        Whether sets with its causes are linearised about the fit of the others in them.
    summary, advice, statement : str
        Of a cause that is no effect: what it is, which manoeuvre brings it out, and how a study states it.
    """

    name: ClassVar[str]
    one_form: ClassVar[bool] = False
    weighed_by_fits: ClassVar[bool] = False
    linearised_beside: ClassVar[bool] = False
    summary: ClassVar[str] = ""
    advice: ClassVar[str] = ""
    statement: ClassVar[str] = ""

    def of(self, effects: Sequence[Effect]) -> list[Effect]:
        """Return those of some effects that are of this kind."""
        return [effect for effect in effects if effect.cause_kind == self.name]

    def check(self, effect: Effect) -> None:
        """Raise an `InputError` if an effect cannot be weighed."""

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the signatures of the kind's causes about a fit, given its effects and their bounds."""
        return SignatureBank()

    def suggested(self, perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
        """Return signatures that the residual itself suggests, which are no part of the alarm."""
        return SignatureBank()

    def present(self, fit: Fit) -> dict[str, Floats]:
        """Return the amplitudes of the kind's causes at a fit, by the names of their groups."""
        return {}

    def plausible(self, found: SetProbabilities, effects: Sequence[Effect], least: float) -> dict[str, tuple[str, ...]]:
        """Return the causes that are worth a fit, from some least probability, each with its best company."""
        return {}

    def refined(
        self, point: Linearisation, found: SetProbabilities, effects: Sequence[Effect], bounds: Bounds, least: float
    ) -> Linearisation:
        """Return a linear model in which the forms of causes of some least probability are resolved, or the same."""
        return point

    def with_form(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Effect:
        """Return an effect with what a fit takes of its most probable form beside the other causes of a set."""
        return effect

    def starts(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Sequence[Floats]:
        """Return the starting points of the fit of an effect beside the other causes of a set."""
        return effect.starts

    def prepared(self, perturbed: PerturbedModel, z: Floats, names: Sequence[str]) -> tuple[PerturbedModel, Floats]:
        """Return the model that is fitted with some causes, and its starting point (size,)."""
        return perturbed, z

    def labels(self, fit: Fit) -> tuple[str, ...]:
        """Return the names of causes that a fit holds and that are no effects."""
        return ()

    def quantities(self, effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
        """Return the amplitudes by which each cause is listed, in the order of its columns."""
        return {}

    def amplitudes(self, perturbed: PerturbedModel, fit: Fit, label: str) -> list[CauseAmplitude]:
        """Return the size at a fit of a cause that is no effect."""
        return []

    def instants(self, perturbed: PerturbedModel, fit: Fit, label: str) -> list[CauseAmplitude]:
        """Return when a cause acted, one instant ``RECORDING.time`` for each recording in which it did."""
        return []


_REGISTER: dict[str, CauseKind] = {}


def register_kind(kind: CauseKind) -> None:
    """Make a kind of cause known; one of the same name is replaced."""
    _REGISTER[kind.name] = kind


def cause_kinds() -> tuple[CauseKind, ...]:
    """Return all registered kinds, in the order of registration."""
    return tuple(_REGISTER.values())


def kind_of(effect: Effect) -> CauseKind:
    """Return the kind that an effect has chosen, or raise an `InputError` if it is not registered."""
    if effect.cause_kind not in _REGISTER:
        raise InputError(
            f"effect {effect.label!r} is of an unknown kind of cause, {effect.cause_kind!r}",
            file=inspect.getsourcefile(type(effect)),
            remedy=f"Register it with `register_kind`, or choose from {', '.join(_REGISTER)}",
        )
    return _REGISTER[effect.cause_kind]


def companies(found: SetProbabilities, labels: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return causes, each with those of others in the most probable set that holds it and nothing generic."""
    beside = {}
    for label in labels:
        best = next(item for item in found.sets if label in item.causes and item.generic is None)
        beside[label] = tuple(name for name in best.causes if name not in labels)
    return beside


def candidates(
    model: Model, *, knows_latitude: bool = True, records_wheels: bool = False, longest: float | None = None
) -> list[Effect]:
    """Return every effect that the model does not have and that could exist in its situation.

    The class of an effect states where it could exist (`Effect.instances`).

    Parameters
    ----------
    model : Model
    knows_latitude : bool
        Whether the recordings state where on the orbit they were made.
    records_wheels : bool
        Whether the momentum of the wheels is recorded, so that no unrecorded wheel runs.
    longest : float, optional
        Length of the longest recording [s], over which the history of a wheel is resolved.

    Raises
    ------
    InputError
        If a user-defined effect violates the contract of a hook, or has no amplitudes that could be weighed.
    """
    present = {effect.label for effect in model.effects}
    possible = [
        effect.attach(model.robot)
        for effect_class in known_effects().values()
        if knows_latitude or not effect_class.uses_latitude(model.orbit)
        for instance in effect_class.instances(model)
        if (effect := instance.in_study(longest, records_wheels)) is not None and effect.label not in present
    ]
    for effect in possible:
        check_own_effect(effect, model.robot, model.sensors)
        if type(effect).__module__.partition(".")[0] != __name__.partition(".")[0]:  # those of the package are tested
            kind_of(effect).check(effect)
    return possible
