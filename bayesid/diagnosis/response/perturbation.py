"""What an effect does along a given motion: pushes on a model that does not contain it.

An effect's own hooks are evaluated along the motion that the present fit gives, so that one compiled simulation, which
takes tables, wrenches and readings as arguments, serves every candidate.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid._math.kept_jit import kept_jit
from bayesid._math.runge_kutta import runge_kutta_step
from bayesid.diagnosis.response.hidden_vibration import Vibration
from bayesid.inference.perturbed_posterior import Perturbation
from bayesid.inference.posterior import Posterior
from bayesid.robot.composite_tables import ENTRIES, WIDTH
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Instant, Readings
from bayesid.simulation.sensors import SensorKind
from bayesid.simulation.simulator import EffectKey

__all__ = [
    "OperatingTrajectory",
    "coordinates_shape",
    "linear_perturbation",
    "operating_trajectory_of",
    "perturb",
    "physical",
    "report_of",
    "report_slopes",
    "tables_of",
]

DIFFERENCE = 1e-3
"""Step of central differences in the coordinates of vibrations, in prior standard deviations."""


class OperatingTrajectory(NamedTuple):
    """The motion that effects are evaluated on, of all recordings; shapes as in `Perturbation`."""

    posterior: Posterior
    node: Instant
    sample: Instant
    readings: Readings
    vibration: Vibration


class Table(NamedTuple):
    """An effect's `Effect.table` at the stages (R, S, 28, m) and samples (R, T, 28, m)."""

    node: Floats
    sample: Floats

    @property
    def nbytes(self) -> int:
        """Memory [bytes]."""
        return self.node.nbytes + self.sample.nbytes


def operating_trajectory_of(
    posterior: Posterior, node: Instant, sample: Instant, readings: Readings
) -> OperatingTrajectory:
    """Collect what effects are evaluated on."""
    return OperatingTrajectory(posterior, node, sample, readings, Vibration.along(node, sample))


def coordinates_shape(effect: Effect, recordings: int) -> tuple[int, ...]:
    """Shape of an effect's coordinates: (n,), or (R, n) where every recording has its own."""
    count = len(effect.parameters)
    return (recordings, count) if effect.per_recording else (count,)


def tables_of(effect: Effect, posterior: Posterior) -> Table:
    """Evaluate an effect's table over the recordings of a posterior."""
    grid = posterior.data.arrays.grid
    times = [np.asarray(side.environment.time) for side in (grid.node, grid.sample)]
    both = np.concatenate(times, axis=1)  # what a recording needs whatever the instants is computed once
    robot, motions = posterior.model.robot, [manoeuvre.motion for manoeuvre in posterior.manoeuvres]
    tables = [effect.in_recording(r).table(robot, motion, both[r]) for r, motion in enumerate(motions)]
    node, sample = np.split(np.stack(tables), [times[0].shape[1]], axis=1)
    return Table(node, sample)


def perturb(effect: Effect, coordinates: Floats, operating: OperatingTrajectory, table: Table | None) -> Perturbation:
    """Return the push of one effect at some coordinates, flat."""
    shaped = np.reshape(coordinates, coordinates_shape(effect, _recordings(operating)))
    perturbation = _nothing(operating)
    if _acts(effect):
        hooks = _evaluate(*_given(effect, operating), shaped.ravel(), *operating[1:4], _steps(operating))
        perturbation = perturbation._replace(**{key: np.asarray(value) for key, value in hooks.items()})
    if table is not None:
        loads = loads_of(effect, shaped)
        perturbation = perturbation._replace(
            node_rows=perturbation.node_rows + table.node @ loads,
            sample_rows=perturbation.sample_rows + table.sample @ loads,
        )
    if effect.modes_count:
        node, sample = operating.vibration.rows(effect, physical(effect, shaped)[None])
        perturbation = perturbation._replace(
            node_rows=perturbation.node_rows + node[0], sample_rows=perturbation.sample_rows + sample[0]
        )
    return perturbation


