"""Base inertial parameters: the smallest set that the equations of motion depend on (section 3.1 of the paper).

All measurements of motion and joint torques depend on the ten parameters of every body only through ``K_B = K_1 +
beta K_2``, the paper's (24). Between the two bodies of a revolute joint, what does not change as the joint turns can be
exchanged without any effect: a mass on the joint axis (mass, and first moment along the axis), and a thin rod along the
axis, whose inertia about the axis is zero. Every revolute joint therefore makes three parameters dependent. Across a
prismatic joint both bodies rotate alike, and the six moments of inertia regroup; mass and first moment do not, because
the joint displaces them. A body that is fixed to another one regroups with all ten. These regroupings do not depend on
how the base is held, but a fixed base also hides what never moves: a free flyer has no parameters without effect, while
a fixed robot has some (Mayeda, Yoshida and Osuka, IEEE Trans. Robotics and Automation 1990; Khalil and Dombre 2002,
section 9.4).

The method is that of Gautier (J. Robotic Systems 1991): QR decompositions of the regressor in random states
(`bayesid.identifiability.base_parameters`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import qr
from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Kinematics, joint_twist, kinematics
from bayesid.robot.regressors import torque_regressor
from bayesid.robot.robot import Robot

__all__ = [
    "GRAVITY",
    "LINEAR",
    "ZERO",
    "Base",
    "BaseParameters",
    "base_parameters",
    "equilibrated",
    "massive_bodies",
    "random_motion",
    "regrouping",
    "stacked_regressor",
    "standard_names",
]

GRAVITY = (0.0, 0.0, -9.81)
"""Acceleration of gravity on a fixed base, base axes [m/s2]."""

# relative length below which a column is not scaled to unit length, because that would amplify its rounding errors
FAINT = 1e-3
GAP = 1e3  # smallest ratio of the last singular value kept to the first dropped at which the rank counts as determined
# remedy in the errors of this module: nearly dependent columns come from nearly degenerate geometry
REMEDY = "Check for joints that are almost, but not exactly, parallel or collinear"
SEED = 1991  # seed of the random states where no generator is given, so that results repeat


class Base(Enum):
    """Support of the base body."""

    FREE = "free-flying"
    """The base moves freely: the equations are its force and torque balance and the joint torques, without gravity."""
    FIXED = "fixed"
    """The base is bolted to the ground: the equations are the joint torques, with gravity."""


def massive_bodies(robot: Robot) -> tuple[str, ...]:
    """Return the links with mass and the loads, every body after those that carry it."""
    bodies = [name for name, link in robot.links.items() if link.inertial.mass > 0.0 or name in robot.loads]
    return tuple(sorted(bodies, key=lambda name: robot.link(name).joint))


def random_motion(robot: Robot, count: int, rng: np.random.Generator) -> Kinematics:
    """Draw random joint states with unit standard deviations of speed and acceleration.

    Revolute joints are drawn anywhere on the circle, prismatic joints with a standard deviation of 1 m about zero.

    Parameters
    ----------
    robot : Robot
    count : int
        Number of states.
    rng : numpy.random.Generator
        Source of the states.
    """
    position, velocity, acceleration = rng.normal(size=(3, count, len(robot.joints)))
    turning = np.array([joint.kind != "prismatic" for joint in robot.joints], dtype=bool)
    position[:, turning] = rng.uniform(-np.pi, np.pi, size=(count, int(turning.sum())))
    return kinematics(robot, JointState(position, velocity, acceleration))


def stacked_regressor(
    robot: Robot,
    bodies: Sequence[str],
    base: Base,
    rng: np.random.Generator,
    *,
    gravity: ArrayLike = GRAVITY,
    surplus: float = 3.0,
) -> Floats:
    """Return the regressor of all equations of motion in random states, stacked as in the paper's (23).

    Parameters
    ----------
    robot : Robot
        Robot with its joints and links.
    bodies : sequence of str
        Bodies whose parameters multiply the columns, ten for each body.
    base : Base
        Support of the base, which decides the equations.
    rng : numpy.random.Generator
        Source of the random states.
    gravity : (3,) array_like
        Acceleration of gravity on a fixed base, base axes [m/s2].
    surplus : float
        Smallest number of rows per column.

    Returns
    -------
    (rows, 10 bodies) array
        Stacked regressor; it has no rows where a fixed base has no joints.
    """
    free = base is Base.FREE
    per_state = len(robot.joints) + (6 if free else 0)
    count = int(np.ceil(surplus * 10 * len(bodies) / max(per_state, 1)))
    motion = random_motion(robot, count, rng)
    if free:
        rate, change, acceleration = rng.normal(size=(3, count, 3))
    else:
        rate = change = np.zeros((count, 3))
        acceleration = np.tile(-np.asarray(gravity, dtype=float), (count, 1))
    regressor = torque_regressor(robot, bodies, motion, rate, change, acceleration)
    return regressor[:, 0 if free else 6 :].reshape(-1, 10 * len(bodies))


ZERO = 1e-10
"""Relative size up to which a singular value, or the part of a column that no other column explains, is rounding."""


def equilibrated(matrix: Floats) -> tuple[Floats, Floats]:
    """Return a matrix with its columns scaled to unit length, and the divisors of the columns.

    Faint columns are divided by the length at which a column starts to count as faint, and zero columns by one.
    """
    length = np.linalg.norm(matrix, axis=0)
    length = np.maximum(length, FAINT * length.max(initial=0.0))
    length = np.where(length > 0.0, length, 1.0)
    return matrix / length, length


def _spanning(matrix: Floats, order: Sequence[int]) -> list[int]:
    """Return the indices of the columns, taken in the given order, that the columns before them do not span.

    Parameters
    ----------
    matrix : (m, n) array
        Columns of about unit length.
    order : sequence of int
        Indices of the columns to consider, the preferred first.
    """
    basis = np.zeros((len(matrix), 0))
    chosen: list[int] = []
    for index in order:
        rest = matrix[:, index]
        for _ in range(2):  # twice is enough against rounding
            rest = rest - basis @ (basis.T @ rest)
        if (size := np.linalg.norm(rest)) > ZERO:
            basis = np.column_stack([basis, rest / size])
            chosen.append(index)
    return chosen


def _checked_rank(matrix: Floats, rank: int) -> tuple[float, float]:
    """Check a rank, and return the last singular value kept and the first dropped, relative to the largest.

    Parameters
    ----------
    matrix : (m, n) array
        Columns of about unit length.
    rank : int

    Raises
    ------
    InputError
        If QR with column pivoting or the singular values give another rank, or the two values are too close.
    """
    if not matrix.size:
        return 1.0, 0.0
    values = np.linalg.svd(matrix, compute_uv=False)
    diagonal = np.abs(np.diag(qr(matrix, mode="r", pivoting=True)[0]))
    ranks = {rank, int(np.sum(diagonal > ZERO)), int(np.sum(values > ZERO))}
    kept = float(values[rank - 1] / values[0])
    dropped = float(values[rank] / values[0]) if rank < len(values) else 0.0
    if len(ranks) > 1 or kept < GAP * dropped:
        raise InputError(
            f"the number of base parameters is ambiguous: {' or '.join(map(str, sorted(ranks)))}, with relative "
            f"singular values of {kept:.2g} and {dropped:.2g} on either side",
            remedy=REMEDY,
        )
    return kept, dropped


def regrouping(matrix: Floats, independent: Sequence[int], dependent: Sequence[int]) -> Floats:
    """Solve ``matrix[:, dependent] = matrix[:, independent] beta`` with one refinement, and set rounding to zero.

    Parameters
    ----------
    matrix : (m, n) array
        Columns of about unit length.
    independent, dependent : sequence of int
        Indices of the columns.

    Raises
    ------
    InputError
        If the solution leaves a residual larger than rounding.
    """
    first, second = matrix[:, independent], matrix[:, dependent]
    beta = np.linalg.lstsq(first, second)[0]
    beta = beta + np.linalg.lstsq(first, second - first @ beta)[0]
    beta[np.abs(beta) < ZERO] = 0.0
    worst = float(np.abs(second - first @ beta).max(initial=0.0))
    if worst > 10.0 * ZERO:
        raise InputError(f"the dependent parameters regroup only with an error of {worst:.2g}", remedy=REMEDY)
    return beta


LINEAR = (
    *("mass", "first.x", "first.y", "first.z"),
    *("inertia.xx", "inertia.xy", "inertia.yy", "inertia.xz", "inertia.yz", "inertia.zz"),
)
"""Names of `InertialParameters.vector`; first moment of mass and inertia are about the link's origin, in its axes."""


