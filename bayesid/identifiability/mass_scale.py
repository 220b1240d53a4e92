"""Which base parameters given data determine, and the scale of the masses, which motion alone does not.

With no external wrench the balance (19) reads ``Phi p = 0``: whoever multiplies all inertial parameters by the same
factor multiplies both sides, and sees the same motion. The gravity gradient does not help, as it is linear in the
same parameters (equivalence principle); what helps is an equation with a right side that is known and not zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._math.arrays import Floats
from bayesid.identifiability.base_parameters import BaseParameters
from bayesid.identifiability.rank_decomposition import ZERO, equilibrated
from bayesid.robot.composite_tables import composite_rows
from bayesid.robot.kinematics import Kinematics
from bayesid.robot.regressors import balance_regressor, gradient_regressor, momentum_regressor
from bayesid.robot.robot import Robot

__all__ = ["Determined", "consistent_accelerations", "determined", "rates_at_rest"]


SEEN = 1e-7
"""Relative size from which on a part along the base parameters is more than rounding."""


@dataclass(frozen=True)
class Determined:
    """What linear equations in the standard parameters tell of the base parameters.

    Attributes
    ----------
    rank : int
        Independent combinations of base parameters that the equations determine.
    undetermined : (count, count - rank) array
        Orthonormal directions of the base parameters that satisfy the equations with zero on the right.
    gap : tuple of float
        Smallest singular value kept and largest one dropped, of the equations, with columns of unit length, relative to
        the largest one.
    """

    rank: int
    undetermined: Floats
    gap: tuple[float, float]

    def leaves_open(self, direction: Floats) -> bool:
        """Return whether the equations allow any multiple of a direction of the base parameters, shape (count,).

        Of the base parameters themselves: whether their common scale is undetermined.
        """
        rest = direction - self.undetermined @ (self.undetermined.T @ direction)
        return bool(np.linalg.norm(rest) < SEEN * np.linalg.norm(direction))


@threadpool_limits.wrap(limits=1)  # small factorisations: threads only get in each other's way
def determined(base: BaseParameters, equations: Floats) -> Determined:
    """Return which base parameters the solution of linear equations tells.

    Parameters
    ----------
    base : BaseParameters
    equations : (rows, standard) array
        What multiplies the standard parameters; the right sides do not matter.
    """
    scaled, length = equilibrated(equations)
    square = np.concatenate([scaled, np.zeros((equations.shape[1], equations.shape[1]))])  # at least as many rows
    _, values, rows = np.linalg.svd(np.linalg.qr(square, mode="r"))
    values = values / values.max(initial=1e-300)
    kept = int(np.sum(values > ZERO))
    free = base.projection @ (rows[kept:].T / length[:, None])
    directions, sizes, _ = np.linalg.svd(free / np.linalg.norm(base.projection / length, 2))
    count = int(np.sum(sizes > SEEN))
    gap = (float(values[kept - 1]), float(values[kept]) if kept < len(values) else 0.0)
    return Determined(base.count - count, directions[:, :count], gap)


def consistent_accelerations(
    robot: Robot,
    motion: Kinematics,
    rate: Floats,
    wrench: Floats,
    zenith: Floats | None = None,
    gradient: float = 0.0,
) -> tuple[Floats, Floats]:
    """Return how the base moves under an external wrench, by its six equations of motion.

    Parameters
    ----------
    robot : Robot
    motion : Kinematics
        Of its joints at T instants.
    rate : (T, 3) array
        Angular velocity of the base, base axes [rad/s].
    wrench : (T, 6) array
        External force and torque on the base about its origin, base axes [N, N m].
    zenith : (T, 3) array, optional
        Unit vector in base axes, where the gravity gradient ``gradient`` [1/s2] acts (`gradient_regressor`).

    Returns
    -------
    rate_change, acceleration : (T, 3) arrays
        Of the base's angular velocity, and non-gravitational, of its origin, base axes [rad/s2, m/s2].
    """
    table = composite_rows(robot, motion)[:, :, None]
    if zenith is not None:
        wrench = wrench + gradient_regressor(table, zenith, gradient)[:, :, 0]
    return _solved(lambda change, a: balance_regressor(table, rate, change, a)[:, :, 0], wrench)


def rates_at_rest(robot: Robot, motion: Kinematics) -> Floats:
    """Return the base's angular velocities, (T, 3), at which the robot has no momentum, base axes [rad/s]."""
    table = composite_rows(robot, motion)[:, :, None]
    still = np.zeros((len(table), 6))
    return _solved(lambda rate, v: momentum_regressor(table, rate, v)[:, :, 0], still)[0]


def _solved(affine: Callable[[Floats, Floats], Floats], target: Floats) -> tuple[Floats, Floats]:
    """Solve ``affine(x, y) = target`` for two vectors (T, 3) each, at every instant; target is (T, 6)."""
    zero = np.zeros((len(target), 3))
    offset = affine(zero, zero)
    units = np.eye(6)
    columns = [affine(zero + unit[:3], zero + unit[3:]) - offset for unit in units]
    solution = np.linalg.solve(np.stack(columns, axis=2), (target - offset)[:, :, None])[:, :, 0]
    return solution[:, :3], solution[:, 3:]
