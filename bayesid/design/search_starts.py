"""Starts of a search: random motions within the limits, exchanges between motions, repairs of those outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from jax import Array
from scipy.optimize import minimize

from bayesid._math.arrays import Floats
from bayesid._math.kept_jit import QUICKLY
from bayesid.design.design_problem import Problem
from bayesid.design.flight import Flight, Outcome
from bayesid.design.trajectories import PaperExcitation, TrajectoryFamily

__all__ = ["SLACK", "adapted_to_family", "exchanged", "random_start", "repaired", "within_limits"]

# fractions of the tightest limit between which random starts fill it, so that they begin inside the limits
FILLED = (0.3, 0.95)
SHRUNK = 12  # largest number of times that a random start is shrunk
LIKE_THE_PAPER = 0.25  # fraction of the random starts that swing three joints as the paper's (27) does
FROM_ANOTHER = 0.5  # probability that an exchange takes courses from another of the motions, else from a random start
EXCHANGED = 3  # of so many groups of parameters, such as joints, one is exchanged at most
MANOEUVRES = 16  # number of random manoeuvres that are taken for a family

SLACK = 1e-6
"""Fraction of a limit by which the optimiser may exceed it, since the smooth maximum lies above the true one."""


def random_start(problem: Problem, rng: np.random.Generator) -> Floats:
    """Draw parameters and shrink them towards the centre until they fill a random fraction of the tightest limit.

    Only limits that a smaller motion helps to keep are considered.
    """
    family = problem.plan.family
    direction = family.scale * rng.normal(size=family.size)
    if family.imitates and rng.random() < LIKE_THE_PAPER:
        direction = _like_the_paper(family, rng) - family.centre
    filled, size = rng.uniform(*FILLED), 1.0
    helped = problem.shrinkable
    for _ in range(SHRUNK):
        largest = problem.fractions(family.centre + size * direction)[0][helped].max()
        if largest <= filled:
            break
        size *= np.clip(0.97 * filled / largest, 0.1, 0.9)
    return family.centre + size * direction


def exchanged(problem: Problem, motions: Sequence[Floats], rng: np.random.Generator) -> Floats:
    """Return one of the motions with the courses of one or few joints taken from another one or from a random start."""
    chosen = motions[int(rng.integers(len(motions)))]
    other = motions[int(rng.integers(len(motions)))] if rng.random() < FROM_ANOTHER else random_start(problem, rng)
    groups = problem.plan.family.groups
    count = int(groups.max()) + 1
    taken = rng.choice(count, rng.integers(1, max(count // EXCHANGED, 1) + 1), replace=False)
    return np.where(np.isin(groups, taken), other, chosen)


def _like_the_paper(family: TrajectoryFamily, rng: np.random.Generator) -> Floats:
    """Return the parameters closest to an oscillation (27) of three random joints about the start."""
    moving = family.moving_joints
    joints = rng.choice(moving, min(3, len(moving)), replace=False).tolist()
    paper = PaperExcitation(family.posture_at_rest, family.duration, joints, int(rng.integers(1, 4)))
    return family.nearest(paper.motion(paper.centre + paper.scale * rng.normal(size=paper.size)))


def within_limits(problem: Problem, parameters: Floats, bound: float = 1.0) -> bool:
    """Return whether parameters keep all limits times a factor, on the grid of the search."""
    return bool(problem.fractions(parameters)[0].max() <= bound + SLACK)


def repaired(problem: Problem, parameters: Floats, bound: float = 1.0 - 1e-3) -> Floats:
    """Return parameters that keep the limits, by descent from given ones; the same parameters where none is broken."""
    family = problem.plan.family

    def excess(x: Floats) -> tuple[float, Floats]:
        value, slope = problem.fractions(family.centre + family.scale * x)
        over = np.maximum(value - bound, 0.0)
        return float(0.5 * over @ over), (over @ slope) * family.scale

    x = (parameters - family.centre) / family.scale
    if excess(x)[0] == 0.0:
        return parameters
    # a slightly lower bound, so that the result lies inside the limits
    bound -= 2e-3
    options: Any = {"ftol": 1e-12, "gtol": 1e-7, "maxiter": 60}
    found = family.centre + family.scale * minimize(excess, x, jac=True, method="L-BFGS-B", options=options).x
    for _ in range(SHRUNK):
        largest = problem.fractions(found)[0][problem.shrinkable].max()
        if largest <= bound + 2e-3:
            break
        found = family.centre + np.clip(0.97 * bound / largest, 0.1, 0.9) * (found - family.centre)
    return found


def adapted_to_family(problem: Problem, rng: np.random.Generator) -> Problem:
    """Return the problem whose criteria are adapted to what manoeuvres of its family can show.

    Parameters
    ----------
    problem : Problem
        The same problem is returned where no criterion is still to be adapted.
    rng : numpy.random.Generator
        Source of the random manoeuvres that are taken for the family.
    """
    adaptable = [criterion for criterion in problem.criteria if criterion.adaptable]
    if not adaptable:
        return problem

    def shown(parameters: Array, z: Array, prior: Array, shadow: Array) -> list[list[Array]]:
        flight = Flight(problem.plan, parameters, z)
        outcome = Outcome(flight, flight.information(shadow), prior)
        return [criterion.shown(problem.plan, outcome) for criterion in adaptable]

    compiled = jax.jit(shown, compiler_options=QUICKLY)
    starts = [random_start(problem, rng) for _ in range(MANOEUVRES)]
    each = [compiled(start, problem.centre, problem.precision, problem.shadow) for start in starts]
    sums = iter(jax.tree.map(lambda *parts: np.sum(parts, axis=0), *each))
    return problem.judged_by([one.adapted(next(sums)) if one.adaptable else one for one in problem.criteria])