@dataclass(frozen=True)
class BaseParameters:
    """Independent standard parameters of a robot, and how the others regroup into them."""

    #: all parameters, ten for every link with mass and for every load, such as ``link1.first.x`` (`LINEAR`)
    standard: tuple[str, ...]
    #: parameters K_1, parameters K_2, and those that a fixed base leaves without effect; together they are `standard`
    independent: tuple[str, ...]
    dependent: tuple[str, ...]
    without_effect: tuple[str, ...]
    regrouping: Floats  #: (independent, dependent) matrix beta of (24), ``K_B = K_1 + beta K_2``
    #: smallest singular value kept and largest one dropped, relative to the largest, for the regressor with columns of
    #: unit length
    gap: tuple[float, float]

    @property
    def count(self) -> int:
        """Number of base parameters."""
        return len(self.independent)

    @property
    def projection(self) -> Floats:
        """Matrix from standard to base parameters, shape (count, standard)."""
        matrix = np.zeros((self.count, len(self.standard)))
        matrix[np.arange(self.count), self._index(self.independent)] = 1.0
        matrix[:, self._index(self.dependent)] = self.regrouping
        return matrix

    @property
    def unseen(self) -> Floats:
        """Directions of the standard parameters that change no base parameter, shape (standard, dependent + rest)."""
        rest = (*self.dependent, *self.without_effect)
        matrix = np.zeros((len(self.standard), len(rest)))
        matrix[self._index(rest), np.arange(len(rest))] = 1.0
        matrix[self._index(self.independent), : len(self.dependent)] = -self.regrouping
        return matrix

    def project(self, p: ArrayLike) -> Floats:
        """Return the base parameters K_B, shape (..., count), of standard parameters, shape (..., standard)."""
        return np.asarray(p, dtype=float) @ self.projection.T

    def recover(self, base: ArrayLike, dependent: ArrayLike, without_effect: ArrayLike = 0.0) -> Floats:
        """Return the standard parameters (standard,) that have given base parameters, by ``K_1 = K_B - beta K_2``.

        Parameters
        ----------
        base : (count,) array_like
            Base parameters K_B.
        dependent : (dependent,) array_like
            Dependent parameters K_2.
        without_effect : array_like
            Values of the parameters without effect.
        """
        p = np.zeros(len(self.standard))
        p[self._index(self.dependent)] = dependent
        p[self._index(self.without_effect)] = without_effect
        p[self._index(self.independent)] = np.asarray(base, dtype=float) - self.regrouping @ np.asarray(dependent)
        return p

    def _index(self, names: Sequence[str]) -> list[int]:
        place = {name: index for index, name in enumerate(self.standard)}
        return [place[name] for name in names]


