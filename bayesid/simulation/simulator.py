"""Forward model from the physical values of the unknowns to the readings of the sensors and the residual."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Traceable
from bayesid._math.small_matrices import tilted
from bayesid.simulation.dynamics import Grid, LinearMotion, Samples, Start, linearise, simulate, trace
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Instant, Readings
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Channels, Sensed

__all__ = ["EffectKey", "ModelConstants", "Simulator", "Values"]


class Values(NamedTuple):
    """Physical values of the unknowns of R recordings.

    Attributes
    ----------
    inertial : (10 B,) array
        Linear inertial parameters of B bodies, body after body.
    rate : (R, 3) array
        Initial rates, base axes [rad/s].
    tilt : (R, 3) array
        Small rotations of the initial attitudes, base axes [rad].
    speed : (R, n) array
        Errors of the n smoothed joint speeds at time 0 [rad/s or m/s]; n is 0 where the model has no such errors.
    effects : tuple of (n,) or (R, n) arrays
        Parameters of each effect, with a leading axis R if they differ between recordings.
    """

    inertial: Array
    rate: Array
    tilt: Array
    speed: Array
    effects: tuple[Array, ...]


class ModelConstants(NamedTuple):
    """Numbers of a model with K sensors that compiled code takes as arguments.

    Attributes
    ----------
    rotation : (K, 3, 3) array
        Rotations from sensor to base axes.
    point : (K, 3) array
        Mounting points in the base [m].
    effects : tuple
        Constants of each effect (`Effect.constants`).
    """

    rotation: Traceable
    point: Traceable
    effects: tuple[Any, ...]

    @classmethod
    def of(cls, model: Model) -> ModelConstants:
        """Return the constants of a model."""
        return cls(
            rotation=np.stack([sensor.rotation for sensor in model.sensors]),
            point=np.stack([np.asarray(sensor.position, dtype=float) for sensor in model.sensors]),
            effects=tuple(effect.constants for effect in model.effects),
        )


@dataclass(frozen=True)
class Simulator:
    """Forward model, every method of which can be traced, batched and differentiated by JAX.

    Simulators of the same operations are equal. Grids, attitudes and readings have a leading axis R of recordings.

    Parameters
    ----------
    channels : Channels
        Layout of the residual.
    torques : tuple of int
        Indices into `Robot.joints` of the joints whose torque is measured.
    keys : tuple of EffectKey
        Effects of the model.
    """

    channels: Channels
    torques: tuple[int, ...]
    keys: tuple[EffectKey, ...]

    @classmethod
    def of(cls, model: Model) -> Simulator:
        """Return the simulator of a model."""
        torques = () if model.torque is None else tuple(model.torque.columns(model.robot))
        return cls(model.channels, torques, tuple(EffectKey(effect) for effect in model.effects))

    def readings(
        self, constants: ModelConstants, values: Values, grid: Grid, attitude: Array
    ) -> tuple[Readings, Array, Array]:
        """Return the readings of the sensors (R, T, ...), sensor axes, and the attitude and rate of the base.

        Parameters
        ----------
        constants : ModelConstants
            Numbers of the model.
        values : Values
            Physical values of the unknowns.
        grid : Grid
            Grids of R recordings.
        attitude : (R, 4) array
            Initial attitudes, quaternions x, y, z, w.
        """

        def one(values: Values, grid: Grid, attitude: Array) -> tuple[Readings, Array, Array]:
            samples = simulate(*self._arguments(constants, values, grid, attitude))
            return self._read(constants, values, grid, samples), samples.quaternion, samples.instant.rate

        return jax.vmap(one, (self._axes, 0, 0))(values, grid, attitude)

    def trace(
        self, constants: ModelConstants, values: Values, grid: Grid, attitude: Array
    ) -> tuple[Instant, Instant, Readings]:
        """Return the motion at the integration nodes and at the samples, and the readings of the sensors.

        Parameters
        ----------
        constants, values, grid, attitude
            As of `readings`.
        """

        def one(values: Values, grid: Grid, attitude: Array) -> tuple[Instant, Instant, Readings]:
            node, samples = trace(*self._arguments(constants, values, grid, attitude))
            return node, samples.instant, self._read(constants, values, grid, samples)

        return jax.vmap(one, (self._axes, 0, 0))(values, grid, attitude)

    def residual(self, readings: Readings, measured: Readings) -> Array:
        """Return measured less predicted readings in the columns of `Channels`, (R, T, C).

        Parameters
        ----------
        readings : Readings
            Predicted readings (R, T, ...).
        measured : Readings
            Measured readings of the same shapes.
        """
        parts = []
        for kind in self.channels.kinds:
            differ = jax.vmap(jax.vmap(kind.residual))
            parts.append(differ(measured.channels[kind.value], readings.channels[kind.value]))
        return jnp.concatenate([*parts, measured.torque - self._measured_torques(readings)], axis=-1)

    def _measured_torques(self, readings: Readings) -> Array:
        """Return the predicted torques of the joints with a torque sensor, shape (R, T, n)."""
        if not self.torques:
            return jnp.zeros((*readings.time.shape, 0))
        return readings.torque[..., list(self.torques)]

    @property
    def _axes(self) -> Values:
        effects = tuple(0 if key.effect.per_recording else None for key in self.keys)
        return Values(None, 0, 0, 0, effects)  # type: ignore[arg-type]

    def effects(self, constants: ModelConstants) -> tuple[Effect, ...]:
        """Return the effects with their constants."""
        return tuple(key.effect.bound(numbers) for key, numbers in zip(self.keys, constants.effects, strict=True))

    def _arguments(self, constants: ModelConstants, values: Values, grid: Grid, attitude: Array) -> tuple[Any, ...]:
        start = Start(tilted(attitude, values.tilt), values.rate, values.speed)
        return grid, values.inertial, start, self.effects(constants), values.effects, constants.point

    def linearise(self, constants: ModelConstants, values: Values, grid: Grid, attitude: Array) -> LinearMotion:
        """Linearise the simulation in what may act from outside; raw readings are those of `faulty`'s argument.

        Parameters
        ----------
        constants, values, grid, attitude
            As of `readings`.
        """

        def one(values: Values, grid: Grid, attitude: Array) -> LinearMotion:
            return partial(linearise, read=partial(self.reading, constants))(
                *self._arguments(constants, values, grid, attitude)
            )

        return jax.lax.map(lambda given: one(*given), (self._repeated(values, len(attitude)), grid, attitude))

    def reading(self, constants: ModelConstants, sample: Samples) -> Array:
        """Return the raw readings (q,) of sensors without a fault at one instant, one sensor after the other.

        Parameters
        ----------
        constants : ModelConstants
            Numbers of the model.
        sample : Samples
            Motion at one instant, without the leading axis.
        """
        alone = jax.tree.map(lambda x: x[None], sample)
        return jnp.concatenate([part[0] for part in self._raw(constants, alone)])

    def faulty(self, constants: ModelConstants, values: Values, grid: Grid, raw: Array) -> Readings:
        """Return the readings of sensors without a fault, (R, T, q), with the faults that effects add; no torques.

        Parameters
        ----------
        constants : ModelConstants
            Numbers of the model.
        values : Values
            Physical values of the unknowns.
        grid : Grid
            Grids of R recordings.
        raw : (R, T, q) array
            Readings without a fault, one sensor after the other.
        """

        def one(values: Values, grid: Grid, raw: Array) -> Readings:
            ends = np.cumsum([len(kind.rest) for kind in self.channels.kinds])
            parts = jnp.split(raw, ends[:-1], axis=-1)
            return self._with_faults(constants, values, grid, parts, jnp.zeros((len(raw), 0)))

        return jax.vmap(one, (self._axes, 0, 0))(values, grid, raw)

    def _repeated(self, values: Values, recordings: int) -> Values:
        """Return the values with a leading axis of recordings throughout."""
        return jax.tree.map(
            lambda axis, x: jnp.broadcast_to(x, (recordings, *x.shape)) if axis is None else x,
            self._axes,
            values,
            is_leaf=lambda axis: axis is None,
        )

    def _read(self, constants: ModelConstants, values: Values, grid: Grid, samples: Samples) -> Readings:
        """Return the readings of the sensors in one recording, with the faults and friction that effects add."""
        return self._with_faults(constants, values, grid, self._raw(constants, samples), samples.torque)

    def _raw(self, constants: ModelConstants, samples: Samples) -> list[Array]:
        """Return the readings of each sensor without a fault, sensor axes."""
        readings = []
        for index, kind in enumerate(self.channels.kinds):
            sensed = Sensed(
                samples.instant,
                samples.quaternion,
                jnp.broadcast_to(constants.point[index], samples.specific_force[:, index].shape),
                samples.specific_force[:, index],
            )
            reading = jax.vmap(kind.read)(sensed)
            readings.append(reading @ constants.rotation[index] if kind.mounted else reading)
        return readings

    def _with_faults(
        self, constants: ModelConstants, values: Values, grid: Grid, raw: Sequence[Array], torque: Array
    ) -> Readings:
        """Return the readings of one recording with the faults and friction that effects add."""
        channels = {kind.value: reading for kind, reading in zip(self.channels.kinds, raw, strict=True)}
        readings = Readings(grid.sample.environment.time, channels, torque, grid.sample.environment.recording[0])
        for effect, parameters in zip(self.effects(constants), values.effects, strict=True):
            readings = effect.read(parameters, readings)
            if self.torques and effect.uses("friction"):
                friction = effect.friction(parameters, grid.sample.beyond.velocity)
                readings = readings._replace(torque=readings.torque + friction)
        return readings


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
