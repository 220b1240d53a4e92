"""Kinematic tables: the composite body's moments of mass as linear functions of every link's inertial parameters.

With ``T`` the pose of a link in the base and ``J`` its pseudo-inertia, ``P = sum T J T'``, ``S = sum T J dT'`` and
``Q = sum T J d2T'`` hold all that the dynamics needs. Each is linear in the ten parameters of each link, so that a
recording is reduced once to tables of coefficients, and a simulation costs as much as one rigid body, however many
links there are.
"""

from __future__ import annotations

from collections.abc import Container
from typing import cast

import numpy as np

from bayesid._math.arrays import Floats, Traceable, namespace
from bayesid.robot.inertial_parameters import BASIS
from bayesid.robot.kinematics import Kinematics, joint_motion
from bayesid.robot.robot import Robot

__all__ = ["ENTRIES", "WIDTH", "composite_rows", "link_table", "rows_of_moments"]


ENTRIES = {
    "mass": slice(0, 1),
    "first": slice(1, 4),  # first moment of mass about the base origin, then its two derivatives
    "first_rate": slice(4, 7),
    "first_acceleration": slice(7, 10),
    "second": slice(10, 16),  # second moment of mass: xx, yy, zz, xy, xz, yz
    "second_rate": slice(16, 22),
    "spin": slice(22, 25),  # angular momentum relative to the base, about its origin
    "spin_rate": slice(25, 28),
}
"""Columns of each moment of mass in a row of a table."""

WIDTH = 28
"""Number of columns of a table."""

_UPPER = ((0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2))


def link_table(robot: Robot, name: str, motion: Kinematics) -> Floats:
    """Return the coefficients of one link's ten parameters at T instants of a motion, shape (T, 28, 10)."""
    link = robot.link(name)
    pose, rate, acceleration = (change @ link.placement for change in joint_motion(motion, link.joint))
    table = _moments(pose, rate, acceleration, BASIS)
    xp = namespace(table)
    return cast("Floats", xp.ascontiguousarray(table.swapaxes(1, 2)) if xp is np else table.swapaxes(1, 2))


def _moments(pose: Floats, rate: Floats, acceleration: Floats, bodies: Floats) -> Floats:
    """Return the rows of pseudo-inertias (p, 4, 4) that move with a pose, in the order of `ENTRIES`, (T, p, 28)."""
    left = pose[:, None] @ bodies
    xp = namespace(left)
    composite, flow, surge = (left @ xp.swapaxes(other, 1, 2)[:, None] for other in (pose, rate, acceleration))
    return rows_of_moments(composite, flow, surge)


def rows_of_moments(composite: Traceable, flow: Traceable, surge: Traceable) -> Floats:
    """Return the rows (..., 28) of the sums ``P``, ``S`` and ``Q``, each of shape (..., 4, 4)."""
    xp = namespace(composite)
    spin, spin_rate = (
        xp.stack([matrix[..., a, b] - matrix[..., b, a] for a, b in ((1, 2), (2, 0), (0, 1))], axis=-1)
        for matrix in (flow, surge)
    )
    rows = xp.concatenate(
        [
            composite[..., 3, 3:],
            composite[..., 3, :3],
            flow[..., 3, :3],
            surge[..., 3, :3],
            composite[..., _UPPER[0], _UPPER[1]],
            (flow + xp.swapaxes(flow, -1, -2))[..., _UPPER[0], _UPPER[1]],
            spin,
            spin_rate,
        ],
        axis=-1,
    )
    return cast("Floats", rows)


def composite_rows(robot: Robot, motion: Kinematics, leave_out: Container[str] = ()) -> Floats:
    """Return the sum of the rows of all links with mass except those left out, shape (T, 28)."""
    carried: dict[int, Floats] = {}
    for name, link in robot.links.items():
        if name not in leave_out and link.inertial.mass > 0.0:
            body = link.placement @ link.inertial.pseudo_inertia @ link.placement.T
            carried[link.joint] = carried.get(link.joint, np.zeros((4, 4))) + body
    rows: Floats = np.zeros((len(motion.pose), WIDTH))
    for joint, moments in carried.items():
        rows = rows + _moments(*joint_motion(motion, joint), moments[None])[:, 0]
    return rows
