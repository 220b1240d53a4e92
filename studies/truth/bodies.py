"""Rigid bodies: inertial parameters, the union of bodies, and bodies drawn near a given one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from studies.truth.numerics import Array

__all__ = ["Body", "join", "nearby", "wrong_guess"]


class Body(NamedTuple):
    """Inertial parameters: mass [kg], centre of mass [m], inertia about it [kg m2], in the link's axes."""

    mass: float
    com: Array
    inertia: Array

    @property
    def quantities(self) -> Array:
        """Mass, centre of mass, inertia about it as xx, yy, zz, xy, xz, yz; shape (10,)."""
        tensor = self.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        return np.concatenate([[self.mass], self.com, tensor])

    def inertia_about(self, point: Array) -> Array:
        """Inertia about a point [kg m2], in the same axes."""
        d = self.com - point
        return self.inertia + self.mass * (d @ d * np.eye(3) - np.outer(d, d))


def join(*bodies: Body) -> Body:
    """Rigid union of bodies that are given in the same axes."""
    mass = sum(body.mass for body in bodies)
    com = np.sum([body.mass * body.com for body in bodies], axis=0) / mass
    return Body(mass, com, np.sum([body.inertia_about(com) for body in bodies], axis=0))


def wrong_guess(body: Body, generator: np.random.Generator, spread: float = 0.1) -> Body:
    """Physical body that is wrong by about twice `spread` in mass and moments, never near the given one."""
    change = generator.choice([-1.0, 1.0], (4, 4)) * generator.uniform(0.5, 1.5, (4, 4)) * spread
    return _with_factor_changed(body, expm(np.triu(change)))


def nearby(body: Body, generator: np.random.Generator, spread: float) -> Body:
    """Physical body from the log-Cholesky prior of relative width `spread` about the given one."""
    scale, *diagonal = np.exp(spread * generator.standard_normal(4))
    upper = np.diag([*diagonal, 1.0]) + np.triu(spread * generator.standard_normal((4, 4)), 1)
    return _with_factor_changed(body, scale * upper)


def _with_factor_changed(body: Body, change: Array) -> Body:
    """Multiply the upper Cholesky factor of the body's pseudo-inertia by an upper triangular matrix."""
    second = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia + body.mass * np.outer(body.com, body.com)
    first = body.mass * body.com
    pseudo = np.block([[second, first[:, None]], [first[None], np.array([[body.mass]])]])
    factor = np.linalg.cholesky(pseudo[::-1, ::-1])[::-1, ::-1] @ change
    pseudo = factor @ factor.T
    mass, com = pseudo[3, 3], pseudo[:3, 3] / pseudo[3, 3]
    second = pseudo[:3, :3] - mass * np.outer(com, com)
    return Body(mass, com, np.trace(second) * np.eye(3) - second)
