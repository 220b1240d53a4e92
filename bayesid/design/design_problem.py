"""A design problem: a plan, limits and criteria, compiled once, with exact gradients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design.criteria import Criterion
from bayesid.design.motion_limits import ACTIVE, Limit, Limits, smooth_largest
from bayesid.design.plan import Plan, Trajectory

__all__ = ["FINER", "Known", "Problem", "Reached"]

QUICKLY = {"xla_llvm_disable_expensive_passes": True}
"""Of XLA: compiles a third faster, and what it compiles is as fast."""

FINER = 8
"""How much finer than the optimiser's grid the limits of a result are checked."""

_SHARED = ("_cost", "_fractions", "_fine_trajectory")
"""Compiled functions that neither bounds nor what is known enter."""


@dataclass(frozen=True)
class Reached:
    """A limit and how near a manoeuvre comes to it."""

    name: str
    limit: float
    largest: float
    unit: str

    @property
    def active(self) -> bool:
        """Whether it is what holds the manoeuvre back."""
        return self.largest > ACTIVE * self.limit

    @property
    def kept(self) -> bool:
        """Whether it is respected."""
        return self.largest <= self.limit


@dataclass(frozen=True)
class Known:
    """What earlier manoeuvres told: a normal distribution of the unknowns' coordinates.

    Parameters
    ----------
    centre : (n,) array
    precision : (n, n) array
        Inverse of the covariance.
    """

    centre: Floats
    precision: Floats


@dataclass(frozen=True)
class Problem:
    """A family of manoeuvres to choose from.

    Parameters
    ----------
    plan : Plan
    limits : Limits
    criteria : sequence of Criterion
        All that will be asked for: they share one compiled simulation.
    known : Known, optional
        Takes the place of the prior of the plan's model.
    """

    plan: Plan
    limits: Limits
    criteria: tuple[Criterion, ...]
    known: Known | None = None

    @cached_property
    def applied(self) -> tuple[Limit, ...]:
        """The limits that apply."""
        return self.limits.of(self.plan.model.robot)

    @cached_property
    def bounds(self) -> Floats:
        """Bound of every limit, shape (m,)."""
        return np.array([limit.bound for limit in self.applied])

    def with_limits(self, limits: Limits) -> Problem:
        """Return the problem with other bounds of the same limits, without compiling anything anew."""
        new = replace(self, limits=limits)
        if [limit.name for limit in new.applied] != [limit.name for limit in self.applied]:
            raise InputError("other limits apply than before", place="limits", remedy="Change bounds only")
        return self._sharing(new)

    def knowing(self, known: Known) -> Problem:
        """Return the problem after earlier manoeuvres, without compiling anything anew."""
        return self._sharing(replace(self, known=known))

    def _sharing(self, other: Problem) -> Problem:
        other.__dict__.update({key: getattr(self, key) for key in _SHARED})
        return other

    @cached_property
    def centre(self) -> Floats:
        """The prior's centre, in the unknowns' coordinates."""
        return np.zeros(self.plan.unknowns.size) if self.known is None else self.known.centre

    @cached_property
    def precision(self) -> Floats:
        """The prior's precision, in the unknowns' coordinates."""
        return np.eye(self.plan.unknowns.size) if self.known is None else self.known.precision

    def draws(self, count: int, rng: np.random.Generator) -> Floats:
        """Draw the bodies from their prior, everything else at its centre, shape (count, n)."""
        bodies = 10 * len(self.plan.model.priors)
        points = np.tile(self.centre, (count, 1))
        covariance = np.linalg.inv(self.precision)[:bodies, :bodies]
        points[:, :bodies] += rng.normal(size=(count, bodies)) @ np.linalg.cholesky(covariance).T
        return points

    def cost(self, criterion: Criterion, parameters: Floats, points: Sequence[Floats] = ()) -> tuple[float, Floats]:
        """Return a criterion and its gradient, averaged over points of the unknowns (the prior's centre if none)."""
        index = self.criteria.index(criterion)
        pairs = [self._cost(parameters, z, index, self.precision) for z in (points or [self.centre])]
        return float(np.mean([pair[0] for pair in pairs])), np.mean([np.asarray(pair[1]) for pair in pairs], axis=0)

    def costs(self, parameters: Floats) -> dict[str, float]:
        """Return every criterion at the prior's centre."""
        return {criterion.name: self.cost(criterion, parameters)[0] for criterion in self.criteria}

    def fractions(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Return how much of every limit is used, shape (m,), smooth and never too small; and its Jacobian (m, n)."""
        key = np.asarray(parameters, dtype=float).tobytes()
        if key not in self._latest:  # the optimiser asks for value and slope of one point one after the other
            value, slope = self._fractions(parameters, self.centre, self.bounds)
            self._latest.clear()
            self._latest[key] = (np.asarray(value), np.asarray(slope))
        return self._latest[key]

    @cached_property
    def _latest(self) -> dict[bytes, tuple[Floats, Floats]]:
        """The fractions asked for last."""
        return {}

    def reached(self, parameters: Floats) -> list[Reached]:
        """Check every limit on a grid `FINER` times finer than the optimiser's."""
        trajectory = self.trajectory(parameters)
        return [
            Reached(limit.name, limit.bound, float(limit.largest(trajectory)), limit.unit) for limit in self.applied
        ]

    def largest(self, parameters: Floats, points: Floats, limits: Sequence[Limit]) -> Floats:
        """Largest value of some limits for many points of the unknowns, shape (k, n) -> (k, limits)."""
        rows = []
        for z in points:
            trajectory = self.trajectory(parameters, z)
            rows.append([float(limit.largest(trajectory)) for limit in limits])
        return np.array(rows).reshape(len(points), len(limits))

    def trajectory(self, parameters: Floats, z: Floats | None = None) -> Trajectory:
        """Return what the robot does, on the fine grid."""
        return jax.tree.map(np.asarray, self._fine_trajectory(parameters, self.centre if z is None else z))

    def points(self, criterion: Criterion, rng: np.random.Generator) -> list[Floats]:
        """Draw points of the prior of all bodies to average a criterion over; none if it looks at the centre alone."""
        return list(self.draws(criterion.draws, rng))

    # ---- compiled ----

    @cached_property
    def _cost(self):  # type: ignore[no-untyped-def]
        def cost(parameters: Array, z: Array, index: Array, prior: Array) -> Array:
            outcome = self.plan.outcome(parameters, z, prior)
            branches = [lambda o, c=criterion: c.cost(self.plan, o) for criterion in self.criteria]
            return jax.lax.switch(index, branches, outcome)

        return jax.jit(jax.value_and_grad(cost), compiler_options=QUICKLY)

    @cached_property
    def _fractions(self):  # type: ignore[no-untyped-def]
        def fractions(parameters: Array, z: Array, bounds: Array) -> tuple[Array, Array]:
            trajectory = self.plan.trajectory(parameters, z)
            pairs = zip(self.applied, bounds, strict=True)
            values = jnp.stack([smooth_largest(limit, trajectory, bound) for limit, bound in pairs])
            return values, values

        def both(parameters: Array, z: Array, bounds: Array) -> tuple[Array, Array]:
            slope, value = jax.jacfwd(fractions, has_aux=True)(parameters, z, bounds)
            return value, slope

        return jax.jit(both, compiler_options=QUICKLY)

    @cached_property
    def _fine_trajectory(self):  # type: ignore[no-untyped-def]
        return jax.jit(replace(self.plan, step=self.plan.step / FINER).trajectory, compiler_options=QUICKLY)