@threadpool_limits.wrap(limits=1)  # small factorisations: threads only get in each other's way
def base_parameters(
    robot: Robot,
    *,
    base: Base = Base.FREE,
    rng: np.random.Generator | None = None,
    keep: Sequence[str] = (),
    gravity: ArrayLike = GRAVITY,
) -> BaseParameters:
    """Compute the base parameters of a robot.

    By the usual convention the parameters of a body depend on those of the bodies nearer the base. For a link behind a
    revolute joint about z, mass, first.z and inertia.yy are dependent; for one behind a prismatic joint, the inertia.

    Parameters
    ----------
    robot : Robot
        Robot whose inertial values do not matter, except that links without mass are omitted.
    base : Base
        Support of the base, which decides the equations.
    rng : numpy.random.Generator, optional
        Source of the random states in which the equations are evaluated; by default a fixed seed gives the same states
        every time.
    keep : sequence of str
        Standard parameters that are preferred as independent ones, in this order, as far as the structure allows.
    gravity : (3,) array_like
        Acceleration of gravity on a fixed base, base axes [m/s2]; its direction affects which parameters act.

    Raises
    ------
    InputError
        If a name in ``keep`` is unknown, or rounding errors leave the rank unclear.
    """
    bodies = massive_bodies(robot)
    names = standard_names(bodies)
    if unknown := [name for name in keep if name not in names]:
        raise InputError(f"no inertial parameter {', '.join(unknown)}", remedy=f"Choose from {', '.join(names)}")
    rng = np.random.default_rng(SEED) if rng is None else rng
    regressor = stacked_regressor(robot, bodies, base, rng, gravity=gravity)
    scaled, length = equilibrated(regressor)
    moving = np.linalg.norm(scaled, axis=0) > ZERO
    preferred = [names.index(name) for name in (*keep, *_preferred(robot, bodies))]
    order = [index for index in dict.fromkeys(preferred) if moving[index]]
    independent = sorted(_spanning(scaled, order))
    dependent = sorted(set(order) - set(independent))
    gap = _checked_rank(scaled[:, moving], len(independent))
    beta = regrouping(scaled, independent, dependent)
    return BaseParameters(
        standard=names,
        independent=tuple(names[index] for index in independent),
        dependent=tuple(names[index] for index in dependent),
        without_effect=tuple(name for name, moves in zip(names, moving, strict=True) if not moves),
        regrouping=beta / length[independent][:, None] * length[dependent],
        gap=gap,
    )


def standard_names(bodies: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the ten linear parameters of every body, body after body."""
    return tuple(f"{body}.{key}" for body in bodies for key in LINEAR)


def _preferred(robot: Robot, bodies: Sequence[str]) -> list[str]:
    """Return the names from the base outwards; for each body, those that its joint makes dependent come last."""
    order = []
    for body in bodies:
        link = robot.link(body)
        last: tuple[str, ...] = ()
        if link.joint >= 0:
            prismatic = robot.joints[link.joint].kind == "prismatic"
            last = LINEAR[4:] if prismatic else _about(link.placement[:3, :3].T @ joint_twist(robot, link.joint)[3:])
        order += [f"{body}.{key}" for key in (*(key for key in LINEAR if key not in last), *last)]
    return order


def _about(axis: Floats) -> tuple[str, ...]:
    """Return the names that a revolute joint about an axis makes dependent.

    They are the mass, the first moment along the axis, and a moment of inertia that a rod along the axis has.
    """
    along, across = int(np.argmax(np.abs(axis))), np.abs(axis)
    # among equal candidates the textbook's choice, which is yy behind a joint about z
    rod = min((1, 2, 0), key=lambda index: round(float(across[index]), 6))
    return (f"first.{'xyz'[along]}", f"inertia.{'xyz'[rod] * 2}", "mass")
