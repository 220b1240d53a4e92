"""From a recording's motion to the arrays a simulation runs on: integration steps, samples and their tables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid.recording.actions import Actions
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import WIDTH, composite_rows, link_table
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import Grid, TimeTables, UnitSpeed
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.instant import Environment
from bayesid.simulation.joint_torques import beyond_joints, no_joints
from bayesid.simulation.orbit import Orbit, OrbitState

__all__ = ["build_grid", "lengthened", "pad_grids", "rounded"]


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
    speed_errors: bool = False,
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
    argument_of_latitude : float
        Argument of latitude at time 0 [rad].
    effects : sequence of Effect
        Whose tables follow those of the unknown links.
    torques : bool
        Whether the joints' torques are sampled too.
    speed_errors : bool
        Whether errors of the joints' speeds at time 0 are told apart (`UnitSpeed`).

    Returns
    -------
    Grid
        Of NumPy arrays, or of JAX's where the motion is traced.
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
        step=size,
        node=instants[0],
        zero_order_hold=actions.zero_order_hold(nodes[:-1]),
        sample=instants[1],
        step_of=index.astype(np.int32),
        fraction=(samples - nodes[index]) / size[index],
        unit_speed=_unit_speed(robot, unknown, motion, instants[0].unknown.shape[2], speed_errors),
    )


def _unit_speed(robot: Robot, unknown: tuple[str, ...], motion: Motion, columns: int, speed_errors: bool) -> UnitSpeed:
    count = len(robot.joints) if speed_errors else 0
    if not count:
        return UnitSpeed(np.zeros((0, WIDTH)), np.zeros((0, WIDTH, columns)))
    position = np.tile(motion.evaluate(np.zeros(1)).position, (count, 1))
    moved = kinematics(robot, JointState(position, np.eye(count), np.zeros((count, count))))
    tables = [link_table(robot, name, moved) for name in unknown]
    rest = np.zeros((count, WIDTH, columns - 10 * len(tables)))  # effects: of second order
    return UnitSpeed(composite_rows(robot, moved, leave_out=unknown), np.concatenate([*tables, rest], axis=2))


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
    for effect in effects:
        if effect.uses("table"):
            tables += effect.body_tables(robot, unknown, motion, time)
    owners = [name for name, table in tables for _ in range(table.shape[2])]
    none = OrbitState(*(np.zeros((len(time), *shape)) for shape in ((3,), (), (3,), (3,), (), (3,))))
    state = none if orbit is None else orbit.state(time, argument_of_latitude)
    momentum, torque = actions.wheels(time)
    environment = Environment(
        time, *state, wheel_momentum=momentum, wheel_torque=torque, wrench=np.zeros((len(time), 6))
    )
    xp = namespace(known, *(table for _, table in tables))
    coefficients = xp.concatenate([np.zeros((len(time), WIDTH, 0)), *(table for _, table in tables)], axis=2)
    beyond = no_joints(len(time), len(owners))
    if torques and robot.joints:
        beyond = beyond_joints(robot, joints, moved, unknown, owners)
    return TimeTables(known, coefficients, environment, beyond)


FINEST = 32
"""Lengths are padded to multiples of this at least, so that recordings of about one length share compiled functions."""

PARTS = 4
"""Lengths beyond are padded to one of so many steps between a power of two and the next."""


def rounded(length: int) -> int:
    """Return a length rounded up coarsely, by at most a quarter where it is not short."""
    unit = max(FINEST, (1 << max(length - 1, 1).bit_length() - 1) // PARTS)
    return -(-length // unit) * unit


def pad_grids(grids: Sequence[Grid], steps: int | None = None, samples: int | None = None) -> Grid:
    """Stack grids of different lengths, shape (R, ...); the padding is steps of no length and copies of a sample."""
    steps = max(len(grid.step) for grid in grids) if steps is None else steps
    samples = max(len(grid.step_of) for grid in grids) if samples is None else samples
    padded = [
        Grid(
            step=np.concatenate([grid.step, np.zeros(steps - len(grid.step))]),
            node=jax.tree.map(lambda x: lengthened(x, 2 * steps + 1), grid.node),
            zero_order_hold=lengthened(grid.zero_order_hold, steps),
            sample=jax.tree.map(lambda x: lengthened(x, samples), grid.sample),
            step_of=lengthened(grid.step_of, samples),
            fraction=lengthened(grid.fraction, samples),
            unit_speed=grid.unit_speed,
        )
        for grid in grids
    ]
    return jax.tree.map(lambda *arrays: jnp.asarray(np.stack(arrays)), *padded)


def lengthened(array: Traceable, length: int) -> Floats:
    """Return an array with its last row repeated up to a length."""
    values = np.asarray(array)
    return np.concatenate([values, np.repeat(values[-1:], length - len(values), axis=0)])
