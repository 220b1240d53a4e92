"""Which effects the first manoeuvre confuses: for each pair, how much of its signal the rival cannot imitate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import jax
import numpy as np

from bayesid.design import Plan, Separation, Tip
from bayesid.design.plan import PlannedOutcome
from studies.common.ets7 import TIP
from studies.ets7_limits.setting import INTERVAL
from studies.separating.expected import unexplained_information
from studies.separating.setting import CANDIDATES, FlightFamily, drifting, rival_model

__all__ = ["Pair", "pairs"]


@dataclass(frozen=True)
class Pair:
    """Two effects on the first manoeuvre.

    Attributes
    ----------
    labels : (str, str)
        Labels of the effects.
    alone : (float, float)
        Noncentrality of each at its prior's amplitude, with base, initial rate and gradient marginalised.
    apart : (float, float)
        Noncentrality of each with the rival, of any size, marginalised too.
    """

    labels: tuple[str, str]
    alone: tuple[float, float]
    apart: tuple[float, float]

    @property
    def left(self) -> float:
        """Smaller of the two fractions of a signal that the rival cannot imitate."""
        return min(part / whole for part, whole in zip(self.apart, self.alone, strict=True))


def pairs(duration: float, thinning: int = 2) -> list[Pair]:
    """Return all pairs of the candidates, the most alike first."""
    labels = [effect.label for effect in CANDIDATES]
    model, family = rival_model(labels), FlightFamily(duration)
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, TIP), thinning=thinning)
    outcome = jax.jit(plan.outcome)(family.centre, drifting(plan.unknowns))

    def having(*present: str) -> tuple[Plan, PlannedOutcome]:
        """Return plan and outcome of the model with some of the candidates."""
        smaller = replace(plan, model=rival_model(present))
        rows = np.array([plan.unknowns.names.index(name) for name in smaller.unknowns.names])
        return smaller, outcome._replace(information=np.asarray(outcome.information)[np.ix_(rows, rows)])

    alone = {}
    for label in labels:
        single, cut = having(label)
        group = list(single.effect(label))
        rest = [index for index in range(len(cut.information)) if index not in group]
        alone[label] = float(np.trace(unexplained_information(np.asarray(cut.information), group, rest)))
    rows = []
    for first, second in combinations(labels, 2):
        apart = np.asarray(Separation((first, second)).noncentrality(*having(first, second)))
        rows.append(Pair((first, second), (alone[first], alone[second]), (float(apart[0]), float(apart[1]))))
    return sorted(rows, key=lambda pair: pair.left)
