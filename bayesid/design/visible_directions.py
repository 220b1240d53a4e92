"""Directions of rival effects' amplitudes that a family of manoeuvres can show at all."""

from __future__ import annotations

import jax
import numpy as np
from jax import Array

from bayesid._math.kept_jit import QUICKLY
from bayesid.design.criteria import Separation
from bayesid.design.design_problem import Problem
from bayesid.design.flight import Flight, Outcome
from bayesid.design.search_starts import random_start

__all__ = ["with_visible_directions"]

MANOEUVRES = 16
"""Number of random manoeuvres that are taken for the family."""

LEAST = 1.0
"""Noncentrality that all of them together must reach in a direction: half a nat of expected log Bayes factor."""


def with_visible_directions(problem: Problem, rng: np.random.Generator) -> Problem:
    """Return the problem whose `Separation` seeks the worst direction among those that its manoeuvres can show.

    A direction that all rivals' other unknowns imitate in every manoeuvre, such as a constant force beside the bias of
    an accelerometer, would otherwise be the worst of each manoeuvre, whatever the manoeuvre does for the others.

    Parameters
    ----------
    problem : Problem
        The same problem is returned where no criterion is a separation over all directions.
    rng : numpy.random.Generator
        Source of the random manoeuvres.
    """
    wanted = [item for item in problem.criteria if isinstance(item, Separation) and item.visible is None]
    if not wanted:
        return problem
    plan = problem.plan

    def forms(parameters: Array, z: Array, prior: Array, shadow: Array) -> list[list[Array]]:
        flight = Flight(plan, parameters, z)
        outcome = Outcome(flight, flight.information(shadow), prior)
        return [item.unexplained(plan, outcome) for item in wanted]

    compiled = jax.jit(forms, compiler_options=QUICKLY)
    starts = [random_start(problem, rng) for _ in range(MANOEUVRES)]
    each = [compiled(start, problem.centre, problem.precision, problem.shadow) for start in starts]
    sums = jax.tree.map(lambda *parts: np.sum(parts, axis=0), *each)
    seeing = [(item, item.seeing(own, LEAST)) for item, own in zip(wanted, sums, strict=True)]
    return problem.judged_by([next((new for old, new in seeing if old is item), item) for item in problem.criteria])
