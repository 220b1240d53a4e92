"""Register of the effects that study files name."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from typing import Any, TypeVar

from bayesid._io.errors import InputError
from bayesid.simulation.effects.effect import Effect

__all__ = ["create", "known_effects", "register"]

_REGISTER: dict[str, type[Effect]] = {}

E = TypeVar("E", bound=type[Effect])


def register(effect: E) -> E:
    """Make an effect known to study files by its name; a class decorator."""
    if not effect.name:
        raise InputError(f"effect {effect.__name__} has no name", remedy="Set the class attribute `name`")
    _REGISTER[effect.name] = effect
    return effect


def known_effects() -> dict[str, type[Effect]]:
    """Return all registered effects by their names, in the order of registration."""
    return {member.name: member for effect in _REGISTER.values() for member in effect.members()}


def create(label: str, **options: Any) -> Effect:
    """Return the effect of a label as in study files, such as ``"gravity-gradient"``; options are those of its class.

    Raises
    ------
    InputError
        If no effect of that name is registered, or it cannot be made.
    """
    (name, _, place), known = label.partition(":"), known_effects()
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        remedy = f"Did you mean '{near[0]}'?" if near else f"Choose from {', '.join(sorted(known))}."
        raise InputError(f"unknown effect {label!r}", remedy=f"{remedy} Or name your file under model.plugins")
    build: Callable[..., Effect] = known[name]
    try:
        return build(place, **options) if place else build(**options)
    except InputError:
        raise
    except Exception as error:
        raise InputError(
            f"effect {label!r} cannot be made: {type(error).__name__}: {error}",
            remedy="Give the required place as NAME:PLACE, or correct the effect",
        ) from error
