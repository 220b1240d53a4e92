"""Criteria by which a manoeuvre is designed; each is a cost of a planned manoeuvre, to be minimised.

The paper's (26) evaluates the motion of the base, the condition number evaluates the regressor. The other criteria
evaluate the posterior covariance given the sensors' noise, in which all unknowns other than the bodies to identify are
marginalised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import ClassVar, Protocol

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design.flight import Outcome
from bayesid.design.plan import Plan

__all__ = [
    "AOptimal",
    "ConditionNumber",
    "Criterion",
    "DOptimal",
    "EOptimal",
    "InformationGain",
    "Paper26",
    "Paper26Intended",
    "Separation",
    "covariance",
]


class Criterion(Protocol):
    """Interface of a criterion.

    Attributes
    ----------
    name : str
        Name of the criterion in design.json.
    informed : bool
        Whether the cost depends on the information of the sensors, which takes longest to compute.
    """

    name: ClassVar[str]
    informed: ClassVar[bool]

    @property
    def draws(self) -> int:
        """Number of draws of the prior over which the cost is averaged; 0 for the prior's centre alone."""
        ...

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the scalar to be minimised, differentiable by JAX."""
        ...


def covariance(plan: Plan, outcome: Outcome) -> Array:
    """Return the Laplace posterior covariance of the log-Cholesky coordinates of the bodies to identify.

    All other unknowns are marginalised. The coordinates are relative: the relative standard deviation of a mass is
    twice that of its coordinate.
    """
    return _of_bodies(plan, outcome.information + _prior(plan, outcome))


def _prior(plan: Plan, outcome: Outcome) -> Array:
    return jnp.eye(plan.unknowns.size) if outcome.prior is None else outcome.prior


def _of_bodies(plan: Plan, precision: Array) -> Array:
    identified, count = jnp.asarray(plan.bodies(), dtype=int), len(plan.unknowns.widths)
    every = plan.unknowns.widths @ _inverse(precision)[:count, :count] @ plan.unknowns.widths.T
    return every[jnp.ix_(identified, identified)]


@dataclass(frozen=True)
class Paper26:
    """The paper's (26) as printed, computed from the largest excursion of each state of the base.

    Its signed differences cancel most terms. For three states -y1^2 + y2^2 + 3 y3^2 remains, which rewards mostly the
    third state, penalises the first, and does not measure balance. It also adds metres to radians.
    """

    name: ClassVar[str] = "paper-26"
    informed: ClassVar[bool] = False
    draws: int = 0

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return minus (26)."""
        squares = _largest_squares(outcome)
        value = jnp.sum(squares)
        for triple in (squares[:3], squares[3:]):
            value = value - sum(triple[i] - triple[j] for i, j in combinations(range(3), 2))
        return -value


@dataclass(frozen=True)
class Paper26Intended:
    """Apparent intention of (26): large differences between the states increase the cost, whatever their sign.

    For three states, 3 smallest^2 + middle^2 - largest^2 remains.
    """

    name: ClassVar[str] = "paper-26-intended"
    informed: ClassVar[bool] = False
    draws: int = 0

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return minus (26) with the sizes of the differences."""
        squares = _largest_squares(outcome)
        value = jnp.sum(squares)
        for triple in (squares[:3], squares[3:]):
            value = value - sum(jnp.abs(triple[i] - triple[j]) for i, j in combinations(range(3), 2))
        return -value


@dataclass(frozen=True)
class ConditionNumber:
    """Logarithm of the condition number of the regressor (Armstrong 1989, Gautier & Khalil 1992).

    The regressor is that of the base's balance (19) along the manoeuvre. Columns are per unit of the prior's standard
    deviation, and torques are divided by the bodies' radius of gyration, so that no units are mixed.
    """

    name: ClassVar[str] = "condition-number"
    informed: ClassVar[bool] = False
    draws: int = 0

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the logarithm of the largest singular value over the smallest."""
        squares = jnp.linalg.eigvalsh(outcome.regressor.T @ outcome.regressor)
        return 0.5 * (jnp.log(squares[-1]) - jnp.log(jnp.maximum(squares[0], 1e-15 * squares[-1])))


@dataclass(frozen=True)
class DOptimal:
    """Volume of the posterior, as half the logarithm of the determinant of its covariance."""

    name: ClassVar[str] = "d-optimal"
    informed: ClassVar[bool] = True
    draws: int = 0

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return half the log-determinant."""
        return 0.5 * jnp.linalg.slogdet(covariance(plan, outcome))[1]


@dataclass(frozen=True)
class AOptimal:
    """Logarithm of the root mean square of the standard deviations of the log-Cholesky coordinates."""

    name: ClassVar[str] = "a-optimal"
    informed: ClassVar[bool] = True
    draws: int = 0

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the logarithm of the root mean square."""
        return 0.5 * jnp.log(jnp.mean(jnp.diag(covariance(plan, outcome))))


