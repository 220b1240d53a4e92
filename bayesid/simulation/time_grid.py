"""Grids of recordings: the integration steps and samples of a simulation, with their kinematic tables."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import jax
import numpy as np

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid._math.on_device import on_device
from bayesid.recording.actions import Actions
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import WIDTH, composite_rows, link_table
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import Grid, TimeTables, UnitSpeed
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.instant import Environment
from bayesid.simulation.joint_torques import beyond_joints, no_joints
from bayesid.simulation.orbit import Orbit, OrbitState

__all__ = ["build_grid", "lengthened", "pad_grids", "rounded", "time_tables"]


BRIEF = 1e-6
"""Length of the integration step in which a table jumps [s]."""


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
    jumps: Sequence[float] = (),
) -> Grid:
    """Return the grid to which one recording is reduced.

    Parameters
    ----------
    robot : Robot
    unknown : tuple of str
        Links whose parameters are arguments of the simulation, in that order; all others are summed.
    motion : Motion
        Motion of the joints.
    samples : (T,) array
        Times at which any sensor is sampled [s].
    step : float
        Longest integration step [s]; a step also ends where the held wrench changes.
    orbit : Orbit, optional
        Orbit of the robot, None in a laboratory.
    argument_of_latitude : float
        Argument of latitude at time 0 [rad].
    actions : Actions, optional
        Known actions on the base, by default none.
    effects : sequence of Effect
        Effects whose tables follow those of the unknown links.
    torques : bool
        Whether joint torques are computed at the samples.
    speed_errors : bool
        Whether the grid has tables for errors of the joint speeds at time 0 (`UnitSpeed`).
    jumps : sequence of float
        Instants just after which a table of the effects jumps [s]. A step ends at each of them and the next one begins
        `BRIEF` later, so that no longer step sees a jump and the order of the integration is kept.

    Returns
    -------
    Grid
        Arrays of NumPy, or of JAX if the motion is traced.
    """
    actions = Actions.none() if actions is None else actions
    instants_of_jumps = np.asarray(jumps, dtype=float)
    breaks = np.unique(np.concatenate([actions.time, instants_of_jumps, instants_of_jumps + BRIEF]))
    nodes = _nodes(float(samples[-1]), step, breaks)
    node = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])]))
    instants = [
        time_tables(robot, unknown, effects, motion, time, orbit, argument_of_latitude, actions, sampled)
        for time, sampled in ((node, False), (samples, torques))
    ]
    at_nodes = instants[0].environment._replace(sampled=np.zeros(len(node)))
    index = np.clip(np.searchsorted(nodes, samples, side="right") - 1, 0, len(nodes) - 2)
    size = np.diff(nodes)
    return Grid(
        step=size,
        node=instants[0]._replace(environment=at_nodes),
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
    # effects change the momentum of such errors to second order only
    rest = np.zeros((count, WIDTH, columns - 10 * len(tables)))
    return UnitSpeed(composite_rows(robot, moved, leave_out=unknown), np.concatenate([*tables, rest], axis=2))


def _nodes(end: float, step: float, changes: Floats) -> Floats:
    inner = changes[(changes > 0.0) & (changes < end)]
    breaks = np.concatenate([[0.0], inner, [end]])
    pieces = [
        np.linspace(left, right, int(np.ceil((right - left) / step - 1e-9)) + 1)[:-1]
        for left, right in pairwise(breaks)
    ]
    return np.concatenate([*pieces, [end]])


def time_tables(
    robot: Robot,
    unknown: tuple[str, ...],
    effects: Sequence[Effect],
    motion: Motion,
    time: Floats,
    orbit: Orbit | None = None,
    argument_of_latitude: float = 0.0,
    actions: Actions | None = None,
    torques: bool = False,
) -> TimeTables:
    """Return the kinematic tables at some times.

    Parameters
    ----------
    robot, unknown, effects, motion
        As of `build_grid`.
    time : (T,) array
        Instants of the tables [s].
    orbit, argument_of_latitude, actions, torques
        As of `build_grid`.
    """
    actions = Actions.none() if actions is None else actions
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
    number = np.zeros(len(time))
    known_actions = np.zeros((len(time), 6)), actions.spun.courses(time), np.ones(len(time)), number
    environment = Environment(time, *state, momentum, torque, *known_actions)
    xp = namespace(known, *(table for _, table in tables))
    coefficients = xp.concatenate([np.zeros((len(time), WIDTH, 0)), *(table for _, table in tables)], axis=2)
    beyond = no_joints(len(time), len(owners))
    if torques and robot.joints:
        beyond = beyond_joints(robot, joints, moved, unknown, owners)
    return TimeTables(known, coefficients, environment, beyond)


FINEST = 32
"""Smallest unit of padded lengths, so that recordings of about the same length share compiled functions."""

PARTS = 4
"""Number of padded lengths between a power of two and the next, for lengths beyond the smallest unit."""


def rounded(length: int) -> int:
    """Return a length rounded up to a coarse one, by at most a quarter unless it is short."""
    unit = max(FINEST, (1 << max(length - 1, 1).bit_length() - 1) // PARTS)
    return -(-length // unit) * unit


def pad_grids(grids: Sequence[Grid], steps: int | None = None, samples: int | None = None) -> Grid:
    """Return grids stacked to shape (R, ...), padded with steps of zero length and copies of the last sample.

    Parameters
    ----------
    grids : sequence of Grid
        Grids of R recordings.
    steps, samples : int, optional
        Common numbers of steps and samples, by default the largest ones.
    """
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
    return jax.tree.map(lambda *arrays: on_device(np.stack(arrays)), *padded)


def lengthened(array: Traceable, length: int) -> Floats:
    """Return an array with its last row repeated up to a length.

    Parameters
    ----------
    array : (n, ...) array
        Array with at least one row.
    length : int
        Number of rows of the result, at least n.
    """
    values = np.asarray(array)
    return np.concatenate([values, np.repeat(values[-1:], length - len(values), axis=0)])
