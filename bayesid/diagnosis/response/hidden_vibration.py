"""Hidden vibrations along a given motion: oscillators driven by the base, and the momentum they carry.

The base yields to its vibrating parts, which shifts their frequency; that is kept, with the base's mass and inertia as
they are at each instant. What is left out is of second order in the parts' momentum.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from bayesid._math.arrays import Floats
from bayesid._math.device import device
from bayesid._math.double_precision import in_double_precision
from bayesid._math.kept_jit import kept_jit
from bayesid._math.on_device import on_device
from bayesid._math.runge_kutta import runge_kutta_step
from bayesid._math.small_matrices import inverse_small
from bayesid.robot.composite_tables import ENTRIES, WIDTH
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Instant

__all__ = ["Vibration"]

FINE = 0.1
"""Integration step of the oscillators [s]."""

BATCH = 16
"""Sets of oscillators that a processor integrates together, unless there is but one."""


class Vibration(NamedTuple):
    """What drives oscillators in the base, of all recordings, on a fine grid of N times.

    forcing (R, N, 27): acceleration of the base origin and of rotation, without the derivative of the velocity by
    components, and ``w w' - w^2 1``; velocity of the base origin and of rotation; its derivative by components.
    compliance (R, N, 6, 6): the base's acceleration under unit force and torque at its origin; times (R, S) and (R, T)
    where results are wanted, and the centre of mass there.
    """

    forcing: Floats
    compliance: Floats
    times: tuple[Floats, Floats]
    com: tuple[Floats, Floats]

    @classmethod
    def along(cls, node: Instant, sample: Instant) -> Vibration:
        """Prepare the forcing from a motion without vibrations."""
        times = np.asarray(node.environment.time)
        end = float(times.max())
        fine = FINE * np.arange(int(np.ceil(end / FINE)) + 2)
        curves = _curves(node)
        forcing, compliance = [], []
        for index in range(len(times)):
            own = np.concatenate([[True], np.diff(times[index]) > 0.0])  # padding repeats the last instant
            given = times[index][own]
            inside = np.minimum(fine, given.max())
            moving = CubicHermiteSpline(given, curves.velocity[index][own], curves.slope[index][own])
            turning = CubicHermiteSpline(given, curves.spread[index][own], curves.spread_rate[index][own])
            rest = CubicSpline(given, curves.rest[index][own])(inside)
            parts = [rest, np.zeros_like(rest), turning(inside), moving(inside), moving.derivative()(inside)]
            forcing.append(np.concatenate(parts, axis=-1))
            soft = _yielding(*(np.asarray(x)[index][own] for x in (node.body.mass, node.body.com, node.body.inverse)))
            flat = soft.reshape(len(soft), -1)
            compliance.append(
                np.stack([np.interp(inside, given, column) for column in flat.T], axis=-1).reshape(-1, 6, 6)
            )
        both = (times, np.asarray(sample.environment.time))
        com = (np.asarray(node.body.com), np.asarray(sample.body.com))
        return cls(np.stack(forcing), np.stack(compliance), both, com)

    @in_double_precision
    def rows(self, effect: Effect, values: Floats) -> tuple[Floats, Floats]:
        """Return changes of the tables by an effect's modes, for n sets of values: (n, R, S, 28), (n, R, T, 28)."""
        modes = jax.vmap(effect.modes)(on_device(values))
        coupling = np.concatenate([np.asarray(modes.linear), np.asarray(modes.angular)], axis=-1)
        omega, damping = np.asarray(modes.omega), np.asarray(modes.damping)
        moments = np.asarray(modes.moment).reshape(*coupling.shape[:2], 9)
        load = np.concatenate([coupling, moments], axis=-1)
        pieces = []
        count, modes_of_set = omega.shape
        size = 8.0 * self.compliance.size * (1.0 + modes_of_set)  # of pushes and softness at every instant [bytes]
        batch = 1 if count == 1 else device().batch(count, size, BATCH)
        for first in range(0, len(values), batch):
            chosen = np.minimum(np.arange(first, first + batch), len(values) - 1)
            found = _oscillate(
                on_device(coupling[chosen]),
                on_device(load[chosen]),
                on_device(omega[chosen]),
                on_device(damping[chosen]),
                on_device(self.forcing),
                on_device(self.compliance),
            )
            pieces.append(np.asarray(found)[: len(values) - first])
        speed, change = np.moveaxis(np.concatenate(pieces), -2, 0)  # each (n, R, N, m)
        flow = np.einsum("nrtm,nmc->nrtc", speed, coupling)
        flow_rate = np.einsum("nrtm,nmc->nrtc", change, coupling)
        return (
            self._at(self.times[0], self.com[0], flow, flow_rate),
            self._at(self.times[1], self.com[1], flow, flow_rate),
        )

    def coupling_rows(
        self, frequency: float, damping: float, pairs: Sequence[tuple[int, int]]
    ) -> tuple[Floats, Floats]:
        """Return changes of the tables by unit entries of a symmetric coupling matrix: (n, R, S, 28), (n, R, T, 28).

        The oscillator that the motion along axis ``j`` drives pushes along axis ``i``, and the other way round.
        """
        coupling = np.eye(6)
        omega = 2.0 * np.pi * frequency
        found = _oscillate(
            on_device(coupling[:, None]),
            on_device(np.eye(6, 15)[:, None]),
            np.full((6, 1), omega),
            np.full((6, 1), damping),
            on_device(self.forcing),
            np.zeros_like(self.compliance),
        )
        speed, change = np.moveaxis(np.asarray(found), -2, 0)
        driven = (np.moveaxis(part[..., 0], 0, -1)[None] for part in (speed, change))
        flow, flow_rate = driven  # (1, R, N, 6), by the axis that drives
        rows = []
        for times, com in zip(self.times, self.com, strict=True):
            moving = [np.zeros((len(pairs), *times.shape, 6)) for _ in range(2)]
            for part, values in zip(moving, _interpolated(times, flow, flow_rate), strict=True):
                for row, (i, j) in enumerate(pairs):
                    for a, b in {(i, j), (j, i)}:
                        part[row, ..., a] += values[0, ..., b]
            rows.append(_rows(moving[0], moving[1], com))
        return rows[0], rows[1]

    def _at(self, times: Floats, com: Floats, flow: Floats, flow_rate: Floats) -> Floats:
        if not np.isfinite(flow).all():  # more swings than there is: the fit refuses such a step
            return np.full((len(flow), *times.shape, WIDTH), np.nan)
        momentum, change = _interpolated(times, flow, flow_rate)
        return _rows(momentum, change, com)


