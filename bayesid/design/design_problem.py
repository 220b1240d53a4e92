"""Design problem: a plan, limits and criteria, compiled once, with exact gradients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import cached_property
from threading import get_ident
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid._math.double_precision import in_double_precision
from bayesid._math.kept_jit import QuickJit
from bayesid.design.criteria import Criterion
from bayesid.design.encoder_information import Encoder, encoder_directions, likely_directions, position_noise
from bayesid.design.flight import Flight, Outcome
from bayesid.design.motion_limits import ACTIVE, Limit, Limits, smooth_largest
from bayesid.design.plan import Plan
from bayesid.design.trajectory import Trajectory

__all__ = ["FINER", "Known", "Problem", "Reached"]

FINER = 8
"""Ratio of the optimiser's time step to the one at which the limits of a result are checked."""

# names of the compiled functions that depend neither on bounds nor on prior knowledge, both of which are arguments
_SHARED = ("_informed_cost", "_motion_cost", "_fractions", "_fine_trajectory", "_information")


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
        Limits that a manoeuvre must satisfy.
    criteria : sequence of Criterion
        Criteria that may be evaluated; they share one compiled simulation.
    known : Known, optional
        Knowledge in place of the prior of the plan's model.
    shares : tuple of float, optional
        Fraction of each of the limits' bounds that the optimiser may use at its instants, by default all.
    """

    plan: Plan
    limits: Limits
    criteria: tuple[Criterion, ...]
    known: Known | None = None
    shares: tuple[float, ...] | None = None

    @cached_property
    def applied(self) -> tuple[Limit, ...]:
        """Limits that apply to the robot."""
        return self.limits.of(self.plan.model.robot)

    @cached_property
    def bounds(self) -> Floats:
        """Bound of every limit at the optimiser's instants, shape (m,)."""
        bounds = np.array([limit.bound for limit in self.applied])
        return bounds if self.shares is None else bounds * self.shares

    @cached_property
    def explained(self) -> Floats:
        """Directions of the readings that errors of the encoders could explain (`encoder_directions`), at rest."""
        parameters, samples = self.plan.family.centre, self.plan.samples
        if not any(self.plan.encoder_sigma):
            return encoder_directions(self.plan, parameters, np.zeros((len(samples), 3)))
        fine = self.trajectory(parameters)
        rate = np.stack([np.interp(samples, fine.time, fine.rate[:, axis]) for axis in range(3)], axis=1)
        return encoder_directions(self.plan, parameters, rate)

    @cached_property
    @in_double_precision
    def limit_of_fraction(self) -> Integers:
        """Index of the limit to which each of `fractions` belongs."""
        shape = jax.eval_shape(
            lambda p: Flight(self.plan, p, jnp.asarray(self.centre)).trajectory()[1:], jnp.zeros(self.plan.family.size)
        )
        empty = Trajectory(self.plan.instants, *(jnp.zeros(part.shape) for part in shape))
        counts = [len(smooth_largest(limit, empty, limit.bound)) for limit in self.applied]
        return np.repeat(np.arange(len(counts)), counts)

    @cached_property
    def shrinkable(self) -> NDArray[np.bool_]:
        """Whether a smaller motion reduces each of `fractions`."""
        return np.array([limit.shrinks for limit in self.applied])[self.limit_of_fraction]

    def __getstate__(self) -> dict[str, Any]:
        """Return what the problem is made of, without anything compiled."""
        return {part.name: getattr(self, part.name) for part in fields(self)}

    def with_limits(self, limits: Limits) -> Problem:
        """Return the problem with other bounds of the same limits, without a new compilation."""
        new = replace(self, limits=limits)
        if [limit.name for limit in new.applied] != [limit.name for limit in self.applied]:
            raise InputError(
                "the set of applicable limits differs from before", place="limits", remedy="Change bounds only"
            )
        return self._sharing(new)

    def using(self, shares: Floats) -> Problem:
        """Return the problem with a fraction of each bound, shape (m,), without a new compilation."""
        return self._sharing(replace(self, shares=tuple(float(share) for share in shares)))

    def knowing(self, known: Known) -> Problem:
        """Return the problem with the knowledge from earlier manoeuvres, without a new compilation."""
        return self._sharing(replace(self, known=known))

    def judged_by(self, criteria: Sequence[Criterion]) -> Problem:
        """Return the problem with other criteria, whose costs alone are compiled anew."""
        new = replace(self, criteria=tuple(criteria))
        new.__dict__.update({key: getattr(self, key) for key in _SHARED if not key.endswith("cost")})
        return new

    def with_encoder(self, encoder: Encoder) -> Problem:
        """Return the problem with the noise of the encoders, without a new compilation."""
        joints = tuple(joint.name for joint in self.plan.model.robot.joints)
        sigma = tuple(float(value) for value in position_noise(encoder, joints))
        if sigma == self.plan.encoder_sigma:
            return self
        return self._sharing(replace(self, plan=replace(self.plan, encoder_sigma=sigma)))

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

    def compile(self) -> None:
        """Compile all functions of the problem at once, each in a thread of its own; at most once.

        They are traced one after the other, what takes the longest to compile first: threads that trace at the same
        time hold each other up, and write code that is not found among what earlier runs kept.
        """
        if "_latest" in self.__dict__:
            return
        parameters, likely = self.plan.family.centre, likely_directions(self.plan)
        costs: list[QuickJit] = [self._informed_cost for one in self.criteria if one.informed][:1]
        costs += [self._motion_cost for one in self.criteria if not one.informed][:1]
        arguments: tuple[Any, ...] = (parameters, self.centre, 0, self.precision, likely)
        pending: list[Future[Any]] = []
        with ThreadPoolExecutor() as pool:
            for cost in costs:
                cost.trace(*arguments)
                pending.append(pool.submit(cost, *arguments))
            self._fractions.trace(parameters, self.centre, self.bounds)
            pending.append(pool.submit(self.fractions, parameters))
            self._fine_trajectory.trace(parameters, self.centre)
            pending.append(pool.submit(lambda: (self.trajectory(parameters), self.explained)))
            for future in pending:
                future.result()
        if self.explained.shape != likely.shape:
            for cost in costs:
                cost(parameters, self.centre, 0, self.precision, self.explained)

    def draws(self, count: int, rng: np.random.Generator) -> Floats:
        """Return draws of the bodies from their prior, other unknowns at its centre, shape (count, n).

        Parameters
        ----------
        count : int
            Number of draws.
        rng : numpy.random.Generator
            Source of the draws.
        """
        bodies = 10 * len(self.plan.model.priors)
        points = np.tile(self.centre, (count, 1))
        covariance = np.linalg.inv(self.precision)[:bodies, :bodies]
        points[:, :bodies] += rng.normal(size=(count, bodies)) @ np.linalg.cholesky(covariance).T
        return points

    def cost(self, criterion: Criterion, parameters: Floats, points: Sequence[Floats] = ()) -> tuple[float, Floats]:
        """Return a criterion and its gradient, averaged over points of the unknowns, by default the prior's centre.

        Parameters
        ----------
        criterion : Criterion
            One of the problem's criteria.
        parameters : (n,) array
            Motion in its family.
        points : sequence of (N,) arrays
            Points of the unknowns, by default the prior's centre.
        """
        alike = [one for one in self.criteria if one.informed is criterion.informed]
        compiled = self._informed_cost if criterion.informed else self._motion_cost
        index = alike.index(criterion)
        pairs = [compiled(parameters, z, index, self.precision, self.explained) for z in (points or [self.centre])]
        return float(np.mean([pair[0] for pair in pairs])), np.mean([np.asarray(pair[1]) for pair in pairs], axis=0)

    def costs(self, parameters: Floats, points: Mapping[str, list[Floats]] = MappingProxyType({})) -> dict[str, float]:
        """Return the values of all criteria by name, each averaged over its points or at the prior's centre.

        Parameters
        ----------
        parameters : (n,) array
            Motion in its family.
        points : mapping of str to list of (N,) arrays
            Points of the unknowns by the name of a criterion.
        """
        return {
            criterion.name: self.cost(criterion, parameters, points.get(criterion.name, ()))[0]
            for criterion in self.criteria
        }

    @in_double_precision
    def shown(self, parameters: Floats) -> dict[str, list[Floats]]:
        """Return what a manoeuvre shows at the prior's centre, by the name of the criterion that asks for it.

        Parameters
        ----------
        parameters : (n,) array
            Motion in its family.
        """
        information = self._information(parameters, self.centre, self.explained)
        flight = Flight(self.plan, jnp.asarray(parameters), jnp.asarray(self.centre))
        outcome = Outcome(flight, information, jnp.asarray(self.precision))
        return {
            criterion.name: [np.asarray(part) for part in criterion.shown(self.plan, outcome)]
            for criterion in self.criteria
        }

    def fractions(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Return the used fractions of all limits, shape (m,), and their Jacobian, shape (m, n).

        The fractions are smooth functions of the parameters and never smaller than the true ones.
        """
        key = np.asarray(parameters, dtype=float).tobytes()
        thread = get_ident()  # the optimiser of a thread requests value and slope at one point in two calls
        latest = self._latest.get(thread)
        if latest is None or latest[0] != key:
            value, slope = self._fractions(parameters, self.centre, self.bounds)
            latest = self._latest[thread] = (key, (np.asarray(value), np.asarray(slope)))
        return latest[1]

    @cached_property
    def _latest(self) -> dict[int, tuple[bytes, tuple[Floats, Floats]]]:
        """Latest parameters and result of `fractions`, by thread."""
        return {}

    def reached(self, parameters: Floats) -> list[Reached]:
        """Return the largest values of all limited quantities, on a grid `FINER` times finer than the optimiser's."""
        trajectory = self.trajectory(parameters)
        return [
            Reached(limit.name, limit.bound, float(limit.largest(trajectory)), limit.unit) for limit in self.applied
        ]

    def largest(self, parameters: Floats, points: Floats, limits: Sequence[Limit]) -> Floats:
        """Return the largest values (k, limits) of some limited quantities at points (k, n) of the unknowns.

        Parameters
        ----------
        parameters : (n,) array
            Motion in its family.
        points : (k, N) array
            Points of the unknowns.
        limits : sequence of Limit
            Limits of the quantities.
        """
        rows = []
        for z in points:
            trajectory = self.trajectory(parameters, z)
            rows.append([float(limit.largest(trajectory)) for limit in limits])
        return np.array(rows).reshape(len(points), len(limits))

    def trajectory(self, parameters: Floats, z: Floats | None = None) -> Trajectory:
        """Return the motion of the robot on the fine grid, by default at the prior's centre.

        Parameters
        ----------
        parameters : (n,) array
            Motion in its family.
        z : (N,) array, optional
            Point of the unknowns, by default the prior's centre.
        """
        return jax.tree.map(np.asarray, self._fine_trajectory(parameters, self.centre if z is None else z))

    def points(self, criterion: Criterion, rng: np.random.Generator) -> list[Floats]:
        """Return draws of the prior over which a criterion is averaged, an empty list if it uses the centre alone.

        Parameters
        ----------
        criterion : Criterion
            Criterion that states its number of draws.
        rng : numpy.random.Generator
            Source of the draws.
        """
        return list(self.draws(criterion.draws, rng))

    # ---- compiled ----

    @cached_property
    def _informed_cost(self) -> QuickJit:
        """Criteria that depend on the information, compiled."""

        def cost(parameters: Array, z: Array, index: Array, prior: Array, explained: Array) -> Array:
            flight = Flight(self.plan, parameters, z)
            information = flight.information(explained)
            flight.prepare()
            return self._chosen(True, flight, index, information, prior)

        return QuickJit(jax.value_and_grad(cost))

    @cached_property
    def _motion_cost(self) -> QuickJit:
        """All other criteria, compiled."""

        def cost(parameters: Array, z: Array, index: Array, prior: Array, explained: Array) -> Array:
            flight = Flight(self.plan, parameters, z)
            flight.prepare()
            return self._chosen(False, flight, index, jnp.zeros_like(prior), prior)

        return QuickJit(jax.value_and_grad(cost))

    def _chosen(self, informed: bool, flight: Flight, index: Array, information: Array, prior: Array) -> Array:
        """Return the cost by one of the criteria that depend on the information, or of the others."""

        def branch(criterion: Criterion) -> Callable[[Array], Array]:
            return lambda gained: criterion.cost(self.plan, Outcome(flight, gained, prior))

        branches = [branch(criterion) for criterion in self.criteria if criterion.informed is informed]
        return jax.lax.switch(index, branches, information)

    @cached_property
    def _information(self) -> QuickJit:
        """Information about all unknowns, compiled."""
        return QuickJit(lambda parameters, z, explained: Flight(self.plan, parameters, z).information(explained))

    @cached_property
    def _fractions(self) -> QuickJit:
        def fractions(parameters: Array, z: Array, bounds: Array) -> tuple[Array, Array]:
            flight = Flight(self.plan, parameters, z)
            (time, *motion), (_, *slopes) = flight.trajectory_and_slopes()

            def values(*motion: Array) -> Array:
                trajectory = Trajectory(time, *motion)
                pairs = zip(self.applied, bounds, strict=True)
                return jnp.concatenate([smooth_largest(limit, trajectory, bound) for limit, bound in pairs])

            def along(*direction: Array) -> Array:
                return jax.jvp(values, tuple(motion), direction)[1]

            return values(*motion), jax.vmap(along, -1, -1)(*slopes)

        return QuickJit(fractions)

    @cached_property
    def _fine_trajectory(self) -> QuickJit:
        fine = replace(self.plan, step=self.plan.step / FINER)
        return QuickJit(lambda parameters, z: Flight(fine, parameters, z).trajectory())
