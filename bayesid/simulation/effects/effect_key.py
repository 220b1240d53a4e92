"""An effect as a key of compiled code: what decides the operations, apart from the numbers that may change freely."""

from __future__ import annotations

from collections.abc import Hashable

from bayesid.simulation.effects.effect import Effect

__all__ = ["EffectKey"]


class EffectKey:
    """An effect, equal to every other whose hooks do the same operations.

    Equal are effects of one class whose attributes are equal, but for the centres and widths of their priors and what
    `Effect.constants` names: those are arguments of the compiled code. An effect with an attribute that cannot be
    hashed equals itself only.
    """

    def __init__(self, effect: Effect) -> None:
        self.effect = effect
        self._key = (type(effect), *_attributes(effect))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, EffectKey) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


def _attributes(effect: Effect) -> tuple[Hashable, ...]:
    free = {"parameters", *effect.constant_names}
    rest = tuple(sorted((name, value) for name, value in vars(effect).items() if name not in free))
    shape = tuple((parameter.name, parameter.unit, parameter.prior) for parameter in effect.parameters)
    try:
        hash(rest)
    except TypeError:
        return (shape, id(effect))
    return (shape, rest)
