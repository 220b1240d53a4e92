"""Criteria by which a manoeuvre is designed; each is a cost of a planned manoeuvre, to be minimised.

The paper's (26) evaluates the motion of the base, the condition number evaluates the regressor. The other criteria
evaluate the posterior covariance given the sensors' noise, in which all unknowns other than the bodies to identify are
marginalised. A criterion of a user's own is one class, decorated with `register_criterion` so that study files can name
it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any, ClassVar, TypeVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design.decision_rate import DecisionRate
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
    "covariance",
    "known_criteria",
    "named_criteria",
    "prior_of",
    "register_criterion",
]

_REGISTER: dict[str, type[Criterion]] = {}

C = TypeVar("C", bound="type[Criterion]")


@dataclass(frozen=True)
class Criterion:
    """Cost of a planned manoeuvre; a subclass sets the attributes and overrides `cost`.

    Parameters
    ----------
    draws : int
        Number of draws of the prior over which the cost is averaged; 0 for the prior's centre alone.

    Attributes
    ----------
    name : str
        Name of the criterion in study files, reports and design.json.
    meaning : str
        Description of the criterion, as printed in reports.
    informed : bool
        Whether the cost depends on the information of the sensors, which takes longest to compute.
    usual : bool
        Whether a study that names no criteria designs by this one.
    compares_rivals : bool
        Whether the criterion takes ``rivals``, the effects to distinguish that a study names under ``design.rivals``.
    rivals : tuple of str
        Labels of the effects that the criterion distinguishes.
    starts_from : tuple of str
        Names of criteria whose best manoeuvres are among the starts of a search by this one.
    """

    name: ClassVar[str] = ""
    meaning: ClassVar[str] = "A user-defined criterion."
    informed: ClassVar[bool] = True
    usual: ClassVar[bool] = False
    compares_rivals: ClassVar[bool] = False
    starts_from: ClassVar[tuple[str, ...]] = ()
    draws: int = field(default=0, kw_only=True)

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the scalar to be minimised, differentiable by JAX.

        Parameters
        ----------
        plan : Plan
            Model, family and unknowns of the manoeuvre.
        outcome : Outcome
            Motion of the robot, information of the sensors and regressor.
        """
        raise NotImplementedError

    @property
    def rivals(self) -> tuple[str, ...]:
        """Labels of the effects that the criterion distinguishes, by default none."""
        return ()

    @property
    def adaptable(self) -> bool:
        """Whether the criterion is still to be adapted to what the manoeuvres of a family can show."""
        return False

    def shown(self, plan: Plan, outcome: Outcome) -> list[Array]:
        """Return what a manoeuvre shows, arrays whose sums over some manoeuvres `adapted` takes; by default nothing.

        Parameters
        ----------
        plan, outcome
            As of `cost`.
        """
        return []

    def adapted(self, plan: Plan, shown: Sequence[Floats], rng: np.random.Generator) -> Criterion:
        """Return the criterion adapted to what some manoeuvres of a family show, by default itself."""
        return self

    def expected(self, plan: Plan, shown: Sequence[Floats], rng: np.random.Generator) -> dict[str, DecisionRate]:
        """Return the expected rate of decisions for each rival from what a manoeuvre shows, by default none."""
        return {}


def register_criterion(criterion: C) -> C:
    """Make a criterion known to study files by its name; a class decorator."""
    if not criterion.name:
        raise InputError(f"criterion {criterion.__name__} has no name", remedy="Set the class attribute `name`")
    _REGISTER[criterion.name] = criterion
    return criterion


def known_criteria() -> dict[str, type[Criterion]]:
    """Return all registered criteria by their names, in the order of registration."""
    return dict(_REGISTER)


def named_criteria(
    names: Sequence[str] | None, rivals: Sequence[str] = (), options: Mapping[str, Mapping[str, Any]] | None = None
) -> tuple[Criterion, ...]:
    """Return the criteria that a study names.

    Parameters
    ----------
    names : sequence of str or None
        Names of registered criteria; None for the usual ones and, if there are rivals, those that compare them.
    rivals : sequence of str
        Labels of the effects to distinguish.
    options : mapping of str to mapping, optional
        Parameters of the criteria, by the name of the criterion.

    Raises
    ------
    InputError
        If a name is unknown, or a criterion does not take its parameters.
    """
    if names is None:
        names = [key for key, kind in _REGISTER.items() if kind.usual or (kind.compares_rivals and rivals)]
    return tuple(
        _made(name, f"design.criteria #{number}", tuple(rivals), (options or {}).get(name, {}))
        for number, name in enumerate(names, start=1)
    )


def _made(name: str, place: str, rivals: tuple[str, ...], options: Mapping[str, Any]) -> Criterion:
    if name not in _REGISTER:
        remedy = f"Give one of {', '.join(_REGISTER)}, or name your file under model.plugins"
        raise InputError(f"got {name!r}", place=place, remedy=remedy)
    kind = _REGISTER[name]
    given: dict[str, Any] = {**options, "rivals": rivals} if kind.compares_rivals else {**options}
    try:
        return kind(**given)
    except TypeError as error:
        remedy = "Give the parameters of the criterion"
        raise InputError(f"{name!r} cannot be made: {error}", place=f"design.options.{name}", remedy=remedy) from error


def covariance(plan: Plan, outcome: Outcome) -> Array:
    """Return the Laplace posterior covariance of the log-Cholesky coordinates of the bodies to identify.

    All other unknowns are marginalised. The coordinates are relative: the relative standard deviation of a mass is
    twice that of its coordinate.

    Parameters
    ----------
    plan : Plan
    outcome : Outcome
        Outcome with information and prior of all unknowns, (n, n) each.
    """
    return _of_bodies(plan, outcome.information + prior_of(plan, outcome))


