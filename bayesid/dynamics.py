"""Motion of the composite body: seven states, one small rigid body however many links the robot has.

About the composite centre of mass rotation decouples from translation. With ``L`` the angular momentum about it in base
axes, ``L = I w + spin + h`` and ``dL/dt = N - w x L``; the attitude quaternion (x, y, z, w; base to orbit axes) follows
``w``. The base's position and velocity are an exact gauge of what the sensors read and do not appear.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from bayesid.effects.base import Composite, Effect, Environment, Moment, Readings, Wrench
from bayesid.tables import ENTRIES

__all__ = ["Grid", "Instants", "Start", "composite", "simulate"]

ATTITUDE, MOMENTUM, INNER = slice(0, 4), slice(4, 7), slice(7, None)


class Instants(NamedTuple):
    """Tables at some instants: rows of the known bodies (T, 28), coefficients of the unknown ones (T, 28, p)."""

    known: Array
    unknown: Array
    environment: Environment


class Grid(NamedTuple):
    """Everything about one recording that a simulation needs, reduced to arrays.

    ``stage`` holds nodes and midpoints of the K integration steps, 2 K + 1 instants; ``held`` the known force and
    torque on the base during each step, (K, 6); a sample lies in step ``step_of`` at the given ``fraction`` of it.
    """

    step: Array
    stage: Instants
    held: Array
    sample: Instants
    step_of: Array
    fraction: Array


class Start(NamedTuple):
    """Initial attitude quaternion, base to orbit axes, and angular velocity in base axes [rad/s]."""

    attitude: Array
    rate: Array


def composite(row: Array) -> Composite:
    """Turn one table row, shape (28,), into the composite body."""
    entry = {name: row[columns] for name, columns in ENTRIES.items()}
    mass = entry["mass"][0]
    com, com_rate, com_acceleration = (entry[key] / mass for key in ("first", "first_rate", "first_acceleration"))
    second = _symmetric(entry["second"]) - mass * jnp.outer(com, com)
    cross = mass * jnp.outer(com, com_rate)
    inertia = _trace_less(second)
    return Composite(
        mass=mass,
        com=com,
        com_rate=com_rate,
        com_acceleration=com_acceleration,
        inertia=inertia,
        inertia_rate=_trace_less(_symmetric(entry["second_rate"]) - cross - cross.T),
        inverse=_inverse(inertia),
        second_moment=second,
        spin=entry["spin"] - mass * _cross(com, com_rate),
        spin_rate=entry["spin_rate"] - mass * _cross(com, com_acceleration),
    )


def simulate(
    grid: Grid,
    inertial: Array,
    start: Start,
    effects: Sequence[Effect],
    values: Sequence[Array],
    point: Array,
) -> Readings:
    """Simulate one recording.

    Parameters
    ----------
    grid : Grid
    inertial : (p,) array
        Linear inertial parameters of the unknown bodies.
    start : Start
    effects, values : sequences
        Active effects and their parameters.
    point : (3,) array
        Mounting point of the accelerometer in the base [m].

    Returns
    -------
    Readings
        In base axes; faults of the sensors are not applied.
    """
    system = _System(tuple(effects), tuple(values))
    bodies = jax.vmap(composite)(grid.stage.known + grid.stage.unknown @ inertial)
    stages = (bodies, grid.stage.environment)
    first, middle, last = (
        jax.tree.map(lambda x, s=s: x[s], stages) for s in (slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2))
    )
    initial = system.initial(jax.tree.map(lambda x: x[0], stages), start)

    def step(state: Array, given: tuple) -> tuple[Array, tuple[Array, Array, Array]]:
        size, held, here, half, there = given
        k1 = system.derivative(state, here, held)
        k2 = system.derivative(state + 0.5 * size * k1, half, held)
        k3 = system.derivative(state + 0.5 * size * k2, half, held)
        k4 = system.derivative(state + size * k3, there, held)
        new = state + size / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        # the slope at the end is k1 of the next step, but for a jump of the held wrench
        return new, (state, size * k1, size * system.derivative(new, there, held))

    final, (states, slopes, end_slopes) = jax.lax.scan(step, initial, (grid.step, grid.held, first, middle, last))
    ends = jnp.concatenate([states[1:], final[None]])
    index, s = grid.step_of, grid.fraction[:, None]
    between = _hermite(states[index], ends[index], slopes[index], end_slopes[index], s)
    seen = jax.vmap(composite)(grid.sample.known + grid.sample.unknown @ inertial)
    rate, accel, attitude = jax.vmap(system.sense, (0, 0, 0, None))(
        between, (seen, grid.sample.environment), grid.held[index], point
    )
    return Readings(grid.sample.environment.time, rate, accel, attitude)


class _System(NamedTuple):
    """Equations of motion with a set of effects."""

    effects: tuple[Effect, ...]
    values: tuple[Array, ...]

    def initial(self, instant: tuple[Composite, Environment], start: Start) -> Array:
        body, environment = instant
        inner = jnp.zeros(sum(effect.states for effect in self.effects))
        moment = Moment(environment, body, rotation(start.attitude), jnp.zeros(3))
        momentum = body.inertia @ start.rate + body.spin + self.momentum(moment, inner)[0]
        return jnp.concatenate([start.attitude, momentum, inner])

    def derivative(self, state: Array, instant: tuple[Composite, Environment], held: Array) -> Array:
        moment, _ = self.moment(state, instant)
        wrench = self.wrench(moment, state[INNER], held)
        torque = wrench.torque - _cross(moment.body.com, wrench.force)
        parts = [_quaternion_rate(state[ATTITUDE], moment.rate), torque - _cross(moment.rate, state[MOMENTUM])]
        parts += [
            effect.derivative(values, moment, own) for effect, values, own in self.own(state[INNER]) if effect.states
        ]
        return jnp.concatenate(parts)

    def sense(
        self, state: Array, instant: tuple[Composite, Environment], held: Array, point: Array
    ) -> tuple[Array, Array, Array]:
        moment, momentum_rate = self.moment(state, instant)
        body, rate = moment.body, moment.rate
        wrench = self.wrench(moment, state[INNER], held)
        torque = wrench.torque - _cross(body.com, wrench.force)
        change = torque - _cross(rate, state[MOMENTUM]) - body.inertia_rate @ rate - body.spin_rate - momentum_rate
        rate_change = body.inverse @ change
        lever = point - body.com
        accel = (
            wrench.force / body.mass
            - body.com_acceleration
            - 2.0 * _cross(rate, body.com_rate)
            + _cross(rate_change, lever)
            + _cross(rate, _cross(rate, lever))
        )
        for effect, values, _ in self.own(state[INNER]):
            if effect.uses("field"):
                accel = accel + effect.field(values, moment, lever)
        return rate, accel, state[ATTITUDE] / jnp.linalg.norm(state[ATTITUDE])

    def moment(self, state: Array, instant: tuple[Composite, Environment]) -> tuple[Moment, Array]:
        body, environment = instant
        still = Moment(environment, body, rotation(state[ATTITUDE]), jnp.zeros(3))
        momentum, momentum_rate = self.momentum(still, state[INNER])
        return still._replace(rate=body.inverse @ (state[MOMENTUM] - body.spin - momentum)), momentum_rate

    def momentum(self, moment: Moment, inner: Array) -> tuple[Array, Array]:
        momentum, rate = moment.environment.wheel_momentum, moment.environment.wheel_torque
        for effect, values, own in self.own(inner):
            if effect.uses("momentum"):
                more, more_rate = effect.momentum(values, moment, own)
                momentum, rate = momentum + more, rate + more_rate
        return momentum, rate

    def wrench(self, moment: Moment, inner: Array, held: Array) -> Wrench:
        total = Wrench(held[:3], held[3:])
        for effect, values, own in self.own(inner):
            if effect.uses("wrench"):
                more = effect.wrench(values, moment, own)
                total = Wrench(total.force + more.force, total.torque + more.torque)
        return total

    def own(self, inner: Array) -> list[tuple[Effect, Array, Array]]:
        parts, start = [], 0
        for effect, values in zip(self.effects, self.values, strict=True):
            parts.append((effect, values, inner[start : start + effect.states]))
            start += effect.states
        return parts


def rotation(quaternion: Array) -> Array:
    """Rotation matrix of a quaternion x, y, z, w of any norm."""
    x, y, z, w = quaternion / jnp.linalg.norm(quaternion)
    return jnp.stack(
        [
            jnp.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)]),
            jnp.stack([2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)]),
            jnp.stack([2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)]),
        ]
    )


def quaternion_product(a: Array, b: Array) -> Array:
    """Product of quaternions x, y, z, w: the rotation b, then a."""
    vector = a[3] * b[:3] + b[3] * a[:3] + _cross(a[:3], b[:3])
    return jnp.concatenate([vector, (a[3] * b[3] - a[:3] @ b[:3])[None]])


def _quaternion_rate(quaternion: Array, rate: Array) -> Array:
    return 0.5 * quaternion_product(quaternion, jnp.concatenate([rate, jnp.zeros(1)]))


def _hermite(left: Array, right: Array, left_slope: Array, right_slope: Array, s: Array) -> Array:
    jump = right - left
    return left + s * (
        left_slope + s * (3.0 * jump - 2.0 * left_slope - right_slope + s * (left_slope + right_slope - 2.0 * jump))
    )


def _cross(a: Array, b: Array) -> Array:
    return jnp.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _symmetric(six: Array) -> Array:
    xx, yy, zz, xy, xz, yz = six
    return jnp.stack([jnp.stack([xx, xy, xz]), jnp.stack([xy, yy, yz]), jnp.stack([xz, yz, zz])])


def _trace_less(second: Array) -> Array:
    return jnp.trace(second) * jnp.eye(3) - second


def _inverse(m: Array) -> Array:
    a, b, c = _cross(m[1], m[2]), _cross(m[2], m[0]), _cross(m[0], m[1])
    return jnp.stack([a, b, c], axis=1) / (m[0] @ a)