def linear_perturbation(
    effect: Effect, coordinates: Floats, operating: OperatingTrajectory, table: Table | None
) -> Perturbation:
    """Return the derivatives of `perturb` in the coordinates, leading axis n.

    Where each recording has n coordinates of its own, it is perturbed by these alone, all recordings at once: they are
    independent given the model's unknowns.
    """
    if not effect.parameters:  # the amplitude of what is either there or not
        return jax.tree.map(lambda x: x[None], perturb(effect, coordinates, operating, table))
    if effect.modes_count:
        steps = DIFFERENCE * np.concatenate([np.eye(len(coordinates)), -np.eye(len(coordinates))])
        values = physical(effect, coordinates + steps)
        count = len(coordinates)
        rows = [(part[:count] - part[count:]) / (2.0 * DIFFERENCE) for part in operating.vibration.rows(effect, values)]
        return _nothing(operating, (count,))._replace(node_rows=rows[0], sample_rows=rows[1])
    slopes = _nothing(operating, (len(effect.parameters),))
    if _acts(effect):
        hooks = _differentiate(*_given(effect, operating), coordinates, *operating[1:4], _steps(operating))
        slopes = slopes._replace(**{key: np.moveaxis(np.asarray(value), -1, 0) for key, value in hooks.items()})
    if table is not None:
        loads = load_slopes(effect, np.reshape(coordinates, coordinates_shape(effect, _recordings(operating))))
        loads = loads.reshape(len(loads), -1).T
        slopes = slopes._replace(
            node_rows=slopes.node_rows + np.einsum("rsdm,nm->nrsd", table.node, loads),
            sample_rows=slopes.sample_rows + np.einsum("rsdm,nm->nrsd", table.sample, loads),
        )
    return slopes


def _recordings(operating: OperatingTrajectory) -> int:
    return int(operating.node.rate.shape[0])


def _nothing(operating: OperatingTrajectory, lead: Sequence[int] = ()) -> Perturbation:
    posterior = operating.posterior
    recordings, nodes = operating.node.rate.shape[:2]
    samples = operating.sample.rate.shape[1]
    channels = posterior.data.arrays.offset.shape[-1]
    return Perturbation(
        np.zeros((*lead, recordings, nodes, WIDTH)),
        np.zeros((*lead, recordings, samples, WIDTH)),
        np.zeros((*lead, recordings, nodes, 6)),
        np.zeros((*lead, recordings, samples, 6)),
        np.zeros((*lead, recordings, samples, channels)),
    )


class _Given(NamedTuple):
    """Numbers that the compiled hooks of an effect take.

    prior of the effect, with its constants; rotation (K, 3, 3), sensor to base axes, and point (K, 3) of every sensor.
    """

    prior: PriorConstants
    rotation: Floats
    point: Floats


def _given(effect: Effect, operating: OperatingTrajectory) -> tuple[EffectKey, tuple[SensorKind, ...], _Given]:
    sensors = operating.posterior.model.sensors
    given = _Given(
        PriorConstants.of(effect),
        np.stack([sensor.rotation for sensor in sensors]),
        np.stack([np.asarray(sensor.position, dtype=float) for sensor in sensors]),
    )
    return EffectKey(effect), operating.posterior.model.channels.kinds, given


def _steps(operating: OperatingTrajectory) -> Array:
    return operating.posterior.data.arrays.grid.step


def _acts(effect: Effect) -> bool:
    """Whether the effect has hooks that act along the motion."""
    return any(effect.uses(hook) for hook in ("momentum", "wrench", "specific_force", "read"))


