"""What an effect does along a given motion: pushes on a model that does not contain it.

An effect's own hooks are evaluated along the motion that the present fit gives, so that one compiled simulation, which
takes tables, wrenches and readings as arguments, serves every candidate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.diagnosis.hidden_vibration import Vibration
from bayesid.inference.posterior import Posterior, Push
from bayesid.robot.composite_tables import ENTRIES, WIDTH
from bayesid.simulation.effects.effect import Effect, Moment, Readings
from bayesid.simulation.sensors import Kind

__all__ = ["Situation", "coordinates_shape", "drive", "linear_drive", "physical", "situation_of"]

DIFFERENCE = 1e-3
"""Step of central differences in the coordinates of vibrations, in prior standard deviations."""


class Situation(NamedTuple):
    """The motion that effects are evaluated on, of all recordings; shapes as in `Push`."""

    posterior: Posterior
    stage: Moment
    sample: Moment
    readings: Readings
    vibration: Vibration


class Table(NamedTuple):
    """An effect's `Effect.table` at the stages (R, S, 28, m) and samples (R, T, 28, m)."""

    stage: Floats
    sample: Floats


def situation_of(posterior: Posterior, stage: Moment, sample: Moment, readings: Readings) -> Situation:
    """Collect what effects are evaluated on."""
    steps = np.asarray(posterior.data.grid.step)
    return Situation(posterior, stage, sample, readings, Vibration.along(stage, sample, steps))


def coordinates_shape(effect: Effect, recordings: int) -> tuple[int, ...]:
    """Shape of an effect's coordinates: (n,), or (R, n) where every recording has its own."""
    count = len(effect.parameters)
    return (recordings, count) if effect.per_recording else (count,)


def physical(effect: Effect, coordinates: Array) -> Array:
    """Physical values of coordinates with a standard-normal prior, shape (..., n)."""
    if not effect.parameters:
        return coordinates
    columns = [parameter.value(coordinates[..., k]) for k, parameter in enumerate(effect.parameters)]
    return jnp.stack(columns, axis=-1)


def tables_of(effect: Effect, posterior: Posterior) -> Table:
    """Evaluate an effect's table over the recordings of a posterior."""
    grid = posterior.data.grid

    def over(times: Array) -> Floats:
        pairs = zip(posterior.manoeuvres, np.asarray(times), strict=True)
        return np.stack([effect.table(posterior.model.robot, manoeuvre.motion, own) for manoeuvre, own in pairs])

    return Table(over(grid.stage.environment.time), over(grid.sample.environment.time))


def drive(effect: Effect, coordinates: Floats, situation: Situation, table: Table | None) -> Push:
    """Return the push of one effect at some coordinates, flat."""
    shaped = jnp.asarray(coordinates).reshape(coordinates_shape(effect, _recordings(situation)))
    push = _nothing(situation)
    if _acts(effect):
        hooks = _evaluate(_Alike(effect), _setting(situation))(shaped.ravel(), *situation[1:4], _steps(situation))
        push = push._replace(**{key: np.asarray(value) for key, value in hooks.items()})
    if table is not None:
        loads = np.asarray(effect.loads(physical(effect, shaped)))
        push = push._replace(
            stage_rows=push.stage_rows + table.stage @ loads, sample_rows=push.sample_rows + table.sample @ loads
        )
    if effect.modes_count:
        stage, sample = situation.vibration.rows(effect, np.asarray(physical(effect, shaped))[None])
        push = push._replace(stage_rows=push.stage_rows + stage[0], sample_rows=push.sample_rows + sample[0])
    return push


