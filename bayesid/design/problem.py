"""A design problem: a plan, limits and criteria, compiled once, with exact gradients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid.arrays import Floats
from bayesid.design.criteria import Criterion
from bayesid.design.limits import ACTIVE, Limit, Limits, smooth_largest
from bayesid.design.planned import Plan, Trajectory
from bayesid.model import Manoeuvre
from bayesid.motion import sample_joints
from bayesid.posterior import Posterior
from bayesid.recording import Recording
from bayesid.simulation import blank_channels

__all__ = ["FINER", "Problem", "Reached"]

FINER = 8
"""How much finer than the optimiser's grid the limits of a result are checked."""


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
class Problem:
    """A family of manoeuvres to choose from.

    Parameters
    ----------
    plan : Plan
    limits : Limits
    criteria : sequence of Criterion
        All that will be asked for: they share one compiled simulation.
    """

    plan: Plan
    limits: Limits
    criteria: tuple[Criterion, ...]

    @cached_property
    def applied(self) -> tuple[Limit, ...]:
        """The limits that apply."""
        return self.limits.of(self.plan.model.robot)

    @cached_property
    def centre(self) -> Floats:
        """The prior's centre, in the unknowns' coordinates."""
        return np.zeros(self.plan.unknowns.size)

    @cached_property
    def resting(self) -> Posterior:
        """Return the posterior of the centre of the family, whose compiled functions serve those of all manoeuvres."""
        plan, motion = self.plan, self.plan.family.motion(self.plan.family.centre)
        time = np.linspace(0.0, plan.family.duration, len(plan.samples))
        channels = sample_joints(motion, plan.model.robot, time) | blank_channels(plan.model.sensors, len(time))
        start = Manoeuvre(Recording("rest", None, time, channels), motion, plan.attitude, plan.attitude_sigma)
        return Posterior(plan.model, [start])

    def cost(self, criterion: Criterion, parameters: Floats, points: Sequence[Floats] = ()) -> tuple[float, Floats]:
        """Return a criterion and its gradient, averaged over points of the unknowns (the prior's centre if none)."""
        index = self.criteria.index(criterion)
        pairs = [self._cost(parameters, z, index) for z in (points or [self.centre])]
        return float(np.mean([pair[0] for pair in pairs])), np.mean([np.asarray(pair[1]) for pair in pairs], axis=0)

    def costs(self, parameters: Floats) -> dict[str, float]:
        """Return every criterion at the prior's centre."""
        return {criterion.name: self.cost(criterion, parameters)[0] for criterion in self.criteria}

    def fractions(self, parameters: Floats) -> tuple[Floats, Floats]:
        """Return how much of every limit is used, shape (m,), smooth and never too small; and its Jacobian (m, n)."""
        key = np.asarray(parameters, dtype=float).tobytes()
        if key not in self._latest:  # the optimiser asks for value and slope of one point one after the other
            value, slope = self._fractions(parameters, self.centre)
            self._latest.clear()
            self._latest[key] = (np.asarray(value), np.asarray(slope))
        return self._latest[key]

    @cached_property
    def _latest(self) -> dict[bytes, tuple[Floats, Floats]]:
        """The fractions asked for last."""
        return {}

    def reached(self, parameters: Floats) -> list[Reached]:
        """Check every limit on a grid `FINER` times finer than the optimiser's."""
        largest = np.asarray(self._finely(parameters, self.centre)[1])
        return self._reached(largest)

    def reached_at(self, parameters: Floats, points: Floats) -> Floats:
        """Largest value of every limit for many points of the unknowns, shape (k, n) -> (k, m)."""
        return np.stack([np.asarray(self._finely(parameters, z)[1]) for z in points])

    def trajectory(self, parameters: Floats, z: Floats | None = None) -> Trajectory:
        """Return what the robot does, on the fine grid."""
        return jax.tree.map(np.asarray, self._finely(parameters, self.centre if z is None else z)[0])

    def points(self, criterion: Criterion, rng: np.random.Generator) -> list[Floats]:
        """Draw points of the prior of all bodies to average a criterion over; none if it looks at the centre alone."""
        bodies = 10 * len(self.plan.model.priors)
        points = np.zeros((criterion.draws, self.plan.unknowns.size))
        points[:, :bodies] = rng.normal(size=(criterion.draws, bodies))
        return list(points)

    def _reached(self, largest: Floats) -> list[Reached]:
        return [
            Reached(limit.name, limit.bound, float(value), limit.unit)
            for limit, value in zip(self.applied, largest, strict=True)
        ]

    # ---- compiled ----

    @cached_property
    def _cost(self):  # type: ignore[no-untyped-def]
        def cost(parameters: Array, z: Array, index: Array) -> Array:
            outcome = self.plan.outcome(parameters, z)
            branches = [lambda o, c=criterion: c.cost(self.plan, o) for criterion in self.criteria]
            return jax.lax.switch(index, branches, outcome)

        return jax.jit(jax.value_and_grad(cost))

    @cached_property
    def _fractions(self):  # type: ignore[no-untyped-def]
        def fractions(parameters: Array, z: Array) -> tuple[Array, Array]:
            trajectory = self.plan.trajectory(parameters, z)
            values = jnp.stack([smooth_largest(limit, trajectory) for limit in self.applied])
            return values, values

        def both(parameters: Array, z: Array) -> tuple[Array, Array]:
            slope, value = jax.jacfwd(fractions, has_aux=True)(parameters, z)
            return value, slope

        return jax.jit(both)

    @cached_property
    def _finely(self):  # type: ignore[no-untyped-def]
        fine = replace(self.plan, step=self.plan.step / FINER)

        def judged(parameters: Array, z: Array) -> tuple[Trajectory, Array]:
            trajectory = fine.trajectory(parameters, z)
            return trajectory, jnp.stack([limit.largest(trajectory) for limit in self.applied])

        return jax.jit(judged)
