"""Starts made of good motions: shaken, with some joints drawn anew, or with some joints of another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid._math.arrays import Floats
from bayesid.design.design_problem import Problem
from bayesid.design.search_starts import random_start

__all__ = ["offspring"]

SHAKE = 0.6
"""Standard deviation of a shake, in units of the family's scale."""

PARENTS = 6
"""Number of motions, the best ones, from which others are made."""

SHARE = 3
"""One in so many joints, and at least one, is taken from elsewhere."""


def offspring(problem: Problem, pool: Sequence[Floats], number: int, rng: np.random.Generator) -> list[Floats]:
    """Return parameters of new motions, which may break limits.

    Local optima of a manoeuvre are many, and good ones lie near each other or differ by what single joints do.

    Parameters
    ----------
    problem : Problem
    pool : sequence of (n,) arrays
        Parameters of good motions, the best first.
    number : int
        How many are made.
    rng : numpy.random.Generator
    """
    makers = (_shaken, _drawn_anew, _crossed)
    parents = pool[:PARENTS]
    return [makers[index % len(makers)](problem, parents[index % len(parents)], pool, rng) for index in range(number)]


def _shaken(problem: Problem, parent: Floats, pool: Sequence[Floats], rng: np.random.Generator) -> Floats:
    return parent + SHAKE * problem.plan.family.scale * rng.normal(size=len(parent))


def _drawn_anew(problem: Problem, parent: Floats, pool: Sequence[Floats], rng: np.random.Generator) -> Floats:
    return np.where(_some_joints(problem, rng), random_start(problem, rng), parent)


def _crossed(problem: Problem, parent: Floats, pool: Sequence[Floats], rng: np.random.Generator) -> Floats:
    return np.where(_some_joints(problem, rng), pool[int(rng.integers(len(pool)))], parent)


def _some_joints(problem: Problem, rng: np.random.Generator) -> NDArray[Any]:
    """Return which parameters belong to some joints, with which their names begin; of a single joint, some of all."""
    names = np.array([name.partition(".")[0] for name in problem.plan.family.names])
    joints = np.unique(names)
    if len(joints) == 1:
        return rng.random(len(names)) < 1.0 / SHARE
    return np.isin(names, rng.choice(joints, max(1, len(joints) // SHARE), replace=False))
