"""Motion at the instants of an integration, and its first variation along many directions at once.

The variation follows the linear time-varying equations about the motion, whose coefficients are local derivatives at
all instants. Differentiated in reverse, which a design needs, it passes through these local derivatives and through
one linear recursion; the integration itself is never differentiated. Local derivatives are taken in reverse, because
reverse over reverse differentiation is ten times faster here than reverse over forward.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from bayesid._math.resampling import hermite
from bayesid._math.runge_kutta import runge_kutta_step, split_nodes
from bayesid.simulation.dynamics import Samples, Start, System, TimeTables, composite
from bayesid.simulation.effects.effect import Effect

__all__ = ["Equations", "Slopes", "propagate"]


class Slopes(NamedTuple):
    """Derivatives of m local quantities at T instants.

    Attributes
    ----------
    state : (T, m, n) array
        In the n states.
    row : (T, m, 28) array
        In the row of the composite body.
    values : (T, m, v) array
        In the parameters of all effects, one effect after the other.
    given : (T, m, g) array
        In whatever else the quantities depend on.
    """

    state: Array
    row: Array
    values: Array
    given: Array

    def along(self, state: Array, row: Array) -> Array:
        """Return the changes (T, m, d) along d directions of states (T, n, d) and rows (T, 28, d).

        Parameters
        ----------
        state : (T, n, d) array
            Changes of the states.
        row : (T, 28, d) array
            Changes of the rows.
        """
        return self.state @ state + self.row @ row


@dataclass(frozen=True)
class Equations:
    """Equations of motion of a planned manoeuvre, in which no known force acts on the base.

    Parameters
    ----------
    effects : sequence of Effect
        Effects of the model.
    points : (K, 3) array
        Mounting points of the sensors in the base [m].
    """

    effects: Sequence[Effect]
    points: Array

    def loads(self, inertial: Array, values: Sequence[Array]) -> Array:
        """Return the coefficients of the columns of the tables, shape (p,).

        Parameters
        ----------
        inertial : (10 B,) array
            Linear inertial parameters of B unknown bodies.
        values : sequence of (p,) arrays
            Parameters of each effect.
        """
        pairs = zip(self.effects, values, strict=True)
        return jnp.concatenate([inertial, *(effect.body_loads(v, inertial) for effect, v in pairs)])

    def initial(self, row: Array, tables: TimeTables, start: Start, values: Sequence[Array]) -> Array:
        """Return the state at time 0, shape (n,).

        Parameters
        ----------
        row : (28,) array
            Row of the composite body at time 0.
        tables : TimeTables
            Tables, the first of them at time 0.
        start : Start
            Attitude and rate at time 0.
        values : sequence of (p,) arrays
            Parameters of each effect.
        """
        environment = jax.tree.map(lambda x: jnp.asarray(x)[0], tables.environment)
        return self._system(values).initial((composite(row), environment), start, jnp.zeros(3))

    def states(self, step: Array, rows: Array, tables: TimeTables, initial: Array, values: tuple[Array, ...]) -> Array:
        """Return the states (T, n) at nodes and midpoints of K steps, by Runge-Kutta's method.

        Derivatives with respect to all arguments follow from the linear recursion, to the order of the method.

        Parameters
        ----------
        step : (K,) array
            Lengths of the steps [s].
        rows : (T, 28) array
            Rows of the composite body at T = 2 K + 1 instants.
        tables : TimeTables
            Tables at these instants.
        initial : (n,) array
            State at time 0.
        values : tuple of (p,) arrays
            Parameters of each effect.
        """
        fixed, begin = jax.lax.stop_gradient((rows, tables, values)), jax.lax.stop_gradient(initial)
        plain = self._integrated(step, begin, *fixed)
        slope, by_state = self._slope(plain, rows, tables, values), self._by_state(plain, *fixed)
        # zero by value, with the derivative of the states
        change = propagate(
            by_state,
            (slope - jax.lax.stop_gradient(slope))[..., None],
            (initial - begin)[:, None],
            step,
        )
        return plain + change[..., 0]

    def slopes(
        self,
        states: Array,
        rows: Array,
        tables: TimeTables,
        values: tuple[Array, ...],
        quantity: Callable[[Samples, Array], Array],
        given: Array,
    ) -> tuple[Array, Slopes, Slopes]:
        """Return a quantity (T, m) of the motion, and the local derivatives of the states' rates of change and of it.

        Parameters
        ----------
        states : (T, n) array
            States at the instants.
        rows : (T, 28) array
            Rows of the composite body.
        tables : TimeTables
            Tables at the instants.
        values : tuple of (p,) arrays
            Parameters of each effect.
        quantity : callable
            Function of the motion at an instant and of what is given there that returns m numbers.
        given : (T, g) array
            Whatever else the quantity depends on.
        """

        def local(
            state: Array, row: Array, values: tuple[Array, ...], given: Array, at: TimeTables
        ) -> tuple[Array, Array]:
            system = self._system(values)
            at_instant = (composite(row), at.environment)
            rate = system.derivative(state, at_instant, jnp.zeros(6))
            sample = system.sample(state, at_instant, jnp.zeros(6), self.points, at, loads)
            value = quantity(sample, given)
            return jnp.concatenate([rate, value]), value

        loads = jnp.zeros(tables.unknown.shape[2])  # of the torques of joints, of which a plan has none
        local_slopes = jax.jacrev(local, argnums=(0, 1, 2, 3), has_aux=True)
        (by_state, by_row, by_effect, by_given), value = jax.vmap(local_slopes, (0, 0, None, 0, 0))(
            states, rows, values, given, tables
        )
        by_values = jnp.concatenate(by_effect, axis=-1) if by_effect else jnp.zeros((*by_row.shape[:2], 0))
        slopes, count = (by_state, by_row, by_values, by_given), states.shape[1]
        return value, Slopes(*(part[:, :count] for part in slopes)), Slopes(*(part[:, count:] for part in slopes))

    def samples(self, states: Array, rows: Array, tables: TimeTables, values: tuple[Array, ...]) -> Samples:
        """Return the motion at all instants.

        Parameters
        ----------
        states : (T, n) array
            States at the instants.
        rows : (T, 28) array
            Rows of the composite body.
        tables : TimeTables
            Tables at the instants.
        values : tuple of (p,) arrays
            Parameters of each effect.
        """
        system, loads = self._system(values), jnp.zeros(tables.unknown.shape[2])

        def one(state: Array, row: Array, at: TimeTables) -> Samples:
            return system.sample(state, (composite(row), at.environment), jnp.zeros(6), self.points, at, loads)

        return jax.vmap(one)(states, rows, tables)

    def _system(self, values: Sequence[Array]) -> System:
        return System(tuple(self.effects), tuple(values))

    def _slope(self, states: Array, rows: Array, tables: TimeTables, values: tuple[Array, ...]) -> Array:
        def one(state: Array, row: Array, at: TimeTables) -> Array:
            return self._system(values).derivative(state, (composite(row), at.environment), jnp.zeros(6))

        return jax.vmap(one)(states, rows, tables)

    def _by_state(self, states: Array, rows: Array, tables: TimeTables, values: tuple[Array, ...]) -> Array:
        def one(state: Array, row: Array, at: TimeTables) -> Array:
            given = (composite(row), at.environment)
            return jax.jacrev(lambda x: self._system(values).derivative(x, given, jnp.zeros(6)))(state)

        return jax.vmap(one)(states, rows, tables)

    def _integrated(
        self, step: Array, initial: Array, rows: Array, tables: TimeTables, values: tuple[Array, ...]
    ) -> Array:
        bodies = jax.vmap(composite)(rows)
        nodes = (bodies, jax.tree.map(jnp.asarray, tables.environment))
        system = self._system(values)

        def derivative(state: Array, given: tuple) -> Array:
            return system.derivative(state, given, jnp.zeros(6))

        def advance(state: Array, given: tuple) -> tuple[Array, tuple[Array, Array]]:
            size, here, half, there = given
            new, first, last = runge_kutta_step(derivative, state, size, here, half, there)
            middle = hermite(state, new, size * first, size * last, 0.5)
            return new, (state, middle)

        final, (left, middle) = jax.lax.scan(advance, initial, (step, *split_nodes(nodes)))
        return _alternating(left, middle, final)


def propagate(by_state: Array, forcing: Array, initial: Array, step: Array) -> Array:
    """Return the solution of a linear differential equation at nodes and midpoints of steps, shape (T, n, d).

    Parameters
    ----------
    by_state : (T, n, n) array
        Coefficients of the states at T = 2 K + 1 instants.
    forcing : (T, n, d) array
        Inhomogeneous terms of d solutions.
    initial : (n, d) array
        Solutions at time 0.
    step : (K,) array
        Lengths of the steps.
    """

    def advance(state: Array, given: tuple) -> tuple[Array, tuple[Array, Array]]:
        size, (first, middle, last), (here, half, there) = given
        a = first @ state + here
        b = middle @ (state + 0.5 * size * a) + half
        c = middle @ (state + 0.5 * size * b) + half
        d = last @ (state + size * c) + there
        new = state + size / 6.0 * (a + 2.0 * (b + c) + d)
        return new, (state, hermite(state, new, size * a, size * (last @ new + there), 0.5))

    final, (left, middle) = jax.lax.scan(advance, initial, (step, split_nodes(by_state), split_nodes(forcing)))
    return _alternating(left, middle, final)


def _alternating(left: Array, middle: Array, final: Array) -> Array:
    """Return the nodes' and midpoints' values in the order of time, shape (2 K + 1, ...)."""
    both = jnp.stack([left, middle], axis=1).reshape(2 * len(left), *left.shape[1:])
    return jnp.concatenate([both, final[None]])
