"""From a recording's motion to the arrays a simulation runs on: integration steps, samples and their tables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np

from bayesid._math.arrays import Floats
from bayesid.recording.actions import Actions
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import WIDTH, composite_rows, link_table
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import Grid, TimeTables
from bayesid.simulation.effects.effect import Effect, Environment
from bayesid.simulation.joint_torques import beyond_joints, no_joints
from bayesid.simulation.orbit import Orbit, OrbitState

__all__ = ["build_grid", "pad_grids", "rounded"]


def build_grid(
    robot: Robot,
    unknown: tuple[str, ...],
    motion: Motion,
    samples: Floats,
    step: float,
    *,
    orbit: Orbit | None = None,
    argument_of_latitude: float = 0.0,
    actions: Actions | None = None,
    effects: Sequence[Effect] = (),
    torques: bool = False,
) -> Grid:
    """Reduce one recording to a `Grid`.

    Parameters
    ----------
    robot : Robot
    unknown : tuple of str
        Links whose parameters the simulation takes as an argument, in that order; the others are summed.
    motion : Motion
    samples : (T,) array
        Times at which sensors are read [s].
    step : float
        Longest integration step [s]; steps end where a held action changes.
    latitude : float
        Argument of latitude at time 0 [rad].
    effects : sequence of Effect
        Whose tables follow those of the unknown links.
    torques : bool
        Whether the joints' torques are sampled too.
    """
    actions = Actions.none() if actions is None else actions
    nodes = _nodes(float(samples[-1]), step, actions.time)
    node = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])]))
    instants = [
        _instants(robot, unknown, effects, motion, time, orbit, argument_of_latitude, actions, sampled)
        for time, sampled in ((node, False), (samples, torques))
    ]
    index = np.clip(np.searchsorted(nodes, samples, side="right") - 1, 0, len(nodes) - 2)
    size = np.diff(nodes)
    return Grid(
        step=jnp.asarray(size),
        node=instants[0],
        zero_order_hold=jnp.asarray(actions.zero_order_hold(nodes[:-1])),
        sample=instants[1],
        step_of=jnp.asarray(index, dtype=jnp.int32),
        fraction=jnp.asarray((samples - nodes[index]) / size[index]),
    )


def _nodes(end: float, step: float, changes: Floats) -> Floats:
    inner = changes[(changes > 0.0) & (changes < end)]
    breaks = np.concatenate([[0.0], inner, [end]])
    pieces = [
        np.linspace(left, right, int(np.ceil((right - left) / step - 1e-9)) + 1)[:-1]
        for left, right in pairwise(breaks)
    ]
    return np.concatenate([*pieces, [end]])


def _instants(
    robot: Robot,
    unknown: tuple[str, ...],
    effects: Sequence[Effect],
    motion: Motion,
    time: Floats,
    orbit: Orbit | None,
    argument_of_latitude: float,
    actions: Actions,
    torques: bool,
) -> TimeTables:
    joints = motion.evaluate(time)
    moved = kinematics(robot, joints)
    known = composite_rows(robot, moved, leave_out=unknown)
    tables: list[tuple[str | None, Floats]] = [(name, link_table(robot, name, moved)) for name in unknown]
    tables += [(effect.link, effect.table(robot, motion, time)) for effect in effects if effect.uses("table")]
    owners = [name for name, table in tables for _ in range(table.shape[2])]
    none = OrbitState(*(np.zeros((len(time), *shape)) for shape in ((3,), (), (3,), (3,), (), (3,))))
    state = none if orbit is None else orbit.state(time, argument_of_latitude)
    momentum, torque = actions.wheels(time)
    environment = Environment(
        time=jnp.asarray(time),
        zenith=jnp.asarray(state.zenith),
        gradient=jnp.asarray(state.gradient),
        velocity=jnp.asarray(state.velocity),
        sun=jnp.asarray(state.sun),
        argument_of_latitude=jnp.asarray(state.argument_of_latitude),
        north=jnp.asarray(state.north),
        wheel_momentum=jnp.asarray(momentum),
        wheel_torque=jnp.asarray(torque),
        wrench=jnp.zeros((len(time), 6)),
    )
    coefficients = [jnp.zeros((len(time), WIDTH, 0)), *(jnp.asarray(table) for _, table in tables)]
    beyond = no_joints(len(time), len(owners))
    if torques and robot.joints:
        beyond = beyond_joints(robot, joints, moved, unknown, owners)
    return TimeTables(jnp.asarray(known), jnp.concatenate(coefficients, axis=2), environment, beyond)


ROUND = 16
"""Lengths are padded to multiples of this, so that recordings of about one length share compiled functions."""


def rounded(length: int) -> int:
    """Round a length up."""
    return -(-length // ROUND) * ROUND


def pad_grids(grids: list[Grid], steps: int | None = None, samples: int | None = None) -> Grid:
    """Stack grids of different lengths, shape (R, ...); the padding is steps of no length and copies of a sample."""
    steps = max(len(grid.step) for grid in grids) if steps is None else steps
    samples = max(len(grid.step_of) for grid in grids) if samples is None else samples

    def lengthen(array: jax.Array, length: int) -> jax.Array:
        values = np.asarray(array)
        return jnp.asarray(np.concatenate([values, np.repeat(values[-1:], length - len(values), axis=0)]))

    padded = []
    for grid in grids:
        extra = steps - len(grid.step)
        padded.append(
            Grid(
                step=jnp.concatenate([grid.step, jnp.zeros(extra)]),
                node=jax.tree.map(lambda x: lengthen(x, 2 * steps + 1), grid.node),
                zero_order_hold=lengthen(grid.zero_order_hold, steps),
                sample=jax.tree.map(lambda x: lengthen(x, samples), grid.sample),
                step_of=lengthen(grid.step_of, samples),
                fraction=lengthen(grid.fraction, samples),
            )
        )
    return jax.tree.map(lambda *arrays: jnp.asarray(np.stack(arrays)), *padded)