def _hooks(
    key: EffectKey,
    kinds: tuple[SensorKind, ...],
    given: _Given,
    coordinates: Array,
    node: Instant,
    sample: Instant,
    readings: Readings,
    step: Array,
) -> dict[str, Array]:
    """Return the parts of the perturbation that an effect's hooks make, by name."""
    effect = key.effect.bound(given.prior.constants)
    shaped = coordinates.reshape(coordinates_shape(effect, len(step)))
    values = traced_physical(effect, given.prior, shaped)
    axis = 0 if effect.per_recording else None
    moments = (node, sample)
    if effect.states:
        states = jax.vmap(partial(_inner_states, effect), (axis, 0, 0))(values, node, step)
        inner = [states, _at_samples(states, node.environment.time, sample.environment.time)]
    else:
        inner = [jnp.zeros((*instant.rate.shape[:2], 0)) for instant in moments]
    each = (axis, 0, 0)
    parts: dict[str, Array] = {}
    if effect.uses("momentum"):
        hook = jax.vmap(jax.vmap(effect.momentum, (None, 0, 0)), each)
        rows = [_couple(*hook(values, m, i)) for m, i in zip(moments, inner, strict=True)]
        parts |= {"node_rows": rows[0], "sample_rows": rows[1]}
    if effect.uses("wrench"):
        hook = jax.vmap(jax.vmap(effect.wrench, (None, 0, 0)), each)
        wrenches = [jnp.concatenate(hook(values, m, i), axis=-1) for m, i in zip(moments, inner, strict=True)]
        parts |= {"node_wrench": wrenches[0], "sample_wrench": wrenches[1]}
    if effect.uses("read") or effect.uses("specific_force"):
        parts["reading"] = _reading(effect, kinds, given, values, sample, readings, axis)
    return parts


def _reading(
    effect: Effect,
    kinds: tuple[SensorKind, ...],
    given: _Given,
    values: Array,
    sample: Instant,
    readings: Readings,
    axis: int | None,
) -> Array:
    """Return what the effect adds to the readings, shape (R, T, C), sensor axes."""
    parts = []
    faulty = jax.vmap(effect.read, (axis, 0))(values, readings) if effect.uses("read") else readings
    for index, kind in enumerate(kinds):
        added = jax.vmap(jax.vmap(kind.residual))(faulty.channels[kind.value], readings.channels[kind.value])
        if kind.feels_force and effect.uses("specific_force"):
            lever = given.point[index] - sample.body.com
            force = jax.vmap(jax.vmap(effect.specific_force, (None, 0, 0)), (axis, 0, 0))
            added = added + force(values, sample, lever) @ given.rotation[index]
        parts.append(added)
    return jnp.concatenate(parts, axis=-1)


_evaluate = kept_jit(static=2)(_hooks)


@kept_jit(static=2)
def _differentiate(
    key: EffectKey, kinds: tuple[SensorKind, ...], given: _Given, coordinates: Array, *motion: Any
) -> dict[str, Array]:
    """Return the derivatives of `_hooks` in a shift of the coordinates that is common to all recordings."""
    count = len(given.prior.mean)

    def shifted(shift: Array) -> dict[str, Array]:
        return _hooks(key, kinds, given, (coordinates.reshape(-1, count) + shift).ravel(), *motion)

    return jax.jacfwd(shifted)(jnp.zeros(count))


def _couple(momentum: Array, rate: Array) -> Array:
    rows = jnp.zeros((*momentum.shape[:-1], WIDTH))
    return rows.at[..., ENTRIES["spin"]].set(momentum).at[..., ENTRIES["spin_rate"]].set(rate)


def _inner_states(effect: Effect, values: Array, node: Instant, step: Array) -> Array:
    """Integrate an effect's own states along the stages of one recording, shape (S, states)."""
    first, middle, last = (
        jax.tree.map(lambda x, s=s: x[s], node) for s in (slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2))
    )

    def advance(state: Array, given: Any) -> tuple[Array, tuple[Array, Array]]:
        size, *instants = given
        new, k1, k4 = runge_kutta_step(lambda s, at: effect.derivative(values, at, s), state, size, *instants)
        return new, (state, 0.5 * (state + new) + 0.125 * size * (k1 - k4))

    final, (nodes, middles) = jax.lax.scan(advance, jnp.zeros(effect.states), (step, first, middle, last))
    both = jnp.stack([nodes, middles], axis=1).reshape(-1, effect.states)
    return jnp.concatenate([both, final[None]])


def _at_samples(inner: Array, times: Array, wanted: Array) -> Array:
    columns = jax.vmap(jax.vmap(jnp.interp, (None, None, 1), 1))
    return columns(wanted, times, inner)


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
