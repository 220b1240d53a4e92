"""Plans that may be flown: every limit holds with 99 % probability, or the plan is designed under tighter limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.design.criteria import Criterion
from bayesid.design.design_problem import Problem, Reached
from bayesid.design.design_result import Risk, risks, with_starts
from bayesid.design.motion_limits import Limits
from bayesid.design.trajectory_search import Search, SearchResult, Store, optimise

__all__ = ["Attempt", "plan_to_go"]

ATTEMPTS = 5  # largest number of designs before the last one is only made smaller
SHRUNK = 30  # largest number of times that the last design is made smaller before the step is a no-go
LEAST = 0.1  # smallest factor by which it is made smaller at a time
MARGIN = 0.97  # factor on a tightened limit, since the quantile is not exactly proportional to the limit
SMALLEST = 0.05  # smallest factor by which one attempt tightens a limit, so that a manoeuvre remains possible


@dataclass(frozen=True)
class Attempt:
    """One design on the way to a plan that may be flown."""

    limits: Limits  #: limits under which the manoeuvre was designed
    optimum: SearchResult  #: outcome of the search
    risks: Sequence[Risk]  #: risks against the limits of the problem
    reached: Sequence[Reached]  #: largest values at the prior's centre, against the limits of the problem

    @property
    def go(self) -> bool:
        """True if the plan may be flown."""
        return not self.broken

    @property
    def broken(self) -> list[str]:
        """Names of the limits that do not hold."""
        risky = [risk.name for risk in self.risks if not risk.go]
        return list(dict.fromkeys([*risky, *(largest.name for largest in self.reached if not largest.kept)]))

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of loop.json: for each uncertain limit its value, the tightened value and the quantile."""
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
            "broken": self.broken,
        }


def plan_to_go(
    problem: Problem,
    criterion: Criterion,
    seed: np.random.SeedSequence,
    search: Search,
    store: Store,
    progress: Progress = silent,
) -> list[Attempt]:
    """Design a manoeuvre, and repeat the design under tighter limits until all limits hold with 99 % probability.

    A limit that does not hold is tightened by the ratio of the limit to the 99 % quantile of the largest value. If
    that does not lead to a manoeuvre that may be flown, the last one is made smaller, towards rest, until all limits
    hold. The step is a no-go only if a limit is broken however little moves.

    Parameters
    ----------
    problem : Problem
        Design problem with the limits that must hold.
    criterion : Criterion
        Criterion to minimise.
    seed : numpy.random.SeedSequence
        Source of all random numbers.
    search : Search
        Effort of the first design; the later ones use one start.
    store : Store
        Results of earlier runs, and place for new ones.
    progress : Progress
        Receiver of the fraction done.

    Returns
    -------
    list of Attempt
        All attempts; the last one may be flown if it is a go.
    """
    attempts: list[Attempt] = []
    streams = seed.spawn(ATTEMPTS)
    tight, first = problem, _best_by_others(problem, criterion, seed, search, store)
    for number, stream in enumerate(streams):
        starts, draws = stream.spawn(2)
        known = store.of(f"attempt-{number + 1}")
        try:
            optimum = optimise(
                tight,
                criterion,
                np.random.default_rng(starts),
                search if number == 0 else replace(search, starts=0),
                first=first,
                known=known.known,
                keep=known.keep,
                progress=progress,
            )
        except InputError:
            if not attempts:
                raise
            break  # limits as tight as that leave nothing to search
        risky = risks(problem, optimum.parameters, np.random.default_rng(draws))
        attempts.append(Attempt(tight.limits, optimum, risky, problem.reached(optimum.parameters)))
        if attempts[-1].go:
            break
        tight, first = tight.with_limits(_tightened(tight.limits, risky)), [optimum.parameters]
    if not attempts[-1].go:
        attempts.append(_made_smaller(problem, criterion, attempts[-1], draws))
    return attempts


def _best_by_others(
    problem: Problem, criterion: Criterion, seed: np.random.SeedSequence, search: Search, store: Store
) -> list[Floats]:
    """Return the best manoeuvres by the criteria from which another starts (`Criterion.starts_from`)."""
    whole = with_starts(problem)
    others = [other for other in whole.criteria if other.name in criterion.starts_from]
    best = []
    for other, stream in zip(others, seed.spawn(len(others)), strict=True):
        known = store.of(other.name)
        rng = np.random.default_rng(stream)
        best.append(optimise(whole, other, rng, search, known=known.known, keep=known.keep).parameters)
    return best


def _made_smaller(problem: Problem, criterion: Criterion, last: Attempt, draws: np.random.SeedSequence) -> Attempt:
    """Return an attempt made smaller, towards rest, until all limits hold with 99 % probability."""
    centre = problem.plan.family.centre
    for _ in range(SHRUNK):
        factors = [risk.limit / risk.quantile for risk in last.risks if not risk.go]
        factors += [reached.limit / reached.largest for reached in last.reached if not reached.kept]
        size = float(np.clip(MARGIN * np.nan_to_num(min(factors)), LEAST, MARGIN))
        parameters = centre + size * (last.optimum.parameters - centre)
        optimum = replace(last.optimum, parameters=parameters, cost=problem.cost(criterion, parameters)[0])
        risky = risks(problem, parameters, np.random.default_rng(draws))
        last = Attempt(last.limits, optimum, risky, problem.reached(parameters))
        if last.go:
            break
    return last


def _tightened(limits: Limits, risky: Sequence[Risk]) -> Limits:
    """Return the limits, tightened by the ratio of limit to quantile where they do not hold."""
    changed = {}
    for risk in risky:
        if not risk.go:
            ratio = risk.limit / risk.quantile if np.isfinite(risk.quantile) else 0.0
            changed[risk.name] = MARGIN * max(ratio, SMALLEST) * getattr(limits, risk.name)
    return replace(limits, **changed)