@dataclass(frozen=True)
class EOptimal:
    """Logarithm of the standard deviation of the log-Cholesky coordinates along the worst direction."""

    name: ClassVar[str] = "e-optimal"
    informed: ClassVar[bool] = True
    draws: int = 0

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the logarithm of the largest standard deviation over all directions."""
        return 0.5 * jnp.log(jnp.linalg.eigvalsh(covariance(plan, outcome))[-1])


@dataclass(frozen=True)
class InformationGain:
    """Minus the expected information gain about the bodies, averaged over their prior [nats].

    The posterior at each draw is approximated as normal (Chaloner & Verdinelli 1995, section 2.2).
    """

    name: ClassVar[str] = "information-gain"
    informed: ClassVar[bool] = True
    draws: int = 4

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return minus the gain at one draw."""
        prior = jnp.linalg.slogdet(_of_bodies(plan, _prior(plan, outcome)))[1]
        return 0.5 * (jnp.linalg.slogdet(covariance(plan, outcome))[1] - prior)


@dataclass(frozen=True)
class Separation:
    """Smallest signal-to-noise ratio of any of several rival effects, with all other unknowns marginalised.

    The other unknowns include the remaining rivals. Half the squared ratio is the expected log Bayes factor of the
    rival against all others if it acts in the direction of its amplitudes that shows least, with the size of its prior.
    For two effects of one parameter the squared ratio is lambda (1 - rho^2) of the weaker one. The model of the plan
    must contain the rivals.

    Parameters
    ----------
    rivals : tuple of str
        Labels of the effects to distinguish, at least two.
    visible : tuple of tuple of tuple of float, optional
        Orthonormal directions (k, n) of each rival's n amplitudes among which the worst is sought, by default all.
        `bayesid.design.visible_directions` finds those that a family of manoeuvres can show at all; the others are as
        small in every manoeuvre, so that a search for the best of them would decide nothing.
    """

    rivals: tuple[str, ...]
    visible: tuple[tuple[tuple[float, ...], ...], ...] | None = None
    name: ClassVar[str] = "separation"
    informed: ClassVar[bool] = True
    draws: int = 0

    def __post_init__(self) -> None:
        if len(self.rivals) < 2:
            raise InputError(
                f"{len(self.rivals)} effects to tell apart", place="design.rivals", remedy="Name at least two"
            )

    @property
    def left_out(self) -> dict[str, int]:
        """Number of directions of its amplitudes in which no manoeuvre shows a rival, by its label, where any."""
        pairs = zip(self.rivals, self.visible or (), strict=False)
        counts = {label: len(directions[0]) - len(directions) for label, directions in pairs}
        return {label: count for label, count in counts.items() if count}

    def seeing(self, shown: Sequence[Floats], least: float) -> Separation:
        """Return the criterion restricted to directions in which the rivals are shown.

        Parameters
        ----------
        shown : sequence of (n, n) arrays
            Sum of `unexplained` over some manoeuvres, for each rival.
        least : float
            Smallest noncentrality that counts; the direction that is shown best always does.
        """
        visible = []
        for matrix in shown:
            values, directions = np.linalg.eigh(matrix)
            kept = directions.T[values >= min(least, values[-1])]
            visible.append(tuple(tuple(map(float, direction)) for direction in kept))
        return replace(self, visible=tuple(visible))

    def unexplained(self, plan: Plan, outcome: Outcome) -> list[Array]:
        """Return for each rival the quadratic form of its amplitudes that is lambda (1 - rho^2), shape (n, n).

        Amplitudes are in standard deviations of their prior.
        """
        groups = [jnp.asarray(self._coordinates(plan, label), dtype=int) for label in self.rivals]
        # no prior on the rivals' amplitudes, because a rival may have any size
        free = jnp.ones(plan.unknowns.size).at[jnp.concatenate(groups)].set(0.0)
        total = outcome.information + _prior(plan, outcome) * jnp.outer(free, free) + 1e-9 * jnp.diag(1.0 - free)
        forms = []
        for group in groups:
            rest = jnp.setdiff1d(jnp.arange(plan.unknowns.size), group, size=plan.unknowns.size - len(group))
            direct = outcome.information[jnp.ix_(group, group)]
            cross = outcome.information[jnp.ix_(group, rest)]
            forms.append(direct - cross @ _inverse(total[jnp.ix_(rest, rest)]) @ cross.T)
        return forms

    def noncentrality(self, plan: Plan, outcome: Outcome) -> Array:
        """Return lambda (1 - rho^2) of each rival in its worst direction, at the size of its prior, shape (rivals,)."""
        forms = self.unexplained(plan, outcome)
        if self.visible is not None:
            bases = [jnp.asarray(directions) for directions in self.visible]
            forms = [basis @ form @ basis.T for basis, form in zip(bases, forms, strict=True)]
        return jnp.stack([jnp.linalg.eigvalsh(form)[0] for form in forms])

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return minus the logarithm of the smallest square root of a noncentrality."""
        return -0.5 * jnp.log(jnp.maximum(jnp.min(self.noncentrality(plan, outcome)), 1e-12))

    def _coordinates(self, plan: Plan, label: str) -> list[int]:
        coordinates = list(plan.effect(label))
        if not coordinates:
            raise InputError(
                f"the plan's model has no effect {label!r} with parameters",
                place="design.rivals",
                remedy="Extend the model by the rivals",
            )
        return coordinates


def _largest_squares(outcome: Outcome) -> Array:
    return jnp.max(jnp.abs(outcome.trajectory.excursion), axis=0) ** 2


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a positive-definite matrix whose rows differ in scale."""
    scale = 1.0 / jnp.sqrt(jnp.diag(matrix))
    return jnp.linalg.inv(matrix * jnp.outer(scale, scale)) * jnp.outer(scale, scale)