def prior_of(plan: Plan, outcome: Outcome) -> Array:
    """Return the precision of the unknowns' coordinates before the manoeuvre, shape (n, n)."""
    return jnp.eye(plan.unknowns.size) if outcome.prior is None else outcome.prior


def _of_bodies(plan: Plan, precision: Array) -> Array:
    identified, count = jnp.asarray(plan.bodies(), dtype=int), len(plan.unknowns.widths)
    every = plan.unknowns.widths @ _inverse(precision)[:count, :count] @ plan.unknowns.widths.T
    return every[jnp.ix_(identified, identified)]


def _inverse(matrix: Array) -> Array:
    """Return the inverse of a positive-definite matrix whose rows differ in scale."""
    scale = 1.0 / jnp.sqrt(jnp.diag(matrix))
    return jnp.linalg.inv(matrix * jnp.outer(scale, scale)) * jnp.outer(scale, scale)


@register_criterion
@dataclass(frozen=True)
class Paper26(Criterion):
    """Criterion (26) of the paper as printed, a reference for the other criteria.

    It is computed from the largest excursions y1, y2, y3 of the base along each axis, for position and attitude.
    Because the printed differences have signs, most terms cancel: −y1² + y2² + 3 y3² is maximised. This rewards
    the third axis and penalises the first, instead of balancing the three. Metres and radians are added.
    """

    name = "paper-26"
    meaning = (
        "Criterion (26) of the paper as printed, computed from the largest excursions y1, y2, y3 of the base along "
        "each axis, for position and attitude. Because the printed differences have signs, most terms cancel: "
        "−y1² + y2² + 3 y3² is maximised. This rewards the third axis and penalises the first, instead of balancing "
        "the three. Metres and radians are added."
    )
    informed = False
    usual = True

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return minus (26)."""
        squares = jnp.max(jnp.abs(outcome.trajectory.excursion), axis=0) ** 2
        value = jnp.sum(squares)
        for triple in (squares[:3], squares[3:]):
            value = value - sum(self._weighed(triple[i] - triple[j]) for i, j in combinations(range(3), 2))
        return -value

    @staticmethod
    def _weighed(difference: Array) -> Array:
        return difference


@register_criterion
@dataclass(frozen=True)
class Paper26Intended(Paper26):
    """Apparent intention of (26): unequal excursions along the three axes increase the cost, whatever the sign.

    With the excursions sorted by size, 3 smallest² + middle² − largest² is maximised.
    """

    name = "paper-26-intended"
    meaning = (
        "The apparent intention of (26): the squares of the excursions minus the magnitudes of the differences between "
        "these squares, so that unequal excursions increase the cost, whatever the sign."
    )
    usual = False

    @staticmethod
    def _weighed(difference: Array) -> Array:
        return jnp.abs(difference)


@register_criterion
@dataclass(frozen=True)
class ConditionNumber(Criterion):
    """Logarithm of the condition number of the regressor (Armstrong 1989, Gautier & Khalil 1992).

    The regressor is that of the base's balance (19) along the manoeuvre. Columns are per unit of the prior's standard
    deviation, and torques are divided by the bodies' radius of gyration, so that no units are mixed.
    """

    name = "condition-number"
    meaning = (
        "The smallest condition number of the regressor of the base's force balance, columns per unit of the prior's "
        "width, torques over the radius of gyration."
    )
    informed = False
    usual = True

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the logarithm of the largest singular value over the smallest."""
        squares = jnp.linalg.eigvalsh(outcome.regressor.T @ outcome.regressor)
        return 0.5 * (jnp.log(squares[-1]) - jnp.log(jnp.maximum(squares[0], 1e-15 * squares[-1])))


@register_criterion
@dataclass(frozen=True)
class DOptimal(Criterion):
    """Volume of the posterior, as half the logarithm of the determinant of its covariance."""

    name = "d-optimal"
    meaning = "The smallest volume of the posterior: the determinant of its covariance."
    usual = True

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return half the log-determinant."""
        return 0.5 * jnp.linalg.slogdet(covariance(plan, outcome))[1]


@register_criterion
@dataclass(frozen=True)
class AOptimal(Criterion):
    """Logarithm of the root mean square of the standard deviations of the log-Cholesky coordinates."""

    name = "a-optimal"
    meaning = "The smallest mean variance of the log-Cholesky coordinates of the bodies."
    usual = True

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the logarithm of the root mean square."""
        return 0.5 * jnp.log(jnp.mean(jnp.diag(covariance(plan, outcome))))


@register_criterion
@dataclass(frozen=True)
class EOptimal(Criterion):
    """Logarithm of the standard deviation of the log-Cholesky coordinates along the worst direction."""

    name = "e-optimal"
    meaning = "The smallest standard deviation along the least-known direction."
    usual = True

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return the logarithm of the largest standard deviation over all directions."""
        return 0.5 * jnp.log(jnp.linalg.eigvalsh(covariance(plan, outcome))[-1])


@register_criterion
@dataclass(frozen=True)
class InformationGain(Criterion):
    """Minus the expected information gain about the bodies, averaged over their prior [nats].

    The posterior at each draw is approximated as normal (Chaloner & Verdinelli 1995, section 2.2).
    """

    name = "information-gain"
    meaning = (
        "The largest expected information gain on the bodies, averaged over draws of their prior instead of evaluated "
        "at its centre."
    )
    usual = True
    draws: int = field(default=4, kw_only=True)

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return minus the gain at one draw."""
        prior = jnp.linalg.slogdet(_of_bodies(plan, prior_of(plan, outcome)))[1]
        return 0.5 * (jnp.linalg.slogdet(covariance(plan, outcome))[1] - prior)
