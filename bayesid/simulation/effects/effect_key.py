"""Key of compiled code for an effect, which depends on its operations and not on its numbers."""

from __future__ import annotations

from collections.abc import Hashable

from bayesid.simulation.effects.effect import Effect

__all__ = ["EffectKey"]


class EffectKey:
    """Key of an effect, equal to that of every other effect whose hooks do the same operations.

    Effects of one class have equal keys if their attributes are equal, apart from the centres and widths of their
    priors and the attributes that `Effect.constant_names` lists, which are arguments of the compiled code. The key of
    an effect with an attribute that cannot be hashed equals only a key of the same object.
    """

    def __init__(self, effect: Effect) -> None:
        self.effect = effect
        attributes = _attributes(effect)
        self._portable = attributes is not None
        self._key = (type(effect), *(attributes or (id(effect),)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, EffectKey) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)

    def description(self) -> tuple[object, ...] | None:
        """Return what the key is made of, None where that has a meaning in this process alone."""
        return self._key if self._portable else None


def _attributes(effect: Effect) -> tuple[Hashable, ...] | None:
    """Return what decides the operations of an effect, None if an attribute cannot be hashed."""
    free = {"parameters", *effect.constant_names}
    rest = tuple(sorted((name, value) for name, value in vars(effect).items() if name not in free))
    shape = tuple((parameter.name, parameter.unit, parameter.prior) for parameter in effect.parameters)
    try:
        hash(rest)
    except TypeError:
        return None
    return (shape, rest)