class _Curves(NamedTuple):
    """What moves oscillators, at the nodes.

    velocity (R, S, 6): of the base origin and of rotation, base axes; slope (R, S, 6): its derivative by components;
    rest (R, S, 3): what the acceleration of the base origin has beside; spread (R, S, 9): ``w w' - w^2 1``; spread_rate
    (R, S, 9): its derivative.
    """

    velocity: Floats
    slope: Floats
    rest: Floats
    spread: Floats
    spread_rate: Floats


def _curves(node: Instant) -> _Curves:
    """Return continuous curves where the motion of the joints may jump in its acceleration.

    The velocity of the base origin follows from the centre of mass, which moves steadily. Its derivative jumps with the
    joints' acceleration, between two nodes as well, and a curve through its values would miss that by half a step.
    """
    rate, change = np.asarray(node.rate), np.asarray(node.rate_change)
    com, com_rate, bend = (np.asarray(x) for x in (node.body.com, node.body.com_rate, node.body.com_acceleration))
    velocity = -(np.cross(rate, com) + com_rate)
    slope = -(np.cross(change, com) + np.cross(rate, com_rate) + bend)
    outer = rate[..., :, None] * change[..., None, :]
    spread = rate[..., :, None] * rate[..., None, :] - (rate**2).sum(axis=-1)[..., None, None] * np.eye(3)
    both = outer + np.swapaxes(outer, -1, -2)
    spread_rate = both - np.trace(both, axis1=-2, axis2=-1)[..., None, None] * np.eye(3)
    return _Curves(
        np.concatenate([velocity, rate], axis=-1),
        np.concatenate([slope, change], axis=-1),
        np.asarray(node.acceleration) - slope,
        spread.reshape(*rate.shape[:2], 9),
        spread_rate.reshape(*rate.shape[:2], 9),
    )


def _interpolated(times: Floats, flow: Floats, flow_rate: Floats) -> tuple[Floats, Floats]:
    """Return momenta (n, R, N, 6) on the fine grid, and their derivatives, at other times (R, S)."""
    fine = FINE * np.arange(flow.shape[2])
    found = []
    for r, own in enumerate(times):
        curve = CubicHermiteSpline(fine, flow[:, r], flow_rate[:, r], axis=1)
        found.append((curve(own), curve.derivative()(own)))
    momentum, change = (np.stack(part, axis=1) for part in zip(*found, strict=True))
    return momentum, change


