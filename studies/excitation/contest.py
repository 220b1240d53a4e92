"""Manoeuvres of equal duration within equal limits, each the best by its own criterion, judged by the posterior."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesid.design import (
    AOptimal,
    ConditionNumber,
    Criterion,
    Design,
    DOptimal,
    EOptimal,
    Found,
    InformationGain,
    Limits,
    Paper26,
    Paper26Intended,
    Problem,
    Search,
    design,
    evaluate,
    optimise,
)
from bayesid.design.design_problem import Known
from studies.base_body import paper
from studies.base_body.setting import POOR
from studies.common.ets7 import ENCODER
from studies.excitation.world import paper_family, problem, splines

__all__ = ["Contest", "compete", "shrunk"]

Floats = NDArray[np.floating]

ALL: tuple[Criterion, ...] = (
    Paper26(),
    Paper26Intended(),
    ConditionNumber(),
    DOptimal(),
    AOptimal(),
    EOptimal(),
    InformationGain(draws=2),
)
FEW: tuple[Criterion, ...] = (Paper26(), ConditionNumber(), DOptimal())


@dataclass(frozen=True)
class Contest:
    """Manoeuvres within one set of limits.

    Attributes
    ----------
    limits : Limits
    designs : mapping of str to Design
        ``printed`` and ``poor`` are the paper's manoeuvre and its poor neighbour, made smaller until they keep the
        limits; ``27: NAME`` was designed in the paper's own family, ``NAME`` with splines on all joints; ``wrong
        guess`` is d-optimal for the paper's initial guess of the base.
    shrink : mapping of str to float
        By how much the first two were made smaller.
    """

    limits: Limits
    designs: Mapping[str, Design]
    shrink: Mapping[str, float]

    def relative(self, name: str) -> tuple[float, float, float]:
        """Return log-determinant less that of (26), and worst and geometric-mean sd over those of (26)."""
        own, base = self.designs[name].predicted, self.designs["paper-26"].predicted
        return (
            own.log_det - base.log_det,
            own.worst / base.worst,
            own.geometric_mean / base.geometric_mean,
        )


def compete(
    limits: Limits, seed: int, search: Search, full: bool, points: int, progress: Callable[[str], None]
) -> Contest:
    """Design by every criterion within some limits."""
    seeds = [int(value) for value in np.random.SeedSequence(seed).generate_state(3)]
    rng = np.random.default_rng(seeds[0])
    criteria = ALL if full else FEW
    own = problem(paper_family(), limits, (Paper26(), DOptimal()))
    designs: dict[str, Design] = {}
    shrink: dict[str, float] = {}
    for name, q in (("printed", paper.EXCITATION), ("poor", POOR)):
        parameters, shrink[name] = shrunk(own, q)
        found = Found(parameters, float("nan"), (), 0)
        like = designs["printed"].posterior if designs else None
        designs[name] = evaluate(own, name, found, {0: ENCODER}, rng, like)

    def tell(family: str) -> Callable[[float, str], None]:
        last = [-1]

        def show(fraction: float, text: str) -> None:
            if int(20 * fraction) > last[0]:
                last[0] = int(20 * fraction)
                progress(f"{family}: {100.0 * fraction:.0f} %, {text}")

        return show

    for item in design(own, seeds[1], {0: ENCODER}, search, progress=tell("(27)")):
        designs[f"27: {item.criterion}"] = item
    ours = problem(splines(points), limits, criteria)
    for item in design(ours, seeds[2], {0: ENCODER}, search, progress=tell("splines")):
        designs[item.criterion] = item
    if full:
        designs["wrong guess"] = _from_wrong_guess(ours, search, rng, designs["d-optimal"])
    return Contest(limits, designs, shrink)


def _from_wrong_guess(ours: Problem, search: Search, rng: np.random.Generator, like: Design) -> Design:
    """Design by the posterior that would be if the paper's initial guess of the base were true."""
    unknowns = ours.plan.unknowns
    guess = unknowns.coordinates([paper.body(paper.GUESS)])
    guessing = ours.knowing(Known(guess, np.eye(unknowns.size)))
    found = optimise(guessing, DOptimal(), rng, search)
    parameters, _ = shrunk(ours, found.parameters)  # the true base may not keep what the guessed one does
    return evaluate(ours, "wrong guess", replace(found, parameters=parameters), {0: ENCODER}, rng, like.posterior)


def shrunk(own: Problem, q: Sequence[float] | Floats) -> tuple[Floats, float]:
    """Make a manoeuvre smaller, towards rest, until it keeps the limits; return its parameters and by how much."""
    centre, way = own.plan.family.centre, np.asarray(q) - own.plan.family.centre
    low, high = 0.0, 1.0
    if all(item.kept for item in own.reached(centre + way)):
        return centre + way, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        if all(item.kept for item in own.reached(centre + middle * way)):
            low = middle
        else:
            high = middle
    return centre + low * way, low
