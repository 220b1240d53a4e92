"""Motion of the composite body, which has seven states however many links the robot has.

About the composite centre of mass rotation decouples from translation. With ``L`` the angular momentum about it in base
axes, ``L = I w + spin + h`` and ``dL/dt = N - w x L``; the attitude quaternion (x, y, z, w; base to orbit axes) follows
``w``. The position and velocity of the base do not appear, since no sensor reading depends on them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Traceable
from bayesid._math.resampling import hermite
from bayesid._math.runge_kutta import runge_kutta_stages, runge_kutta_step, split_nodes, stage_inputs
from bayesid._math.small_matrices import cross, inertia_of, inverse, quaternion_rate, rotation, solve_small, symmetric
from bayesid.robot.composite_tables import ENTRIES, WIDTH
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Composite, Environment, Instant, Modes, Wrench
from bayesid.simulation.joint_torques import BaseMotion, Beyond, joint_torques

__all__ = [
    "Grid",
    "LinearMotion",
    "Samples",
    "Start",
    "System",
    "TimeTables",
    "UnitSpeed",
    "composite",
    "linearise",
    "simulate",
    "trace",
]

ATTITUDE, MOMENTUM, INNER = slice(0, 4), slice(4, 7), slice(7, None)
"""Parts of the state: attitude quaternion, angular momentum [N m s], and inner states of the effects."""

INPUTS = WIDTH + 6
"""Number of inputs from outside the model: a row of a table, force and torque on the base."""


class TimeTables(NamedTuple):
    """Kinematic tables at T instants.

    Attributes
    ----------
    known : (T, 28) array
        Rows of the known bodies.
    unknown : (T, 28, p) array
        Coefficients of the unknown bodies' parameters and of the effects.
    environment : Environment
        Environment at these instants.
    beyond : Beyond
        Bodies that each joint carries, for the joint torques.
    """

    known: Traceable
    unknown: Traceable
    environment: Environment
    beyond: Beyond


class UnitSpeed(NamedTuple):
    """Tables at time 0 with each of n joints moving alone at unit speed, known (n, 28) and unknown (n, 28, p)."""

    known: Traceable
    unknown: Traceable


class Grid(NamedTuple):
    """One recording, reduced to the arrays that a simulation with K integration steps and T samples needs.

    Attributes
    ----------
    step : (K,) array
        Lengths of the steps [s].
    node : TimeTables
        Tables at the nodes and midpoints of the steps, 2 K + 1 instants.
    zero_order_hold : (K, 6) array
        Known force and torque on the base during each step, base axes [N, N m].
    sample : TimeTables
        Tables at the sample times.
    step_of : (T,) integer array
        Step in which each sample lies.
    fraction : (T,) array
        Position of each sample within its step, from 0 to 1.
    unit_speed : UnitSpeed
        Tables at time 0 for errors of the joint speeds.
    """

    step: Traceable
    node: TimeTables
    zero_order_hold: Traceable
    sample: TimeTables
    step_of: Traceable
    fraction: Traceable
    unit_speed: UnitSpeed


class Start(NamedTuple):
    """State of a recording at time 0.

    Attributes
    ----------
    attitude : (4,) array
        Quaternion x, y, z, w from base to orbit axes.
    rate : (3,) array
        Angular velocity of the base, base axes [rad/s].
    speed_error : (n,) array
        Excess of the smoothed joint speeds over the true ones [rad/s or m/s]; empty where the model has no such errors.
    """

    attitude: Traceable
    rate: Traceable
    speed_error: Traceable = np.zeros(0)


def composite(row: Array) -> Composite:
    """Return the composite body of one row of a table, shape (28,)."""
    entry = {name: row[columns] for name, columns in ENTRIES.items()}
    mass = entry["mass"][0]
    com, com_rate, com_acceleration = (entry[key] / mass for key in ("first", "first_rate", "first_acceleration"))
    second = symmetric(entry["second"]) - mass * jnp.outer(com, com)
    flow = mass * jnp.outer(com, com_rate)
    inertia = inertia_of(second)
    return Composite(
        mass=mass,
        com=com,
        com_rate=com_rate,
        com_acceleration=com_acceleration,
        inertia=inertia,
        inertia_rate=inertia_of(symmetric(entry["second_rate"]) - flow - flow.T),
        inverse=inverse(inertia),
        second_moment=second,
        spin=entry["spin"] - mass * cross(com, com_rate),
        spin_rate=entry["spin_rate"] - mass * cross(com, com_acceleration),
    )


class Samples(NamedTuple):
    """Simulated motion at T sample times, from which the sensors' readings follow.

    Attributes
    ----------
    instant : Instant
        Instants of the simulation, each array with the leading axis T.
    quaternion : (T, 4) array
        Attitude x, y, z, w from base to orbit axes.
    specific_force : (T, K, 3) array
        Specific force that effects add at each of K mounting points, base axes [m/s2].
    torque : (T, n) array
        Torques of the n joints [N m], or forces of prismatic joints [N].
    """

    instant: Instant
    quaternion: Array
    specific_force: Array
    torque: Array


def simulate(
    grid: Grid, inertial: Array, start: Start, effects: Sequence[Effect], values: Sequence[Array], points: Array
) -> Samples:
    """Simulate one recording.

    Parameters
    ----------
    grid : Grid
        Arrays of the recording, with the tables of the effects after those of the unknown bodies.
    inertial : (p,) array
        Linear inertial parameters of the unknown bodies.
    start : Start
    effects, values : sequences
        Effects and the values of their parameters.
    points : (K, 3) array
        Mounting points of the sensors in the base [m].

    Returns
    -------
    Samples
    """
    return _sample(grid, points, *_integrate(grid, inertial, start, effects, values))


def trace(
    grid: Grid, inertial: Array, start: Start, effects: Sequence[Effect], values: Sequence[Array], points: Array
) -> tuple[Instant, Samples]:
    """Return the motion at all integration nodes and midpoints, leading axis 2 K + 1, and at the samples.

    Parameters
    ----------
    grid, inertial, start, effects, values, points
        As of `simulate`.
    """
    system, loads, trajectory = _integrate(grid, inertial, start, effects, values)
    steps = len(grid.step)
    index = jnp.minimum(jnp.arange(2 * steps + 1) // 2, steps - 1)
    fraction = jnp.concatenate([jnp.tile(jnp.array([0.0, 0.5]), steps), jnp.ones(1)])
    bodies = jax.vmap(composite)(grid.node.known + grid.node.unknown @ loads)
    motion = jax.vmap(system._motion)(
        trajectory.at(index, fraction), (bodies, grid.node.environment), grid.zero_order_hold[index]
    )
    return motion[0], _sample(grid, points, system, loads, trajectory)


class LinearMotion(NamedTuple):
    """Derivatives of a simulated recording with K steps of five stages and T samples; n states and q raw readings.

    The inputs are what may act from outside the model: the 28 entries of a table's row, and the force and torque on the
    base about its origin, base axes [N, N m].

    Attributes
    ----------
    state : (K, 5, n, n) array
        Derivatives of the slope at each stage in the state there.
    input : (K, 5, n, 34) array
        And in the inputs there.
    initial : (n, 34) array
        Derivatives of the state at time 0 in the inputs at the first node.
    reading_state, reading_input : (T, q, n) and (T, q, 34) arrays
        Derivatives of the raw readings.
    reading : (T, q) array
        Raw readings.
    """

    state: Traceable
    input: Traceable
    initial: Traceable
    reading_state: Traceable
    reading_input: Traceable
    reading: Traceable


def linearise(
    grid: Grid,
    inertial: Array,
    start: Start,
    effects: Sequence[Effect],
    values: Sequence[Array],
    points: Array,
    read: Callable[[Samples], Array],
) -> LinearMotion:
    """Linearise the simulation of one recording; parameters as of `simulate`.

    Parameters
    ----------
    read : callable
        Function of the motion at one sample time that returns the raw readings (q,).
    """
    system, loads, trajectory = _integrate(grid, inertial, start, effects, values)
    nothing = jnp.zeros(INPUTS)

    def perturbed(row: Array, environment: Environment, perturbation: Array) -> tuple[Composite, Environment]:
        acting = environment._replace(wrench=environment.wrench + perturbation[WIDTH:])
        return composite(row + perturbation[:WIDTH]), acting

    def slope(state: Array, perturbation: Array, row: Array, environment: Environment, hold: Array) -> Array:
        return system.derivative(state, perturbed(row, environment, perturbation), hold)

    def stages(state: Array, size: Array, hold: Array, *nodes: tuple[Array, Environment]) -> tuple[Array, Array]:
        inputs = stage_inputs(*nodes)
        states, _ = runge_kutta_stages(lambda s, at: slope(s, nothing, at[0], at[1], hold), state, size, inputs)
        slopes = jax.vmap(jax.jacfwd(slope, argnums=(0, 1)), (0, None, 0, 0, None))
        return slopes(states, nothing, *inputs, hold)

    def initial(perturbation: Array) -> Array:
        at = perturbed(rows[0], jax.tree.map(lambda x: x[0], grid.node.environment), perturbation)
        return system.initial(at, start, _spin_error(grid.unit_speed, loads, start))

    def sampled(state: Array, perturbation: Array, row: Array, hold: Array, tables: TimeTables) -> Array:
        return read(system.sample(state, perturbed(row, tables.environment, perturbation), hold, points, tables, loads))

    rows = grid.node.known + grid.node.unknown @ loads
    nodes = split_nodes((rows, grid.node.environment))
    by_state, by_input = jax.vmap(stages)(trajectory.left, grid.step, grid.zero_order_hold, *nodes)
    at = (
        trajectory.at(grid.step_of, grid.fraction),
        grid.sample.known + grid.sample.unknown @ loads,
        grid.zero_order_hold[grid.step_of],
        grid.sample,
    )
    reading_state, reading_input = jax.vmap(jax.jacfwd(sampled, argnums=(0, 1)), (0, None, 0, 0, 0))(
        at[0], nothing, *at[1:]
    )
    reading = jax.vmap(sampled, (0, None, 0, 0, 0))(at[0], nothing, *at[1:])
    return LinearMotion(by_state, by_input, jax.jacfwd(initial)(nothing), reading_state, reading_input, reading)


class _StateTrajectory(NamedTuple):
    """States at the start and end of every step, and their derivatives times the length of the step."""

    left: Array
    right: Array
    left_slope: Array
    right_slope: Array

    def at(self, step: Array, fraction: Array) -> Array:
        """Return the states at fractions of steps by Hermite interpolation."""
        left, right, left_slope, right_slope = (part[step] for part in self)
        return hermite(left, right, left_slope, right_slope, fraction[:, None])


def _integrate(
    grid: Grid, inertial: Array, start: Start, effects: Sequence[Effect], values: Sequence[Array]
) -> tuple[System, Array, _StateTrajectory]:
    """Return the system, the factors of its tables, and its trajectory by the classical Runge-Kutta method."""
    system = System(tuple(effects), tuple(values))
    pairs = zip(effects, values, strict=True)
    loads = jnp.concatenate([inertial, *(effect.body_loads(v, inertial) for effect, v in pairs)])
    bodies = jax.vmap(composite)(grid.node.known + grid.node.unknown @ loads)
    nodes = (bodies, grid.node.environment)
    initial = system.initial(jax.tree.map(lambda x: x[0], nodes), start, _spin_error(grid.unit_speed, loads, start))

    def step(state: Array, given: tuple) -> tuple[Array, tuple[Array, Array, Array]]:
        size, hold, here, half, there = given
        new, first, last = runge_kutta_step(partial(system.derivative, hold=hold), state, size, here, half, there)
        # the last slope differs from the next step's first one where the held wrench jumps
        return new, (state, size * first, size * last)

    steps = (grid.step, grid.zero_order_hold, *split_nodes(nodes))
    final, (states, slopes, end_slopes) = jax.lax.scan(step, initial, steps)
    return system, loads, _StateTrajectory(states, jnp.concatenate([states[1:], final[None]]), slopes, end_slopes)


def _spin_error(tables: UnitSpeed, loads: Array, start: Start) -> Array:
    """Return the spurious angular momentum relative to the base due to errors of the joint speeds at time 0 [N m s]."""
    if not len(start.speed_error):
        return jnp.zeros(3)
    spins = jax.vmap(lambda row: composite(row).spin)(tables.known + tables.unknown @ loads)
    return start.speed_error @ spins


def _sample(grid: Grid, points: Array, system: System, loads: Array, trajectory: _StateTrajectory) -> Samples:
    """Return the motion at the samples along a trajectory of states."""
    bodies = jax.vmap(composite)(grid.sample.known + grid.sample.unknown @ loads)
    sample = jax.vmap(system.sample, (0, 0, 0, None, 0, None))
    states, hold = trajectory.at(grid.step_of, grid.fraction), grid.zero_order_hold[grid.step_of]
    return sample(states, (bodies, grid.sample.environment), hold, points, grid.sample, loads)


class _Inner(NamedTuple):
    """One effect with the values of its parameters and its part of the state.

    Attributes
    ----------
    effect : Effect
    values : (p,) array
        Values of the parameters.
    states : (k,) array
        Inner states.
    amplitude, speed : (n,) arrays
        Amplitudes of the vibration modes and their derivatives.
    """

    effect: Effect
    values: Array
    states: Array
    amplitude: Array
    speed: Array


class System(NamedTuple):
    """Equations of motion of the composite body with a set of effects."""

    effects: tuple[Effect, ...]
    values: tuple[Array, ...]

    def initial(self, given: tuple[Composite, Environment], start: Start, spin_error: Array) -> Array:
        """Return the state at time 0.

        Parameters
        ----------
        given : tuple of Composite and Environment
            Composite body and environment at time 0.
        start : Start
            Attitude and rate at time 0.
        spin_error : (3,) array
            Spurious angular momentum by errors of the joint speeds [N m s].
        """
        body, environment = given
        inner = jnp.zeros(sum(effect.states + 2 * effect.modes_count for effect in self.effects))
        instant = Instant(environment, body, rotation(start.attitude), *jnp.zeros((3, 3)))
        momentum = body.inertia @ start.rate + body.spin - spin_error + self._momentum(instant, inner)[0]
        return jnp.concatenate([start.attitude, momentum, inner])

    def derivative(self, state: Array, given: tuple[Composite, Environment], hold: Array) -> Array:
        """Return the derivative of the state by time.

        Parameters
        ----------
        state : (n,) array
            Attitude, angular momentum and inner states.
        given : tuple of Composite and Environment
            Composite body and environment at the instant.
        hold : (6,) array
            Known force and torque on the base, base axes [N, N m].
        """
        if any(effect.modes_count for effect in self.effects):
            instant, mode_changes = self._motion(state, given, hold)
        else:  # the acceleration is not needed
            instant, mode_changes = self._instant(state, given)[0], jnp.zeros(0)
        wrench = self._wrench(instant, state[INNER], hold)
        torque = wrench.torque - cross(instant.body.com, wrench.force)
        parts = [quaternion_rate(state[ATTITUDE], instant.rate), torque - cross(instant.rate, state[MOMENTUM])]
        used = 0
        for effect, values, states, _, speed in self._inner(state[INNER]):
            if effect.states:
                parts.append(effect.derivative(values, instant, states))
            if effect.modes_count:
                parts += [speed, mode_changes[used : used + effect.modes_count]]
                used += effect.modes_count
        return jnp.concatenate(parts)

    def sample(
        self,
        state: Array,
        given: tuple[Composite, Environment],
        hold: Array,
        points: Array,
        tables: TimeTables,
        loads: Array,
    ) -> Samples:
        """Return the motion at a sample, as `Samples` has it.

        Parameters
        ----------
        state, given, hold
            As of `derivative`.
        points : (K, 3) array
            Mounting points of the sensors in the base [m].
        tables : TimeTables
            Tables of the sample.
        loads : (p,) array
            Factors of the columns of its unknown tables.
        """
        instant, _ = self._motion(state, given, hold)
        added = jnp.zeros_like(points)
        for effect, values, *_ in self._inner(state[INNER]):
            if effect.uses("specific_force"):
                force = jax.vmap(effect.specific_force, (None, None, 0))
                added = added + force(values, instant, points - instant.body.com)
        motion = BaseMotion(instant.rate, instant.rate_change, instant.acceleration)
        tensor = self._gravity_gradient_tensor(instant)
        torque = joint_torques(tables.beyond, tables.unknown, loads, motion, instant.body.com, tensor)
        quaternion = state[ATTITUDE] / jnp.linalg.norm(state[ATTITUDE])
        return Samples(instant, quaternion, added, torque)

    def _motion(self, state: Array, given: tuple[Composite, Environment], hold: Array) -> tuple[Instant, Array]:
        """Return the instant with the accelerations of the base, and those of the modes' amplitudes."""
        instant, momentum_rate = self._instant(state, given)
        body, rate = instant.body, instant.rate
        wrench = self._wrench(instant, state[INNER], hold)
        torque = wrench.torque - cross(body.com, wrench.force)
        change = torque - cross(rate, state[MOMENTUM]) - body.inertia_rate @ rate - body.spin_rate - momentum_rate
        force = wrench.force
        vibrating = [part for part in self._inner(state[INNER]) if part.effect.modes_count]
        for part in vibrating:
            flow = part.effect.modes(part.values).linear.T @ part.speed
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
        if not vibrating:
            return instant._replace(rate_change=rate_change, acceleration=acceleration), jnp.zeros(0)
        modes = [part.effect.modes(part.values) for part in vibrating]
        linear = jnp.concatenate([mode.linear for mode in modes])
        central = jnp.concatenate([_about_com(mode, body.com) for mode in modes])
        free = jnp.concatenate(
            [
                -2.0 * mode.damping * mode.omega * part.speed - mode.omega**2 * part.amplitude
                for mode, part in zip(modes, vibrating, strict=True)
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

    def _instant(self, state: Array, given: tuple[Composite, Environment]) -> tuple[Instant, Array]:
        """Return the instant without accelerations, and the derivative of the relative momentum."""
        body, environment = given
        still = Instant(environment, body, rotation(state[ATTITUDE]), *jnp.zeros((3, 3)))
        momentum, _ = self._momentum(still, state[INNER])
        instant = still._replace(rate=body.inverse @ (state[MOMENTUM] - body.spin - momentum))
        return instant, self._momentum(instant, state[INNER])[1]

    def _momentum(self, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum relative to the base about the centre of mass, and its derivative without modes."""
        momentum, rate = instant.environment.wheel_momentum, instant.environment.wheel_torque
        for effect, values, states, _, speed in self._inner(inner):
            if effect.uses("momentum"):
                added, added_rate = effect.momentum(values, instant, states)
                momentum, rate = momentum + added, rate + added_rate
            if effect.modes_count:
                momentum = momentum + _about_com(effect.modes(values), instant.body.com).T @ speed
        return momentum, rate

    def _wrench(self, instant: Instant, inner: Array, hold: Array) -> Wrench:
        """Return the force and its torque about the base origin."""
        known = hold + instant.environment.wrench
        total = Wrench(known[:3], known[3:])
        for effect, values, states, *_ in self._inner(inner):
            if effect.uses("wrench"):
                added = effect.wrench(values, instant, states)
                total = Wrench(total.force + added.force, total.torque + added.torque)
        return total

    def _gravity_gradient_tensor(self, instant: Instant) -> Array:
        """Return the gravity-gradient tensor of all effects, shape (3, 3) [1/s2]."""
        parts = zip(self.effects, self.values, strict=True)
        return sum(
            (e.gravity_gradient_tensor(v, instant) for e, v in parts if e.uses("gravity_gradient_tensor")),
            jnp.zeros((3, 3)),
        )

    def _inner(self, inner: Array) -> list[_Inner]:
        """Return every effect with its parameters and its part of the inner states."""
        parts, start = [], 0
        for effect, values in zip(self.effects, self.values, strict=True):
            ends = np.cumsum([start, effect.states, effect.modes_count, effect.modes_count])
            parts.append(_Inner(effect, values, *(inner[a:b] for a, b in pairwise(ends))))
            start = int(ends[-1])
        return parts


def _about_com(modes: Modes, com: Array) -> Array:
    """Return the angular momentum of unit modal speeds about the common centre of mass, shape (n, 3)."""
    return modes.angular - jnp.cross(com[None], modes.linear)
