"""Which effects the first manoeuvre confuses: for each pair, how much of its signal the rival cannot imitate."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import jax
import numpy as np
from numpy.typing import NDArray

from bayesid.design import Plan, Separation, Tip
from studies.common.ets7 import TIP
from studies.ets7_limits.setting import INTERVAL
from studies.separating.setting import CANDIDATES, FlightFamily, drifting, rival_model

__all__ = ["Pair", "pairs"]


@dataclass(frozen=True)
class Pair:
    """Two effects on the first manoeuvre.

    Attributes
    ----------
    labels : (str, str)
    alone : (float, float)
        Noncentrality of each at its prior's amplitude, with base, initial rate and gradient marginalised.
    apart : (float, float)
        Likewise with its rival of any size marginalised too.
    """

    labels: tuple[str, str]
    alone: tuple[float, float]
    apart: tuple[float, float]

    @property
    def left(self) -> float:
        """Part of the signal that the rival cannot imitate, of the effect of which less is left."""
        return min(part / whole for part, whole in zip(self.apart, self.alone, strict=True))


def pairs(duration: float, thinning: int = 2) -> list[Pair]:
    """Return all pairs of the candidates, the most alike first."""
    labels = [effect.label for effect in CANDIDATES]
    model, family = rival_model(labels), FlightFamily(duration)
    plan = Plan(model, family, INTERVAL, Tip.of(model.robot, TIP), thinning=thinning)
    z = drifting(model, plan.unknowns.names)
    outcome = jax.jit(plan.outcome)(family.centre, z)
    found = []
    for couple in combinations(labels, 2):
        own = replace(plan, model=rival_model(couple))
        rows = np.array([plan.unknowns.names.index(name) for name in own.unknowns.names])
        cut = outcome._replace(information=outcome.information[np.ix_(rows, rows)])
        apart = np.asarray(Separation(couple).noncentrality(own, cut))
        alone = []
        for label in couple:
            single = replace(plan, model=rival_model([label]))
            rows = np.array([plan.unknowns.names.index(name) for name in single.unknowns.names])
            part = np.asarray(outcome.information)[np.ix_(rows, rows)]
            alone.append(_alone(part, list(single.effect(label))))
        found.append(Pair(couple, (alone[0], alone[1]), (float(apart[0]), float(apart[1]))))
    return sorted(found, key=lambda pair: pair.left)


def _alone(information: NDArray[np.floating], group: list[int]) -> float:
    """Trace of the information of a group with all else, which has a standard-normal prior, marginalised."""
    rest = [index for index in range(len(information)) if index not in group]
    cross = information[np.ix_(group, rest)]
    inner = information[np.ix_(rest, rest)] + np.eye(len(rest))
    return float(np.trace(information[np.ix_(group, group)] - cross @ np.linalg.solve(inner, cross.T)))
