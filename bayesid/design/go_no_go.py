"""A plan that may be flown: every limit holds with 99 % under the present uncertainty, or the plan is made smaller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid.design.criteria import Criterion
from bayesid.design.design_problem import Problem, Reached
from bayesid.design.designed import Risk, risks
from bayesid.design.motion_limits import Limits
from bayesid.design.search_store import Store
from bayesid.design.trajectory_search import Found, Search, optimise

__all__ = ["Attempt", "plan_to_go"]

ATTEMPTS = 5
"""Designs until it is a no-go."""

MARGIN = 0.97
"""Of the tightened limit, for a risk that is not quite proportional to it."""

SMALLEST = 0.05
"""Part to which one attempt tightens a limit at most."""


@dataclass(frozen=True)
class Attempt:
    """One design on the way to a go.

    Attributes
    ----------
    limits : Limits
        Under which it was designed.
    found : Found
    risks : sequence of Risk
        Against the limits wanted.
    reached : sequence of Reached
        At the prior's centre, against the limits wanted.
    """

    limits: Limits
    found: Found
    risks: Sequence[Risk]
    reached: Sequence[Reached]

    @property
    def go(self) -> bool:
        """Whether it may be flown."""
        return all(risk.go for risk in self.risks) and all(item.kept for item in self.reached)

    def to_dict(self) -> dict[str, Any]:
        """Entry of loop.json: per uncertain limit what was wanted, what it was designed for, and the 99 % quantile."""
        return {
            "go": self.go,
            "limits": {
                risk.name: {
                    "limit": risk.limit,
                    "designed_for": getattr(self.limits, risk.name),
                    "quantile_99": risk.quantile,
                    "unit": risk.unit,
                }
                for risk in self.risks
            },
            "broken": [item.name for item in self.reached if not item.kept],
        }


def plan_to_go(
    problem: Problem,
    criterion: Criterion,
    seed: np.random.SeedSequence,
    search: Search,
    store: Store,
    progress: Progress = silent,
) -> list[Attempt]:
    """Design, and design anew under limits tightened by the ratio of limit to quantile until all hold.

    Returns
    -------
    list of Attempt
        The last one is to be flown if it is a go.
    """
    attempts: list[Attempt] = []
    tight, first = problem, None
    for number, stream in enumerate(seed.spawn(ATTEMPTS)):
        starts, draws = stream.spawn(2)
        known = store.of(f"attempt-{number + 1}")
        found = optimise(
            tight,
            criterion,
            np.random.default_rng(starts),
            search if number == 0 else replace(search, starts=1),
            first=first,
            known=known.known,
            keep=known.keep,
            progress=progress,
        )
        risky = risks(problem, found.parameters, np.random.default_rng(draws))
        attempts.append(Attempt(tight.limits, found, risky, problem.reached(found.parameters)))
        if attempts[-1].go:
            break
        tight, first = tight.with_limits(_tightened(tight.limits, risky)), found.parameters
    return attempts


def _tightened(limits: Limits, risky: Sequence[Risk]) -> Limits:
    """Return limits smaller by the ratio of limit to quantile where a risk is no go."""
    changed = {}
    for risk in risky:
        if not risk.go:
            ratio = risk.limit / risk.quantile if np.isfinite(risk.quantile) else 0.0
            changed[risk.name] = MARGIN * max(ratio, SMALLEST) * getattr(limits, risk.name)
    return replace(limits, **changed)
