"""Design problem: a plan, limits and criteria, compiled once, with exact gradients."""

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
"""Options of XLA with which compilation is a third faster and the compiled code is as fast."""

FINER = 8
"""Ratio of the optimiser's time step to the one at which the limits of a result are checked."""

_SHARED = ("_cost", "_fractions", "_fine_trajectory")
"""Names of the compiled functions that depend neither on bounds nor on prior knowledge, both of which are arguments."""


@dataclass(frozen=True)
class Reached:
    """Limit with the largest value that a manoeuvre reaches.

    Parameters
    ----------
    name : str
        Name of the limit.
    limit : float
        Bound of the limited quantity, in the unit.
    largest : float
        Largest value along the manoeuvre, in the unit.
    unit : str
        Unit of the quantity.
    """

    name: str
    limit: float
    largest: float
    unit: str

    @property
    def active(self) -> bool:
        """True if the limit restricts the manoeuvre."""
        return self.largest > ACTIVE * self.limit

    @property
    def kept(self) -> bool:
        """True if the manoeuvre keeps the limit."""
        return self.largest <= self.limit


@dataclass(frozen=True)
class Known:
    """Knowledge from earlier manoeuvres, a normal distribution of the unknowns' coordinates.

    Parameters
    ----------
    centre : (n,) array
        Mean of the coordinates.
    precision : (n, n) array
        Inverse covariance of the coordinates.
    """

    centre: Floats
    precision: Floats


@dataclass(frozen=True)
class Problem:
    """Choice of a manoeuvre from a family, by criteria and within limits.

    Parameters
    ----------
    plan : Plan
        Family of manoeuvres.
    limits : Limits
        Limits that a manoeuvre must keep.
    criteria : sequence of Criterion
        Criteria that may be evaluated; they share one compiled simulation.
    known : Known, optional
        Knowledge in place of the prior of the plan's model.
    """

    plan: Plan
    limits: Limits
    criteria: tuple[Criterion, ...]
    known: Known | None = None

    @cached_property
    def applied(self) -> tuple[Limit, ...]:
        """Limits that apply to the robot."""
        return self.limits.of(self.plan.model.robot)

    @cached_property
    def bounds(self) -> Floats:
        """Bound of every limit, shape (m,)."""
        return np.array([limit.bound for limit in self.applied])

    def with_limits(self, limits: Limits) -> Problem:
        """Return the problem with other bounds of the same limits, without a new compilation."""
        new = replace(self, limits=limits)
        if [limit.name for limit in new.applied] != [limit.name for limit in self.applied]:
            raise InputError("other limits apply than before", place="limits", remedy="Change bounds only")
        return self._sharing(new)

    def knowing(self, known: Known) -> Problem:
        """Return the problem with the knowledge from earlier manoeuvres, without a new compilation."""
        return self._sharing(replace(self, known=known))

    def _sharing(self, other: Problem) -> Problem:
        other.__dict__.update({key: getattr(self, key) for key in _SHARED})
        return other

    @cached_property
    def centre(self) -> Floats:
        """Centre of the prior in the unknowns' coordinates, shape (n,)."""
        return np.zeros(self.plan.unknowns.size) if self.known is None else self.known.centre

    @cached_property
    def precision(self) -> Floats:
        """Precision of the prior in the unknowns' coordinates, shape (n, n)."""
        return np.eye(self.plan.unknowns.size) if self.known is None else self.known.precision

    def draws(self, count: int, rng: np.random.Generator) -> Floats:
        """Return draws of the bodies from their prior, other unknowns at its centre, shape (count, n)."""
        bodies = 10 * len(self.plan.model.priors)
        points = np.tile(self.centre, (count, 1))
        covariance = np.linalg.inv(self.precision)[:bodies, :bodies]
        points[:, :bodies] += rng.normal(size=(count, bodies)) @ np.linalg.cholesky(covariance).T
        return points

    def cost(self, criterion: Criterion, parameters: Floats, points: Sequence[Floats] = ()) -> tuple[float, Floats]:
        """Return a criterion and its gradient, averaged over points of the unknowns, by default the prior's centre."""
        index = self.criteria.index(criterion)
        pairs = [self._cost(parameters, z, index, self.precision) for z in (points or [self.centre])]
        return float(np.mean([pair[0] for pair in pairs])), np.mean([np.asarray(pair[1]) for pair in pairs], axis=0)

    def costs(self, parameters: Floats) -> dict[str, float]:
        """Return every criterion at the prior's centre."""
        return {criterion.name: self.cost(criterion, parameters)[0] for criterion in self.criteria}

    def fractions(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Return the used fractions of all limits, shape (m,), and their Jacobian, shape (m, n).

        The fractions are smooth functions of the parameters and never smaller than the true ones.
        """
        key = np.asarray(parameters, dtype=float).tobytes()
        if key not in self._latest:  # the optimiser requests value and slope at one point in two calls
            value, slope = self._fractions(parameters, self.centre, self.bounds)
            self._latest.clear()
            self._latest[key] = (np.asarray(value), np.asarray(slope))
        return self._latest[key]

    @cached_property
    def _latest(self) -> dict[bytes, tuple[Floats, Floats]]:
        """Latest result of `fractions`, by the parameters."""
        return {}

    def reached(self, parameters: Floats) -> list[Reached]:
        """Return the largest values of all limited quantities, on a grid `FINER` times finer than the optimiser's."""
        trajectory = self.trajectory(parameters)
        return [
            Reached(limit.name, limit.bound, float(limit.largest(trajectory)), limit.unit) for limit in self.applied
        ]

    def largest(self, parameters: Floats, points: Floats, limits: Sequence[Limit]) -> Floats:
        """Return the largest values (k, limits) of some limited quantities at points (k, n) of the unknowns."""
        rows = []
        for z in points:
            trajectory = self.trajectory(parameters, z)
            rows.append([float(limit.largest(trajectory)) for limit in limits])
        return np.array(rows).reshape(len(points), len(limits))

    def trajectory(self, parameters: Floats, z: Floats | None = None) -> Trajectory:
        """Return the motion of the robot on the fine grid, by default at the prior's centre."""
        return jax.tree.map(np.asarray, self._fine_trajectory(parameters, self.centre if z is None else z))

    def points(self, criterion: Criterion, rng: np.random.Generator) -> list[Floats]:
        """Return draws of the prior over which a criterion is averaged, an empty list if it uses the centre alone."""
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