def linear_drive(effect: Effect, coordinates: Floats, situation: Situation, table: Table | None) -> Push:
    """Return the derivatives of `drive` in the coordinates, leading axis n."""
    shape = coordinates_shape(effect, _recordings(situation))
    flat = jnp.asarray(coordinates)
    if not effect.parameters:  # the amplitude of what is either there or not
        return jax.tree.map(lambda x: x[None], drive(effect, coordinates, situation, table))
    if effect.modes_count:
        steps = DIFFERENCE * np.concatenate([np.eye(len(coordinates)), -np.eye(len(coordinates))])
        values = np.asarray(physical(effect, jnp.asarray(coordinates + steps)))
        count = len(coordinates)
        rows = [(part[:count] - part[count:]) / (2.0 * DIFFERENCE) for part in situation.vibration.rows(effect, values)]
        return _nothing(situation, (count,))._replace(stage_rows=rows[0], sample_rows=rows[1])
    slopes = _nothing(situation, (len(flat),))
    if _acts(effect):
        hooks = _differentiate(_Alike(effect), _setting(situation))(flat, *situation[1:4], _steps(situation))
        slopes = slopes._replace(**{key: np.moveaxis(np.asarray(value), -1, 0) for key, value in hooks.items()})
    if table is not None:
        loads = np.asarray(jax.jacfwd(lambda c: effect.loads(physical(effect, c.reshape(shape))))(flat)).T
        slopes = slopes._replace(
            stage_rows=slopes.stage_rows + np.einsum("rsdm,nm->nrsd", table.stage, loads),
            sample_rows=slopes.sample_rows + np.einsum("rsdm,nm->nrsd", table.sample, loads),
        )
    return slopes


def _recordings(situation: Situation) -> int:
    return int(situation.stage.rate.shape[0])


def _nothing(situation: Situation, lead: Sequence[int] = ()) -> Push:
    posterior = situation.posterior
    recordings, stages = situation.stage.rate.shape[:2]
    samples = situation.sample.rate.shape[1]
    channels = posterior.data.measured.shape[-1]
    return Push(
        np.zeros((*lead, posterior.size)),
        np.zeros((*lead, recordings, stages, WIDTH)),
        np.zeros((*lead, recordings, samples, WIDTH)),
        np.zeros((*lead, recordings, stages, 6)),
        np.zeros((*lead, recordings, samples, 6)),
        np.zeros((*lead, recordings, samples, channels)),
    )


class Setting(NamedTuple):
    """What of the sensors the hooks need: kinds in order, how they are turned, where the accelerometer sits."""

    kinds: tuple[Kind, ...]
    turns: tuple[tuple[float, ...], ...]
    point: tuple[float, ...]


def _setting(situation: Situation) -> Setting:
    model = situation.posterior.model
    return Setting(
        tuple(sensor.kind for sensor in model.sensors),
        tuple(tuple(sensor.rotation.ravel().tolist()) for sensor in model.sensors),
        tuple(model.point.tolist()),
    )


def _steps(situation: Situation) -> Array:
    return situation.posterior.data.grid.step


def _acts(effect: Effect) -> bool:
    """Whether the effect has hooks that act along the motion."""
    return any(effect.uses(hook) for hook in ("momentum", "wrench", "field", "read"))


class _Alike:
    """An effect as a key: equal to others of its class with equal attributes, which share compiled functions."""

    def __init__(self, effect: Effect) -> None:
        self.effect = effect
        own = tuple(sorted(vars(effect).items()))
        try:
            hash(own)
        except TypeError:  # arrays: every such effect is its own
            own = (("id", id(effect)),)
        self._key = (type(effect), own)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Alike) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=128)
def _evaluate(alike: _Alike, setting: Setting) -> Callable[..., dict[str, Array]]:
    return jax.jit(partial(_hooks, alike.effect, setting))


@lru_cache(maxsize=128)
def _differentiate(alike: _Alike, setting: Setting) -> Callable[..., dict[str, Array]]:
    return jax.jit(jax.jacfwd(partial(_hooks, alike.effect, setting)))


