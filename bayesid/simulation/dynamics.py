"""Motion of the composite body: seven states, one small rigid body however many links the robot has.

About the composite centre of mass rotation decouples from translation. With ``L`` the angular momentum about it in base
axes, ``L = I w + spin + h`` and ``dL/dt = N - w x L``; the attitude quaternion (x, y, z, w; base to orbit axes) follows
``w``. The base's position and velocity are an exact gauge of what the sensors read and do not appear.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.hermite import hermite
from bayesid._math.rotation import quaternion_rate, rotation
from bayesid._math.small_matrices import cross, inverse, solve_small, symmetric, trace_less
from bayesid.robot.composite_tables import ENTRIES
from bayesid.simulation.effects.effect import Composite, Effect, Environment, Instant, Modes, Readings, Wrench
from bayesid.simulation.joint_torques import BaseMotion, Beyond, joint_torques

__all__ = ["Grid", "TimeTables", "Start", "composite", "simulate", "trace"]

ATTITUDE, MOMENTUM, INNER = slice(0, 4), slice(4, 7), slice(7, None)


class TimeTables(NamedTuple):
    """Tables at some instants: rows of the known bodies (T, 28), coefficients of the unknown ones (T, 28, p).

    ``beyond`` is what the joints carry, for their torques.
    """

    known: Array
    unknown: Array
    environment: Environment
    beyond: Beyond


class Grid(NamedTuple):
    """Everything about one recording that a simulation needs, reduced to arrays.

    ``node`` holds nodes and midpoints of the K integration steps, 2 K + 1 instants; ``zero_order_hold`` the known
    force and torque on the base during each step, (K, 6); a sample lies in step ``step_of`` at the given ``fraction``.
    """

    step: Array
    node: TimeTables
    zero_order_hold: Array
    sample: TimeTables
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
    second = symmetric(entry["second"]) - mass * jnp.outer(com, com)
    flow = mass * jnp.outer(com, com_rate)
    inertia = trace_less(second)
    return Composite(
        mass=mass,
        com=com,
        com_rate=com_rate,
        com_acceleration=com_acceleration,
        inertia=inertia,
        inertia_rate=trace_less(symmetric(entry["second_rate"]) - flow - flow.T),
        inverse=inverse(inertia),
        second_moment=second,
        spin=entry["spin"] - mass * cross(com, com_rate),
        spin_rate=entry["spin_rate"] - mass * cross(com, com_acceleration),
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
        With the tables of the effects after those of the unknown bodies.
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
    return _sense(grid, point, *_integrate(grid, inertial, start, effects, values))


def trace(
    grid: Grid,
    inertial: Array,
    start: Start,
    effects: Sequence[Effect],
    values: Sequence[Array],
    point: Array,
) -> tuple[Instant, Instant, Readings]:
    """Return the motion as effects see it at every instant of the stages, then of the samples, and the readings.

    Arguments and readings as for `simulate`; leading axes 2 K + 1 and T.
    """
    system, loads, trajectory = _integrate(grid, inertial, start, effects, values)
    steps = len(grid.step)
    index = jnp.minimum(jnp.arange(2 * steps + 1) // 2, steps - 1)
    fraction = jnp.concatenate([jnp.tile(jnp.array([0.0, 0.5]), steps), jnp.ones(1)])
    motions = []
    for instants, of, where in ((grid.node, index, fraction), (grid.sample, grid.step_of, grid.fraction)):
        bodies = jax.vmap(composite)(instants.known + instants.unknown @ loads)
        motion = jax.vmap(system.motion)(
            trajectory.at(of, where), (bodies, instants.environment), grid.zero_order_hold[of]
        )
        motions.append(motion[0])
    return motions[0], motions[1], _sense(grid, point, system, loads, trajectory)


class _Course(NamedTuple):
    """States at the start and end of every step, and their slopes times the step's length."""

    left: Array
    right: Array
    left_slope: Array
    right_slope: Array

    def at(self, step: Array, fraction: Array) -> Array:
        """Hermite interpolation."""
        left, right, left_slope, right_slope = (part[step] for part in self)
        return hermite(left, right, left_slope, right_slope, fraction[:, None])


