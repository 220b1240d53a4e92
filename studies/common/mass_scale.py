"""Base parameters that given data determine, and the scale of the masses, which motion alone does not determine.

Without an external wrench the balance (19) reads ``Phi p = 0``. Multiplying all inertial parameters by the same factor
changes neither side, so the motion stays the same. The gravity gradient does not help, because it is linear in the same
parameters (equivalence principle). Only an equation whose right side is known and not zero determines the scale.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._math.arrays import Floats
from bayesid.identifiability.base_parameters import ZERO, BaseParameters, equilibrated
from bayesid.robot.composite_tables import composite_rows
from bayesid.robot.kinematics import Kinematics
from bayesid.robot.regressors import balance_regressor, gradient_regressor, momentum_regressor
from bayesid.robot.robot import Robot

SEEN = 1e-7  # relative size above which a component along the base parameters is more than rounding


@dataclass(frozen=True)
class Determined:
    """Base parameters that linear equations in the standard parameters determine.

    Attributes
    ----------
    rank : int
        Number of independent combinations of base parameters that the equations determine.
    undetermined : (count, count - rank) array
        Orthonormal directions of the base parameters that satisfy the equations with zero on the right.
    gap : tuple of float
        Smallest singular value kept and largest one dropped, relative to the largest, for the equations with columns
        of unit length.
    """

    rank: int
    undetermined: Floats
    gap: tuple[float, float]

    def leaves_open(self, direction: Floats) -> bool:
        """Return whether the equations allow any multiple of a direction of the base parameters, shape (count,).

        Given the base parameters themselves, the method returns whether their common scale is undetermined.
        """
        rest = direction - self.undetermined @ (self.undetermined.T @ direction)
        return bool(np.linalg.norm(rest) < SEEN * np.linalg.norm(direction))


@threadpool_limits.wrap(limits=1)  # small factorisations: threads only get in each other's way
def determined(base: BaseParameters, equations: Floats) -> Determined:
    """Return which base parameters linear equations in the standard parameters determine.

    Parameters
    ----------
    base : BaseParameters; base parameters of the robot
    equations : (rows, standard) array; matrix that multiplies the standard parameters; the right sides do not matter
    """
    scaled, length = equilibrated(equations)
    square = np.concatenate([scaled, np.zeros((equations.shape[1], equations.shape[1]))])  # as many rows as columns
    _, values, rows = np.linalg.svd(np.linalg.qr(square, mode="r"))
    values = values / values.max(initial=1e-300)
    kept = int(np.sum(values > ZERO))
    free = base.projection @ (rows[kept:].T / length[:, None])
    directions, sizes, _ = np.linalg.svd(free / np.linalg.norm(base.projection / length, 2))
    count = int(np.sum(sizes > SEEN))
    gap = (float(values[kept - 1]), float(values[kept]) if kept < len(values) else 0.0)
    return Determined(base.count - count, directions[:, :count], gap)


def consistent_accelerations(
    robot: Robot, motion: Kinematics, rate: Floats, wrench: Floats, zenith: Floats | None = None, gradient: float = 0.0
) -> tuple[Floats, Floats]:
    """Return the accelerations of the base under an external wrench, by its six equations of motion.

    Parameters
    ----------
    robot : Robot; robot with its inertial parameters
    motion : Kinematics; motion of its joints at T instants
    rate : (T, 3) array; angular velocity of the base, base axes [rad/s]
    wrench : (T, 6) array; external force and torque on the base about its origin, base axes [N, N m]
    zenith : (T, 3) array, optional
        Unit vector from the Earth's centre to the robot, base axes; by default there is no gravity gradient.
    gradient : float; size of the gravity gradient [1/s2] (`gradient_regressor`)

    Returns
    -------
    rate_change, acceleration : (T, 3) arrays
        Angular acceleration of the base and non-gravitational acceleration of its origin, base axes [rad/s2, m/s2].
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
    """Solve ``affine(x, y) = target`` at every instant for x and y of shape (T, 3); the target has shape (T, 6)."""
    zero = np.zeros((len(target), 3))
    offset = affine(zero, zero)
    units = np.eye(6)
    columns = [affine(zero + unit[:3], zero + unit[3:]) - offset for unit in units]
    solution = np.linalg.solve(np.stack(columns, axis=2), (target - offset)[:, :, None])[:, :, 0]
    return solution[:, :3], solution[:, 3:]
