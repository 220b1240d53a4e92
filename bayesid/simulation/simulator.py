"""The forward model: from the physical values of the unknowns to what the sensors read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.rotation import quaternion_product
from bayesid.simulation.dynamics import Grid, Start, simulate, trace
from bayesid.simulation.effects.effect import Instant, Readings
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Kind

__all__ = ["Simulator", "Values"]


class Values(NamedTuple):
    """Physical values of the unknowns.

    inertial (10 bodies,) linear parameters body after body; rate (R, 3) initial rates; tilt (R, 3) small rotation
    of the initial attitude, base axes; effects: per effect (n,) or, per recording, (R, n).
    """

    inertial: Array
    rate: Array
    tilt: Array
    effects: tuple[Array, ...]


class Simulator:
    """Simulate a model; every method can be traced, batched and differentiated by JAX.

    Grids and initial attitudes have a leading axis R of recordings.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.point = np.asarray(model.point)
        self.kinds = [sensor.kind for sensor in model.sensors]
        self.turn = {sensor.kind: sensor.rotation for sensor in model.sensors}
        self.torques = () if model.torque is None else tuple(model.torque.columns(model.robot))

    def readings(self, values: Values, grid: Grid, attitude: Array) -> Readings:
        """Return what the sensors read, in sensor axes, (R, T, ...)."""
        return self._each(self._sensed, values, grid, attitude)

    def trace(self, values: Values, grid: Grid, attitude: Array) -> tuple[Instant, Instant, Readings]:
        """Return the motion at the stages and at the samples, and the readings."""
        return self._each(self._moved, values, grid, attitude)

    def misfit(self, readings: Readings, measured: Array, quaternion: Array) -> Array:
        """Measured less predicted, sensor after sensor, (R, T, C); of an attitude the small rotation between.

        C is three per sensor, then one per joint with a torque sensor. ``measured`` (R, T, C) holds no attitudes: they
        are in ``quaternion``, (R, T, 4).
        """
        parts = []
        for slot, kind in enumerate(self.kinds):
            if kind is Kind.ATTITUDE:
                parts.append(jax.vmap(jax.vmap(_rotation_between))(readings.attitude, quaternion))
            else:
                parts.append(measured[..., 3 * slot : 3 * slot + 3] - getattr(readings, kind.value))
        torques = readings.torque[..., list(self.torques)] if self.torques else jnp.zeros((*measured.shape[:-1], 0))
        return jnp.concatenate([*parts, measured[..., 3 * len(self.kinds) :] - torques], axis=-1)

    def _each(self, run: Callable[..., Any], values: Values, grid: Grid, attitude: Array) -> Any:
        axes = tuple(0 if effect.per_recording else None for effect in self.model.effects)
        return jax.vmap(run, (0, 0, None, 0, 0, axes))(
            grid, attitude, values.inertial, values.rate, values.tilt, values.effects
        )

    def _sensed(self, grid: Grid, attitude: Array, inertial: Array, rate: Array, tilt: Array, effects: Any) -> Readings:
        readings = simulate(
            grid, inertial, _start(attitude, rate, tilt), self.model.effects, effects, jnp.asarray(self.point)
        )
        return self._distorted(readings, effects, grid)

    def _moved(self, grid: Grid, attitude: Array, inertial: Array, rate: Array, tilt: Array, effects: Any) -> Any:
        start = _start(attitude, rate, tilt)
        node, sample, readings = trace(grid, inertial, start, self.model.effects, effects, jnp.asarray(self.point))
        return node, sample, self._distorted(readings, effects, grid)

    def _distorted(self, readings: Readings, effects: Any, grid: Grid) -> Readings:
        readings = readings._replace(
            rate=readings.rate @ self.turn.get(Kind.RATE, np.eye(3)),
            accel=readings.accel @ self.turn.get(Kind.ACCEL, np.eye(3)),
        )
        for effect, values in zip(self.model.effects, effects, strict=True):
            readings = effect.read(values, readings)
            if self.torques and effect.uses("friction"):
                added = effect.friction(values, grid.sample.beyond.velocity)
                readings = readings._replace(torque=readings.torque + added)
        return readings


def _start(attitude: Array, rate: Array, tilt: Array) -> Start:
    small = jnp.concatenate([0.5 * tilt, jnp.ones(1)])
    return Start(quaternion_product(attitude, small / jnp.linalg.norm(small)), rate)


def _rotation_between(predicted: Array, measured: Array) -> Array:
    """Small rotation, base axes, from the predicted to the measured attitude."""
    difference = quaternion_product(predicted * jnp.array([-1.0, -1.0, -1.0, 1.0]), measured)
    return 2.0 * difference[:3] * jnp.sign(difference[3])