def _integrate(
    grid: Grid, inertial: Array, start: Start, effects: Sequence[Effect], values: Sequence[Array]
) -> tuple[_System, Array, _Course]:
    """Run the classical Runge-Kutta method over the grid; also return what multiplies its tables."""
    system = _System(tuple(effects), tuple(values))
    loads = jnp.concatenate([inertial, *(effect.loads(v) for effect, v in zip(effects, values, strict=True))])
    bodies = jax.vmap(composite)(grid.node.known + grid.node.unknown @ loads)
    stages = (bodies, grid.node.environment)
    first, middle, last = (
        jax.tree.map(lambda x, s=s: x[s], stages) for s in (slice(0, -1, 2), slice(1, None, 2), slice(2, None, 2))
    )
    initial = system.initial(jax.tree.map(lambda x: x[0], stages), start)

    def step(state: Array, given: tuple) -> tuple[Array, tuple[Array, Array, Array]]:
        size, zero_order_hold, here, half, there = given
        k1 = system.derivative(state, here, zero_order_hold)
        k2 = system.derivative(state + 0.5 * size * k1, half, zero_order_hold)
        k3 = system.derivative(state + 0.5 * size * k2, half, zero_order_hold)
        k4 = system.derivative(state + size * k3, there, zero_order_hold)
        new = state + size / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        # the slope at the end is k1 of the next step, but for a jump of the held wrench
        return new, (state, size * k1, size * system.derivative(new, there, zero_order_hold))

    final, (states, slopes, end_slopes) = jax.lax.scan(
        step, initial, (grid.step, grid.zero_order_hold, first, middle, last)
    )
    return system, loads, _Course(states, jnp.concatenate([states[1:], final[None]]), slopes, end_slopes)


def _sense(grid: Grid, point: Array, system: _System, loads: Array, trajectory: _Course) -> Readings:
    """Return what the sensors read along a course."""
    seen = jax.vmap(composite)(grid.sample.known + grid.sample.unknown @ loads)
    sense = jax.vmap(system.sense, (0, 0, 0, None, 0, None))
    states, zero_order_hold = trajectory.at(grid.step_of, grid.fraction), grid.zero_order_hold[grid.step_of]
    return Readings(*sense(states, (seen, grid.sample.environment), zero_order_hold, point, grid.sample, loads))


class _Inner(NamedTuple):
    """One effect with its values and what the state holds of it."""

    effect: Effect
    values: Array
    own: Array  # its inner states
    amplitude: Array  # of its modes
    speed: Array  # derivative of the amplitudes


