"""What depends on the coordinates of an effect alone, compiled once per effect: loads and what is reported."""

from __future__ import annotations

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid._math.kept_jit import kept_jit
from bayesid.simulation.effects.effect import Effect, Quantity
from bayesid.simulation.simulator import EffectKey

__all__ = [
    "CauseAmplitude",
    "PriorConstants",
    "load_slopes",
    "loads_of",
    "physical",
    "report_of",
    "report_slopes",
    "traced_physical",
]


class CauseAmplitude(NamedTuple):
    """One quantity of a cause, with its mean and standard deviation in the quantity's unit."""

    quantity: Quantity
    mean: float
    sd: float

    @property
    def distance(self) -> float:
        """Distance from zero in standard deviations, infinite for an exact value."""
        return abs(self.mean) / self.sd if self.sd > 0.0 else float("inf")


class PriorConstants(NamedTuple):
    """Numbers of an effect that compiled functions take: its constants, and mean and sigma (n,) of its priors."""

    constants: tuple[Any, ...]
    mean: Floats
    sigma: Floats

    @classmethod
    def of(cls, effect: Effect) -> PriorConstants:
        """Return those of an effect."""
        return cls(
            effect.constants,
            np.array([parameter.mean for parameter in effect.parameters]),
            np.array([parameter.sigma for parameter in effect.parameters]),
        )


def physical(effect: Effect, coordinates: Traceable) -> Traceable:
    """Return the physical values of coordinates with a standard-normal prior, shape (..., n)."""
    if not effect.parameters:
        return coordinates
    columns = [parameter.value(coordinates[..., k]) for k, parameter in enumerate(effect.parameters)]
    return namespace(coordinates).stack(columns, axis=-1)


def traced_physical(effect: Effect, given: PriorConstants, coordinates: Array) -> Array:
    """Return the physical values where means and sigmas are arguments of the compiled code."""
    columns = [
        parameter.prior.physical(given.mean[k], given.sigma[k], coordinates[..., k])
        for k, parameter in enumerate(effect.parameters)
    ]
    return jnp.stack(columns, axis=-1) if columns else coordinates


def loads_of(effect: Effect, coordinates: Floats) -> Floats:
    """Return `Effect.loads` at some coordinates (n,), shape (m,)."""
    return np.asarray(_loads(EffectKey(effect), PriorConstants.of(effect), coordinates))


def load_slopes(effect: Effect, coordinates: Floats) -> Floats:
    """Return the derivatives of `Effect.loads` in the coordinates (n,), shape (m, n)."""
    return np.asarray(_load_slopes(EffectKey(effect), PriorConstants.of(effect), coordinates))


def report_of(effect: Effect, coordinates: Floats) -> Floats:
    """Return `Effect.report` at some coordinates (n,), shape (q,)."""
    return np.asarray(_report(EffectKey(effect), PriorConstants.of(effect), coordinates))


def report_slopes(effect: Effect, coordinates: Floats) -> Floats:
    """Return the derivatives of `Effect.report` in the coordinates (n,), shape (q, n)."""
    return np.asarray(_report_slopes(EffectKey(effect), PriorConstants.of(effect), coordinates))


@kept_jit(static=1)
def _loads(key: EffectKey, given: PriorConstants, coordinates: Array) -> Array:
    effect = key.effect.bound(given.constants)
    return effect.loads(traced_physical(effect, given, coordinates))


@kept_jit(static=1)
def _load_slopes(key: EffectKey, given: PriorConstants, coordinates: Array) -> Array:
    return jax.jacfwd(lambda c: _loads(key, given, c))(coordinates)


@kept_jit(static=1)
def _report(key: EffectKey, given: PriorConstants, coordinates: Array) -> Array:
    effect = key.effect.bound(given.constants)
    return effect.report(traced_physical(effect, given, coordinates))


@kept_jit(static=1)
def _report_slopes(key: EffectKey, given: PriorConstants, coordinates: Array) -> Array:
    return jax.jacfwd(lambda c: _report(key, given, c))(coordinates)