def _hooks(
    effect: Effect,
    setting: Setting,
    coordinates: Array,
    stage: Moment,
    sample: Moment,
    readings: Readings,
    step: Array,
) -> dict[str, Array]:
    """Return the parts of the push that an effect's hooks make, by name."""
    values = physical(effect, coordinates.reshape(coordinates_shape(effect, len(step))))
    axis = 0 if effect.per_recording else None
    moments = (stage, sample)
    if effect.states:
        states = jax.vmap(partial(_inner_states, effect), (axis, 0, 0))(values, stage, step)
        inner = [states, _at_samples(states, stage.environment.time, sample.environment.time)]
    else:
        inner = [jnp.zeros((*moment.rate.shape[:2], 0)) for moment in moments]
    each = (axis, 0, 0)
    parts: dict[str, Array] = {}
    if effect.uses("momentum"):
        hook = jax.vmap(jax.vmap(effect.momentum, (None, 0, 0)), each)
        rows = [_couple(*hook(values, m, i)) for m, i in zip(moments, inner, strict=True)]
        parts |= {"stage_rows": rows[0], "sample_rows": rows[1]}
    if effect.uses("wrench"):
        hook = jax.vmap(jax.vmap(effect.wrench, (None, 0, 0)), each)
        wrenches = [jnp.concatenate(hook(values, m, i), axis=-1) for m, i in zip(moments, inner, strict=True)]
        parts |= {"stage_wrench": wrenches[0], "sample_wrench": wrenches[1]}
    if effect.uses("read") or effect.uses("field"):
        parts["reading"] = _reading(effect, setting, values, sample, readings, axis)
    return parts


def _reading(
    effect: Effect, setting: Setting, values: Array, sample: Moment, readings: Readings, axis: int | None
) -> Array:
    """Return what the effect adds to the readings, shape (R, T, C), sensor axes."""
    parts = []
    faulty = jax.vmap(effect.read, (axis, 0))(values, readings) if effect.uses("read") else readings
    for kind, turn in zip(setting.kinds, setting.turns, strict=True):
        if kind is Kind.ATTITUDE:
            parts.append(jnp.zeros((*readings.time.shape, 3)))
            continue
        added = getattr(faulty, kind.value) - getattr(readings, kind.value)
        if kind is Kind.ACCEL and effect.uses("field"):
            lever = jnp.asarray(setting.point) - sample.body.com
            field = jax.vmap(jax.vmap(effect.field, (None, 0, 0)), (axis, 0, 0))
            added = added + field(values, sample, lever) @ jnp.asarray(turn).reshape(3, 3)
        parts.append(added)
    return jnp.concatenate(parts, axis=-1)


def _couple(momentum: Array, rate: Array) -> Array:
    rows = jnp.zeros((*momentum.shape[:-1], WIDTH))
    return rows.at[..., ENTRIES["spin"]].set(momentum).at[..., ENTRIES["spin_rate"]].set(rate)


def _inner_states(effect: Effect, values: Array, stage: Moment, step: Array) -> Array:
    """Integrate an effect's own states along the stages of one recording, shape (S, states)."""
    first, middle, last = (
        jax.tree.map(lambda x, s=s: x[s], stage) for s in (slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2))
    )

    def advance(state: Array, given: Any) -> tuple[Array, tuple[Array, Array]]:
        size, here, half, there = given
        k1 = effect.derivative(values, here, state)
        k2 = effect.derivative(values, half, state + 0.5 * size * k1)
        k3 = effect.derivative(values, half, state + 0.5 * size * k2)
        k4 = effect.derivative(values, there, state + size * k3)
        new = state + size / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        middle_state = 0.5 * (state + new) + 0.125 * size * (k1 - k4)
        return new, (state, middle_state)

    final, (nodes, middles) = jax.lax.scan(advance, jnp.zeros(effect.states), (step, first, middle, last))
    both = jnp.stack([nodes, middles], axis=1).reshape(-1, effect.states)
    return jnp.concatenate([both, final[None]])


def _at_samples(inner: Array, times: Array, wanted: Array) -> Array:
    columns = jax.vmap(jax.vmap(jnp.interp, (None, None, 1), 1))
    return columns(wanted, times, inner)