class _System(NamedTuple):
    """Equations of motion with a set of effects."""

    effects: tuple[Effect, ...]
    values: tuple[Array, ...]

    def initial(self, given: tuple[Composite, Environment], start: Start) -> Array:
        body, environment = given
        inner = jnp.zeros(sum(effect.states + 2 * effect.modes_count for effect in self.effects))
        instant = Instant(environment, body, rotation(start.attitude), *jnp.zeros((3, 3)))
        momentum = body.inertia @ start.rate + body.spin + self.momentum(instant, inner)[0]
        return jnp.concatenate([start.attitude, momentum, inner])

    def derivative(self, state: Array, given: tuple[Composite, Environment], zero_order_hold: Array) -> Array:
        if any(effect.modes_count for effect in self.effects):
            instant, mode_changes = self.motion(state, given, zero_order_hold)
        else:  # the acceleration is not needed
            instant, mode_changes = self.instant(state, given)[0], jnp.zeros(0)
        wrench = self.wrench(instant, state[INNER], zero_order_hold)
        torque = wrench.torque - cross(instant.body.com, wrench.force)
        parts = [quaternion_rate(state[ATTITUDE], instant.rate), torque - cross(instant.rate, state[MOMENTUM])]
        used = 0
        for effect, values, own, _, speed in self.inner(state[INNER]):
            if effect.states:
                parts.append(effect.derivative(values, instant, own))
            if effect.modes_count:
                parts += [speed, mode_changes[used : used + effect.modes_count]]
                used += effect.modes_count
        return jnp.concatenate(parts)

    def sense(
        self,
        state: Array,
        given: tuple[Composite, Environment],
        zero_order_hold: Array,
        point: Array,
        tables: TimeTables,
        loads: Array,
    ) -> tuple[Array, Array, Array, Array, Array]:
        instant, _ = self.motion(state, given, zero_order_hold)
        rate = instant.rate
        accel = instant.acceleration + cross(instant.rate_change, point) + cross(rate, cross(rate, point))
        for effect, values, *_ in self.inner(state[INNER]):
            if effect.uses("specific_force"):
                accel = accel + effect.specific_force(values, instant, point - instant.body.com)
        motion = BaseMotion(rate, instant.rate_change, instant.acceleration)
        torque = joint_torques(
            tables.beyond, tables.unknown, loads, motion, instant.body.com, self.gravity_gradient_tensor(instant)
        )
        return given[1].time, rate, accel, state[ATTITUDE] / jnp.linalg.norm(state[ATTITUDE]), torque

    def motion(
        self, state: Array, given: tuple[Composite, Environment], zero_order_hold: Array
    ) -> tuple[Instant, Array]:
        """Return the instant with its accelerations, and those of the modes' amplitudes."""
        instant, momentum_rate = self.instant(state, given)
        body, rate = instant.body, instant.rate
        wrench = self.wrench(instant, state[INNER], zero_order_hold)
        torque = wrench.torque - cross(body.com, wrench.force)
        change = torque - cross(rate, state[MOMENTUM]) - body.inertia_rate @ rate - body.spin_rate - momentum_rate
        force = wrench.force
        moving = [item for item in self.inner(state[INNER]) if item.effect.modes_count]
        for item in moving:
            flow = item.effect.modes(item.values).linear.T @ item.speed
            change = change + cross(body.com_rate, flow)
            force = force - 2.0 * cross(rate, flow)
        rate_change = body.inverse @ change
        acceleration = (
            force / body.mass
            - body.com_acceleration
            - 2.0 * cross(rate, body.com_rate)
            - cross(rate_change, body.com)
            - cross(rate, cross(rate, body.com))
        )
        if not moving:
            return instant._replace(rate_change=rate_change, acceleration=acceleration), jnp.zeros(0)
        modes = [item.effect.modes(item.values) for item in moving]
        linear = jnp.concatenate([mode.linear for mode in modes])
        central = jnp.concatenate([_about_com(mode, body.com) for mode in modes])
        free = jnp.concatenate(
            [
                -2.0 * mode.damping * mode.omega * item.speed - mode.omega**2 * item.amplitude
                for mode, item in zip(modes, moving, strict=True)
            ]
        )
        spread = jnp.outer(rate, rate) - (rate @ rate) * jnp.eye(3)  # w x (w x r) as a matrix
        moments = jnp.concatenate([mode.moment for mode in modes])
        excitation = (
            -linear @ (acceleration + cross(rate_change, body.com))
            - central @ rate_change
            - jnp.einsum("nij,ij->n", moments, spread)
        )
        compliance = jnp.eye(len(linear)) - linear @ linear.T / body.mass - central @ body.inverse @ central.T
        changes = solve_small(compliance, free + excitation)
        recoil = body.inverse @ (central.T @ changes)
        return instant._replace(
            rate_change=rate_change - recoil,
            acceleration=acceleration - linear.T @ changes / body.mass + cross(recoil, body.com),
        ), changes

    def instant(self, state: Array, given: tuple[Composite, Environment]) -> tuple[Instant, Array]:
        body, environment = given
        still = Instant(environment, body, rotation(state[ATTITUDE]), *jnp.zeros((3, 3)))
        momentum, momentum_rate = self.momentum(still, state[INNER])
        return still._replace(rate=body.inverse @ (state[MOMENTUM] - body.spin - momentum)), momentum_rate

    def momentum(self, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return momentum relative to the base, about the centre of mass, and its derivative but for the modes'."""
        momentum, rate = instant.environment.wheel_momentum, instant.environment.wheel_torque
        for effect, values, own, _, speed in self.inner(inner):
            if effect.uses("momentum"):
                more, more_rate = effect.momentum(values, instant, own)
                momentum, rate = momentum + more, rate + more_rate
            if effect.modes_count:
                momentum = momentum + _about_com(effect.modes(values), instant.body.com).T @ speed
        return momentum, rate

    def wrench(self, instant: Instant, inner: Array, zero_order_hold: Array) -> Wrench:
        given = zero_order_hold + instant.environment.wrench
        total = Wrench(given[:3], given[3:])
        for effect, values, own, *_ in self.inner(inner):
            if effect.uses("wrench"):
                more = effect.wrench(values, instant, own)
                total = Wrench(total.force + more.force, total.torque + more.torque)
        return total

    def gravity_gradient_tensor(self, instant: Instant) -> Array:
        """Return gravitational acceleration per distance from the centre of mass, (3, 3)."""
        parts = zip(self.effects, self.values, strict=True)
        return sum(
            (e.gravity_gradient_tensor(v, instant) for e, v in parts if e.uses("gravity_gradient_tensor")),
            jnp.zeros((3, 3)),
        )

    def inner(self, inner: Array) -> list[_Inner]:
        parts, start = [], 0
        for effect, values in zip(self.effects, self.values, strict=True):
            ends = np.cumsum([start, effect.states, effect.modes_count, effect.modes_count])
            parts.append(_Inner(effect, values, *(inner[a:b] for a, b in pairwise(ends))))
            start = int(ends[-1])
        return parts


def _about_com(modes: Modes, com: Array) -> Array:
    """Angular momentum of unit modal speeds about the common centre of mass, shape (n, 3)."""
    return modes.angular - jnp.cross(com[None], modes.linear)
