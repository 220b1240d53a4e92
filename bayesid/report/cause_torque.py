"""Torque of the named causes about the centre of mass along the motion of a fit."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.diagnosis import Hypothesis
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Instant

__all__ = ["cause_torque"]


def cause_torque(hypothesis: Hypothesis) -> list[Floats] | None:
    """Return the torque of all causes that act by a force, a torque or a momentum, (S, 3) for each recording [N m].

    A momentum ``h`` relative to the base acts on it with ``-(h' + w x h)``. Causes with inner states, vibrations and
    changes of bodies are left out.

    Returns
    -------
    list of (S, 3) arrays or None
        In base axes, at the instants of `DisturbingWrench`; None where no cause acts in one of these ways.
    """
    fit = hypothesis.fit
    acting = [index for index, effect in enumerate(fit.effects) if _acts(effect)]
    if not acting:
        return None
    node = jax.tree.map(on_device, fit.operating.node)
    total = np.zeros(np.shape(node.rate))
    for index in acting:
        values = on_device(fit.values(index))
        values = jnp.broadcast_to(values, (len(total), values.shape[-1]))
        over_time = jax.vmap(_torque_of(fit.effects[index]), in_axes=(None, 0))
        total = total + np.asarray(jax.vmap(over_time)(values, node))
    times = np.asarray(node.environment.time)
    return [own[np.concatenate([[True], np.diff(time) > 0.0])] for own, time in zip(total, times, strict=True)]


def _acts(effect: Effect) -> bool:
    return (effect.uses("wrench") or effect.uses("momentum")) and not (effect.states or effect.modes_count)


def _torque_of(effect: Effect) -> Callable[[Array, Instant], Array]:
    def torque(values: Array, instant: Instant) -> Array:
        inner = jnp.zeros(0)
        wrench = effect.wrench(values, instant, inner)
        held, change = effect.momentum(values, instant._replace(rate=jnp.zeros(3)), inner)
        outer = wrench.torque - jnp.cross(instant.body.com, wrench.force)
        return outer - change - jnp.cross(instant.rate, held)

    return torque