def _rows(p: Floats, q: Floats, com: Floats) -> Floats:
    """Return changes of the tables by momenta (n, R, S, 6) and their derivatives, (n, R, S, 28)."""
    rows = np.zeros((*p.shape[:-1], WIDTH))
    rows[..., ENTRIES["first_rate"]] = p[..., :3]
    rows[..., ENTRIES["first_acceleration"]] = q[..., :3]
    rows[..., ENTRIES["spin"]] = p[..., 3:]
    rows[..., ENTRIES["spin_rate"]] = q[..., 3:]
    # the flow carries no second moment: its rate about the centre of mass must not change with it
    outer = com[..., :, None] * p[..., None, :3]
    both = outer + np.swapaxes(outer, -1, -2)
    rows[..., ENTRIES["second_rate"]] = both[..., [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return rows


def _yielding(mass: Floats, com: Floats, inverse: Floats) -> Floats:
    """Acceleration of the base origin and angular acceleration under unit force and torque there, (T, 6, 6)."""
    cross = np.zeros((len(mass), 3, 3))
    x, y, z = com.T
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross -= np.swapaxes(cross, 1, 2)
    about = np.concatenate([-cross, np.broadcast_to(np.eye(3), cross.shape)], axis=2)
    result = np.swapaxes(about, 1, 2) @ inverse @ about
    result[:, :3, :3] += np.eye(3) / mass[:, None, None]
    return result


@kept_jit()
def _oscillate(coupling: Array, load: Array, omega: Array, damping: Array, forcing: Array, compliance: Array) -> Array:
    """Speeds and accelerations of modal amplitudes, shape (n, R, N, 2, m)."""
    one = jax.vmap(jax.vmap(_run, (None, None, None, None, 0, 0)), (0, 0, 0, 0, None, None))
    return one(coupling, load, omega, damping, forcing, compliance)


def _run(coupling: Array, load: Array, omega: Array, damping: Array, forcing: Array, compliance: Array) -> Array:
    """Integrate the momenta of the modes: the velocity of the base is continuous where its acceleration jumps.

    The modes follow ``M q'' = push - c v'`` with the mass matrix ``M`` that the yielding base leaves. The state holds
    ``q`` and ``p = q' + M^-1 c v``.
    """
    count = len(omega)
    steady, velocity, slope = -forcing[:, :15] @ load.T, forcing[:, 15:21], forcing[:, 21:]
    mass = jnp.eye(count) - jnp.einsum("ia,tab,jb->tij", coupling, compliance, coupling)
    soft = jax.vmap(inverse_small)(mass)
    driven = velocity @ load[:, :6].T
    drawn = jnp.einsum("tij,tj->ti", soft, driven)
    # of the derivative of M^-1 c v, what the acceleration of the base does not give
    softening = jnp.einsum("tij,tj->ti", jnp.diff(soft, axis=0), 0.5 * (driven[:-1] + driven[1:])) / FINE

    def spring(amplitude: Array, speed: Array, push: Array, soft: Array) -> Array:
        return soft @ (push - 2.0 * damping * omega * speed - omega**2 * amplitude)

    def change(state: Array, at: tuple[Array, ...], softening: Array) -> Array:
        push, soft, drawn = at
        amplitude, momentum = state
        speed = momentum - drawn
        return jnp.stack([speed, spring(amplitude, speed, push, soft) + softening])

    def step(state: Array, given: tuple[tuple[Array, ...], tuple[Array, ...], Array]) -> tuple[Array, Array]:
        here, there, softening = given
        half = tuple(0.5 * (one + other) for one, other in zip(here, there, strict=True))
        new, _, _ = runge_kutta_step(
            lambda s, at: change(s, at, softening), state, jnp.asarray(FINE), here, half, there
        )
        return new, state

    rows = (steady, soft, drawn)
    before, after = (tuple(row[part] for row in rows) for part in (slice(None, -1), slice(1, None)))
    # at rest at the start
    final, found = jax.lax.scan(step, jnp.stack([jnp.zeros(count), drawn[0]]), (before, after, softening))
    amplitude, momentum = jnp.moveaxis(jnp.concatenate([found, final[None]]), 1, 0)
    speed = momentum - drawn
    push = steady - slope @ load[:, :6].T
    return jnp.stack([speed, jax.vmap(spring)(amplitude, speed, push, soft)], axis=1)
