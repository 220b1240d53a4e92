"""The forward model: from the physical values of the unknowns to what the sensors read, and to the residual."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Traceable
from bayesid._math.rotation import tilted
from bayesid.simulation.channels import Channels
from bayesid.simulation.dynamics import Grid, Samples, Start, simulate, trace
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_key import EffectKey
from bayesid.simulation.effects.instant import Instant, Readings
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensed

__all__ = ["ModelConstants", "Simulator", "Values"]


class Values(NamedTuple):
    """Physical values of the unknowns.

    inertial (10 bodies,) linear parameters body after body; rate (R, 3) initial rates; tilt (R, 3) small rotation
    of the initial attitude, base axes; speed (R, n) errors of the smoothed joint speeds at time 0, n = 0 where they are
    of no account; effects: per effect (n,) or, per recording, (R, n).
    """

    inertial: Array
    rate: Array
    tilt: Array
    speed: Array
    effects: tuple[Array, ...]


class ModelConstants(NamedTuple):
    """Numbers of a model that compiled code takes as arguments.

    rotation (K, 3, 3), sensor to base axes, and point (K, 3), mounting point in the base [m], of every sensor; and the
    constants of every effect.
    """

    rotation: Traceable
    point: Traceable
    effects: tuple[Any, ...]

    @classmethod
    def of(cls, model: Model) -> ModelConstants:
        """Collect the constants of a model."""
        return cls(
            rotation=np.stack([sensor.rotation for sensor in model.sensors]),
            point=np.stack([np.asarray(sensor.position, dtype=float) for sensor in model.sensors]),
            effects=tuple(effect.constants for effect in model.effects),
        )


@dataclass(frozen=True)
class Simulator:
    """The forward model; every method can be traced, batched and differentiated by JAX.

    Simulators that do the same operations are equal. Grids, attitudes and readings have a leading axis R of recordings.

    Parameters
    ----------
    channels : Channels
    torques : tuple of int
        Joints whose torque is measured, indices into `Robot.joints`.
    keys : tuple of EffectKey
        Effects at work.
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
        """Return what the sensors read, sensor axes, (R, T, ...), and the base's attitude and rate, base axes."""

        def one(values: Values, grid: Grid, attitude: Array) -> tuple[Readings, Array, Array]:
            samples = simulate(*self._arguments(constants, values, grid, attitude))
            return self._read(constants, values, grid, samples), samples.quaternion, samples.instant.rate

        return jax.vmap(one, (self._axes, 0, 0))(values, grid, attitude)

    def trace(
        self, constants: ModelConstants, values: Values, grid: Grid, attitude: Array
    ) -> tuple[Instant, Instant, Readings]:
        """Return the motion at the integration nodes and at the samples, and the readings."""

        def one(values: Values, grid: Grid, attitude: Array) -> tuple[Instant, Instant, Readings]:
            node, samples = trace(*self._arguments(constants, values, grid, attitude))
            return node, samples.instant, self._read(constants, values, grid, samples)

        return jax.vmap(one, (self._axes, 0, 0))(values, grid, attitude)

    def residual(self, readings: Readings, measured: Readings) -> Array:
        """Return measured less predicted readings in the columns of `Channels`, (R, T, C)."""
        parts = []
        for kind in self.channels.kinds:
            differ = jax.vmap(jax.vmap(kind.residual))
            parts.append(differ(measured.channels[kind.value], readings.channels[kind.value]))
        return jnp.concatenate([*parts, measured.torque - self.measured_torques(readings)], axis=-1)

    def measured_torques(self, readings: Readings) -> Array:
        """Return the predicted torques of the joints that are measured, (R, T, n)."""
        if not self.torques:
            return jnp.zeros((*readings.time.shape, 0))
        return readings.torque[..., list(self.torques)]

    @property
    def _axes(self) -> Values:
        effects = tuple(0 if key.effect.per_recording else None for key in self.keys)
        return Values(None, 0, 0, 0, effects)  # type: ignore[arg-type]

    def _effects(self, constants: ModelConstants) -> tuple[Effect, ...]:
        return tuple(key.effect.bound(own) for key, own in zip(self.keys, constants.effects, strict=True))

    def _arguments(self, constants: ModelConstants, values: Values, grid: Grid, attitude: Array) -> tuple[Any, ...]:
        start = Start(tilted(attitude, values.tilt), values.rate, values.speed)
        return grid, values.inertial, start, self._effects(constants), values.effects, constants.point

    def _read(self, constants: ModelConstants, values: Values, grid: Grid, samples: Samples) -> Readings:
        """Return what the sensors make of the motion of one recording."""
        channels = {}
        for index, kind in enumerate(self.channels.kinds):
            sensed = Sensed(
                samples.instant,
                samples.quaternion,
                jnp.broadcast_to(constants.point[index], samples.specific_force[:, index].shape),
                samples.specific_force[:, index],
            )
            reading = jax.vmap(kind.read)(sensed)
            channels[kind.value] = reading @ constants.rotation[index] if kind.mounted else reading
        readings = Readings(samples.instant.environment.time, channels, samples.torque)
        for effect, own in zip(self._effects(constants), values.effects, strict=True):
            readings = effect.read(own, readings)
            if self.torques and effect.uses("friction"):
                friction = effect.friction(own, grid.sample.beyond.velocity)
                readings = readings._replace(torque=readings.torque + friction)
        return readings
