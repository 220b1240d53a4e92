"""Criterion that distinguishes rival effects: the expected probability of a decision between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.scipy.special import logsumexp

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.design.criteria import Criterion, DOptimal, prior_of, register_criterion
from bayesid.design.decision_rate import DecisionRate, RivalDraws, decided_margins, decision_margins, smooth_rates
from bayesid.design.flight import Outcome
from bayesid.design.plan import Plan
from bayesid.design.rival_prior import RivalPrior, effect_of, relative_floors

__all__ = ["Separation"]

Floors = tuple[tuple[tuple[float, ...], ...], ...]


@register_criterion
@dataclass(frozen=True)
class Separation(Criterion):
    """Maximises the probability that a diagnosis identifies which of some rival effects is present.

    An effect is identified if it has a probability of 0.9 or more against the others, all equally probable beforehand;
    of the rivals, the one that is identified least often counts. Size and direction of the true one follow the prior
    that a diagnosis gives it (`RivalPrior`). All other unknowns are marginalised, and the readings are linear in
    amplitudes and unknowns about the prior's centre (`bayesid.design.decision_rate`). Recordings that exist already are
    treated like planned ones: their expected, not their actual readings count. In Python, the model of the plan must
    contain the rivals; the command adds them.

    Parameters
    ----------
    rivals : tuple of str
        Labels of the effects to distinguish, at least two.
    seed : int
        Seed of the draws of sizes, directions and noise, the same for all manoeuvres; `adapted` draws it.
    floors : tuple, optional
        Smallest scales of each rival (`RivalPrior.floors`), which `adapted` sets to what no manoeuvre resolves.
    """

    name = "separation"
    meaning = (
        "The largest expected probability that the readings give the true one of the rival effects a probability of "
        "0.9 or more, for the one that is identified least often. Size and direction of a rival follow the prior that "
        "a diagnosis gives it; all other quantities are unknown. The cost is minus ten times that probability, with "
        "smooth steps of half a nat at the decisions."
    )
    compares_rivals = True
    starts_from = (DOptimal.name,)
    COUNT: ClassVar[int] = 1024
    """Number of draws in a search, a power of two as Sobol points need."""
    REPORTED: ClassVar[int] = 4000
    """Number of independent draws behind a rate that is reported; its standard error is then below 1 %."""
    TOGETHER: ClassVar[float] = 0.005
    """Difference of the rates below which both rivals count, since the smaller of two has a kink where they agree."""
    SCALE: ClassVar[float] = 10.0
    """Factor on the rate in the cost, since a search takes costs that differ by 0.1 as alike."""

    rivals: tuple[str, ...] = ()
    seed: int = 0
    floors: Floors | None = None

    def __post_init__(self) -> None:
        if len(self.rivals) < 2:
            raise InputError(
                f"{len(self.rivals)} effects to distinguish", place="design.rivals", remedy="Name at least two"
            )

    @property
    def adaptable(self) -> bool:
        """Whether the smallest sizes of the rivals are still unknown."""
        return self.floors is None

    def adapted(self, plan: Plan, shown: Sequence[Floats], rng: np.random.Generator) -> Separation:
        """Return the criterion with the smallest scales that some manoeuvres together resolve, and a seed.

        Parameters
        ----------
        plan : Plan
        shown : sequence of one (K, K) array
            Sum of what `shown` returns over the manoeuvres.
        rng : numpy.random.Generator
            Source of the seed.
        """
        (information,), floors, start = shown, [], 0
        for label in self.rivals:
            prior = RivalPrior.of(effect_of(plan, label)[0])
            part = slice(start, start := start + len(prior.scale_of))
            rows = relative_floors(prior, np.asarray(information)[part, part])
            floors.append(tuple(tuple(map(float, row)) for row in rows))
        return replace(self, floors=tuple(floors), seed=int(rng.integers(2**31)))

    def shown(self, plan: Plan, outcome: Outcome) -> list[Array]:
        """Return the information about the amplitudes of all rivals, shape (K, K), with other unknowns marginalised.

        Amplitudes are in units of their largest plausible sizes, one rival after another, and without their prior.
        """
        change, amplitudes = self.coordinates(plan)
        total = change.T @ (outcome.information + prior_of(plan, outcome)) @ change
        # the last block of a Cholesky factor is that of what the other unknowns leave, and rounds least
        order = np.concatenate([np.setdiff1d(np.arange(len(change)), amplitudes), amplitudes])
        scale = jnp.sqrt(jnp.diag(total))[order]
        factor = scale[:, None] * jnp.linalg.cholesky(total[np.ix_(order, order)] / jnp.outer(scale, scale))
        last = factor[-len(amplitudes) :, -len(amplitudes) :]
        return [last @ last.T - (change.T @ change)[np.ix_(amplitudes, amplitudes)]]

    def coordinates(self, plan: Plan) -> tuple[Array, Integers]:
        """Return how the unknowns' coordinates follow from the rivals' amplitudes and the other coordinates.

        Parameters
        ----------
        plan : Plan

        Returns
        -------
        change : (n, n) array
            Derivatives of the coordinates by amplitudes, in units of their largest plausible sizes, and the others.
        amplitudes : (K,) array of int
            Places of the amplitudes, one rival after another.
        """
        change, amplitudes = jnp.eye(plan.unknowns.size), np.zeros(0, dtype=int)
        for label in self.rivals:
            places = np.array(plan.effect(label), dtype=int)
            slope, chosen = _relative_slope(plan, label)
            change = change.at[np.ix_(places, places)].set(jnp.linalg.inv(slope))
            amplitudes = np.append(amplitudes, places[chosen])
        return change, amplitudes

    def priors(self, plan: Plan) -> list[RivalPrior]:
        """Return the prior of each rival.

        Raises
        ------
        InputError
            If the criterion is not adapted to the family of the plan.
        """
        if self.floors is None:
            raise InputError(
                "the smallest sizes of the rivals are unknown", place="separation", remedy="Call adapted_to_family"
            )
        pairs = zip(self.rivals, self.floors, strict=True)
        return [RivalPrior.of(effect_of(plan, label)[0], floors) for label, floors in pairs]

    def cost(self, plan: Plan, outcome: Outcome) -> Array:
        """Return minus the smaller of the smoothed rates of decisions, times `SCALE`."""
        priors = self.priors(plan)
        draws = RivalDraws.even(priors, self.COUNT, np.random.default_rng(self.seed))
        rates = smooth_rates(decision_margins(self.shown(plan, outcome)[0], priors, draws))
        return self.SCALE * self.TOGETHER * logsumexp(-rates / self.TOGETHER)

    def expected(self, plan: Plan, shown: Sequence[Floats], rng: np.random.Generator) -> dict[str, DecisionRate]:
        """Return the expected rate of decisions for each rival, from independent draws and without smoothing.

        Parameters
        ----------
        plan : Plan
        shown : sequence of one (K, K) array
            What `shown` returns for the manoeuvre.
        rng : numpy.random.Generator
        """
        priors = self.priors(plan)
        margins = decided_margins(shown[0], priors, RivalDraws.independent(priors, self.REPORTED, rng))
        return {label: DecisionRate.of(row >= 0.0) for label, row in zip(self.rivals, margins, strict=True)}


def _relative_slope(plan: Plan, label: str) -> tuple[Array, list[int]]:
    """Return the derivatives (n, n) of a rival's n parameters by its coordinates, and the places of its amplitudes.

    Parameters are those in which the rival is linear, the amplitudes among them in units of their largest sizes.
    """
    effect, largest = effect_of(plan, label)
    index = [one.label for one in plan.model.effects].index(label)
    names = [parameter.name for parameter in effect.in_amplitudes().parameters]
    places = [names.index(quantity.name) for quantity in effect.amplitude_quantities]
    unit = np.ones(len(names))
    unit[places] = largest

    def relative(z: Array) -> Array:
        values = plan.unknowns.values(z).effects[index]
        return effect.amplitudes(values[0] if effect.per_recording else values) / unit

    slope = jax.jacfwd(relative)(jnp.zeros(plan.unknowns.size))
    return slope[:, np.array(plan.effect(label), dtype=int)], places
