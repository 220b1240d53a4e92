"""Torque of the named causes over time, and the spectrum of a reconstructed one."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid._math.double_precision import in_double_precision
from bayesid._math.on_device import on_device
from bayesid.diagnosis.outcome.disturbance import WAVES, DisturbingWrench, Frame
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Instant

__all__ = ["torque_of_causes", "torque_spectrum"]


@in_double_precision
def torque_of_causes(hypothesis: Hypothesis) -> list[Floats] | None:
    """Return the torque of all causes that act by a force, a torque or a momentum, (S, 3) for each recording [N m].

    A momentum ``h`` relative to the base acts on it with ``-(h' + w x h)``. Causes with inner states, vibrations and
    changes of bodies are left out.

    Returns
    -------
    list of (S, 3) arrays or None
        In base axes, at the instants of the reconstructed disturbance; None where no cause acts in one of these ways.
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
    return [torque[np.concatenate([[True], np.diff(time) > 0.0])] for torque, time in zip(total, times, strict=True)]


def _acts(effect: Effect) -> bool:
    return (effect.uses("wrench") or effect.uses("momentum")) and not (effect.states or effect.modes_count)


def _torque_of(effect: Effect) -> Callable[[Array, Instant], Array]:
    def torque(values: Array, instant: Instant) -> Array:
        inner = jnp.zeros(0)
        wrench = effect.wrench(values, instant, inner)
        momentum, change = effect.momentum(values, instant._replace(rate=jnp.zeros(3)), inner)
        outer = wrench.torque - jnp.cross(instant.body.com, wrench.force)
        return outer - change - jnp.cross(instant.rate, momentum)

    return torque


def torque_spectrum(wrench: DisturbingWrench, index: int) -> tuple[Floats, Floats]:
    """Return frequencies [Hz], as far as resolved, and amplitudes [N m] of one recording's torque about its mean.

    Parameters
    ----------
    wrench : DisturbingWrench
    index : int
        Index of the recording.

    Returns
    -------
    frequency : (n,) array
    amplitude : (n, 3) array
    """
    time, torque = wrench.time[index], wrench.torque[Frame.BASE][index]
    uniform = np.linspace(time[0], time[-1], len(time))
    even = np.stack([np.interp(uniform, time, column) for column in torque.T], axis=1)
    amplitude = 2.0 * np.abs(np.fft.rfft(even - even.mean(axis=0), axis=0)) / len(even)
    frequency = np.fft.rfftfreq(len(even), float(uniform[1] - uniform[0]))
    resolved = (frequency > 0.0) & (frequency <= 0.5 * WAVES / float(np.ptp(time)))
    return np.asarray(frequency[resolved], dtype=float), np.asarray(amplitude[resolved], dtype=float)
