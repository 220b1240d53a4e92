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
(`bayesid.identifiability.rank_decomposition`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.identifiability.rank_decomposition import ZERO, checked_rank, equilibrated, regrouping, spanning
from bayesid.identifiability.stacked_regressor import GRAVITY, Base, massive_bodies, stacked_regressor
from bayesid.robot.kinematics import joint_twist
from bayesid.robot.robot import Robot

__all__ = ["LINEAR", "BaseParameters", "base_parameters", "standard_names"]

LINEAR = (
    *("mass", "first.x", "first.y", "first.z"),
    *("inertia.xx", "inertia.xy", "inertia.yy", "inertia.xz", "inertia.yz", "inertia.zz"),
)
"""Names of `InertialParameters.vector`; first moment of mass and inertia are about the link's origin, in its axes."""

SEED = 1991  # seed of the random states where no generator is given, so that results repeat


@dataclass(frozen=True)
class BaseParameters:
    """Independent standard parameters of a robot, and how the others regroup into them.

    Attributes
    ----------
    standard : tuple of str
        All parameters, ten for every link with mass and for every load, such as ``link1.first.x`` (`LINEAR`).
    independent, dependent, without_effect : tuples of str
        Parameters K_1, parameters K_2, and those that a fixed base leaves without effect; together they are `standard`.
    regrouping : (independent, dependent) array
        Matrix beta of (24), ``K_B = K_1 + beta K_2``.
    gap : tuple of float
        Smallest singular value kept and largest one dropped, relative to the largest, for the regressor with columns
        of unit length.
    """

    standard: tuple[str, ...]
    independent: tuple[str, ...]
    dependent: tuple[str, ...]
    without_effect: tuple[str, ...]
    regrouping: Floats
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
        Robot whose inertial values do not matter, except that links without mass are left out.
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
    independent = sorted(spanning(scaled, order))
    dependent = sorted(set(order) - set(independent))
    gap = checked_rank(scaled[:, moving], len(independent))
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
