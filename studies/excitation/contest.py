"""Manoeuvres of equal duration within equal limits, each the best by one criterion, judged by the posterior."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._math.arrays import Floats
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

FEW: tuple[Criterion, ...] = (Paper26(), ConditionNumber(), DOptimal())
"""Criteria of a quick run: the paper's, the one usual for arms on the ground, and the posterior's volume."""

ALL: tuple[Criterion, ...] = (*FEW[:1], Paper26Intended(), *FEW[1:], AOptimal(), EOptimal(), InformationGain(draws=2))
"""Criteria of a full run."""


@dataclass(frozen=True)
class Contest:
    """Manoeuvres within one set of limits.

    Attributes
    ----------
    limits : Limits
    designs : mapping of str to Design
        ``printed`` and ``poor`` are the paper's manoeuvre and its poor neighbour, made smaller until they keep the
        limits; ``27: NAME`` was designed in the paper's family, ``NAME`` with splines on all joints; ``wrong guess`` is
        d-optimal for the paper's initial guess of the base.
    shrink : mapping of str to float
        Factors by which the first two were made smaller.
    """

    limits: Limits
    designs: Mapping[str, Design]
    shrink: Mapping[str, float]

    def relative(self, name: str) -> tuple[float, float, float]:
        """Return log-determinant less that of (26), and worst and geometric-mean deviation over those of (26)."""
        this, base = self.designs[name].predicted, self.designs["paper-26"].predicted
        return this.log_det - base.log_det, this.worst / base.worst, this.geometric_mean / base.geometric_mean


def compete(
    limits: Limits, seed: int, search: Search, full: bool, points: int, progress: Callable[[str], None]
) -> Contest:
    """Design by every criterion within some limits; parameters as in `studies.excitation.run`."""
    seeds = [int(value) for value in np.random.SeedSequence(seed).generate_state(3)]
    rng = np.random.default_rng(seeds[0])
    sines = problem(paper_family(), limits, (Paper26(), DOptimal()))
    designs: dict[str, Design] = {}
    shrink: dict[str, float] = {}
    for name, q in (("printed", paper.EXCITATION), ("poor", POOR)):
        parameters, shrink[name] = shrunk(sines, q)
        given = Found(parameters, float("nan"), (), 0)
        like = designs["printed"].posterior if designs else None
        designs[name] = evaluate(sines, name, given, {0: ENCODER}, rng, like)

    def tell(family: str) -> Callable[[float, str], None]:
        told = [-1]  # a line every five percent

        def show(fraction: float, text: str) -> None:
            if int(20 * fraction) > told[0]:
                told[0] = int(20 * fraction)
                progress(f"{family}: {100.0 * fraction:.0f} %, {text}")

        return show

    for item in design(sines, seeds[1], {0: ENCODER}, search, progress=tell("(27)")):
        designs[f"27: {item.criterion}"] = item
    free = problem(splines(points), limits, ALL if full else FEW)
    for item in design(free, seeds[2], {0: ENCODER}, search, progress=tell("splines")):
        designs[item.criterion] = item
    if full:
        designs["wrong guess"] = _from_wrong_guess(free, search, rng, designs["d-optimal"])
    return Contest(limits, designs, shrink)


def _from_wrong_guess(free: Problem, search: Search, rng: np.random.Generator, like: Design) -> Design:
    """Design by the posterior as it would be if the paper's initial guess of the base were true."""
    unknowns = free.plan.unknowns
    guess = unknowns.coordinates([paper.body(paper.GUESS)])
    best = optimise(free.knowing(Known(guess, np.eye(unknowns.size))), DOptimal(), rng, search)
    parameters, _ = shrunk(free, best.parameters)  # the true base may not keep what the guessed one does
    return evaluate(free, "wrong guess", replace(best, parameters=parameters), {0: ENCODER}, rng, like.posterior)


def shrunk(problem: Problem, q: Sequence[float] | Floats) -> tuple[Floats, float]:
    """Make a manoeuvre smaller, towards rest, until it keeps the limits; return its parameters and the factor."""
    centre = problem.plan.family.centre
    direction = np.asarray(q) - centre

    def kept(factor: float) -> bool:
        return all(item.kept for item in problem.reached(centre + factor * direction))

    if kept(1.0):
        return centre + direction, 1.0
    low, high = 0.0, 1.0
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if kept(middle) else (low, middle)
    return centre + low * direction, low
