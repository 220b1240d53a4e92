"""Instants at which mass moves inside the base: one in each of several recordings, to a sample.

The bank holds one jump in one recording, at instants of a grid. The same moments may jump in several recordings, each
at its own instant (a tank that is switched, a part that falls over whenever the arm moves), and at high ratios of
signal to noise the grid is too coarse. The information on the moments is a sum over the recordings that jump, so that
instants are sought one recording after another in Gram space, first on the grid and then from sample to sample.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesid.diagnosis.candidates.catalogue_signatures import group_names
from bayesid.diagnosis.candidates.mass_shift_signatures import (
    jump_signatures,
    sample_intervals,
    shift_instants,
    shift_spread,
)
from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scale_integral import GroupSpectrum, log_evidences
from bayesid.diagnosis.evidence.scales import AmplitudeGroup
from bayesid.diagnosis.search.linearisation import Linearisation
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.effects.mass_shift import MassShift

__all__ = ["plausible_shift", "with_tuned_shift"]

PLAUSIBLE = 0.01
"""Probability of a jump from which its instants are sought."""

SWEEPS = 3
"""Most times that the instant of every recording is sought beside those of the others."""

POINTS = 8
"""Instants tried on either side in each round; the rounds end at the interval of the samples."""

SHARE = 0.5
"""Prior probability of the instants of all recordings together; the rest is that of one recording and the grid."""


def plausible_shift(found: SetProbabilities, effects: Sequence[Effect]) -> tuple[MassShift, tuple[str, ...]] | None:
    """Return the jump of the base's moments where it is plausible, with its company in the best set that holds it."""
    shift = next((effect for effect in effects if isinstance(effect, MassShift)), None)
    if shift is None or found.inclusion[shift.label] < PLAUSIBLE:
        return None
    best = next(item for item in found.sets if shift.label in item.causes)
    return shift, tuple(name for name in best.causes if name != shift.label)


def with_tuned_shift(
    point: Linearisation, shift: MassShift, others: Sequence[str], bounds: Mapping[str, Sequence[PhysicalBound]]
) -> Linearisation:
    """Return the linearisation with the most probable instants of all recordings among the forms of the jump.

    Every number of recordings may jump, and each at any sample; all choices are equally probable beforehand.

    Parameters
    ----------
    point : Linearisation
    shift : MassShift
    others : sequence of str
        Other causes of the set in which the instants are sought.
    bounds : mapping of str to sequence of PhysicalBound
    """
    ends = np.asarray(point.fit.operating.sample.environment.time).max(axis=1)
    intervals = sample_intervals(point.fit)
    finest = np.array([np.median(steps) for steps in intervals])
    grid = np.stack([shift_instants(float(end)) for end in ends])
    size, spread = shift_spread(bounds[shift.label])
    group = AmplitudeGroup(shift.label, size, spread=spread)
    chosen: list[float | None] = [None] * len(ends)
    reach = np.array([float(row[1] - row[0]) for row in grid])
    choices = [list(map(float, row)) for row in grid]
    while True:
        chosen = _sought(point, shift, others, group, choices, chosen)
        if (reach < finest).all() or not any(instant is not None for instant in chosen):
            break
        choices = [_around(instant, wide, float(end)) for instant, wide, end in zip(chosen, reach, ends, strict=True)]
        reach = reach / POINTS
    samples = [len(steps) + 1 for steps, instant in zip(intervals, chosen, strict=True) if instant is not None]
    if not samples:
        return point
    share = SHARE / (2.0 ** len(ends) - 1.0) / float(np.prod(samples, dtype=float))
    instants = tuple(np.inf if instant is None else instant for instant in chosen)
    columns = jump_signatures(point.perturbed, point.fit, np.array(instants)[:, None])[:, 0]
    name = f"{shift.label} at {', '.join(f'{instant:.5g}' for instant in instants)} s"
    item = Signatures(name, columns.reshape(-1, columns.shape[-1]), instants=instants)
    cause = next(cause for cause in point.bank.causes if cause.name == shift.label)
    forms = [variant.groups for variant in cause.variants]
    tuned = replace(
        cause,
        others=(*forms[1:], (replace(group, name=name),)),
        shares=(*((1.0 - SHARE) * np.exp(variant.log_weight) for variant in cause.variants), share),
    )
    causes = tuple(tuned if one is cause else one for one in point.bank.causes)
    return point.with_bank(SignatureBank((*point.bank.signatures, item), causes))


def _around(instant: float | None, reach: float, end: float) -> list[float]:
    if instant is None:
        return []
    tried = instant + reach * np.arange(-POINTS, POINTS + 1) / POINTS
    return sorted({float(time) for time in np.clip(tried, 0.0, end)})


def _sought(
    point: Linearisation,
    shift: MassShift,
    others: Sequence[str],
    group: AmplitudeGroup,
    choices: Sequence[Sequence[float]],
    chosen: Sequence[float | None],
) -> list[float | None]:
    """Return the best instant of each recording among some, or None where it does not jump."""
    most = max(map(len, choices))
    padded = np.array([[*row, *[np.inf] * (most - len(row))] for row in choices])
    columns = jump_signatures(point.perturbed, point.fit, padded)
    items = [Signatures(f"{r},{k}", columns[r, k], r) for r, row in enumerate(choices) for k in range(len(row))]
    gram = _beside(point, items, others, shift.label)
    best = [None if now is None else int(np.argmin(np.abs(padded[r] - now))) for r, now in enumerate(chosen)]
    sizes = [len(row) for row in choices]
    value = _weighed(gram, group, best, sizes)
    for _ in range(SWEEPS):
        before = list(best)
        for r, row in enumerate(choices):
            for k in (None, *range(len(row))):
                trial = [*best[:r], k, *best[r + 1 :]]
                now = _weighed(gram, group, trial, sizes)
                if now > value:
                    best, value = trial, now
        if best == before:
            break
    return [None if k is None else float(padded[r, k]) for r, k in enumerate(best)]


def _beside(point: Linearisation, items: Sequence[Signatures], others: Sequence[str], label: str) -> Gram:
    """Return the Gram of jumps after the other causes, at their most probable scales, have taken their share."""
    evidence = point.evidence
    names = {g.name for name in others for form in evidence.causes[name].variants for g in form.groups}
    names |= {name for held in point.fit.effects for name in group_names(held).values()}
    rest = [item for item in point.bank.signatures if item.name in names]
    jump = replace(
        evidence.causes[label],
        groups=(AmplitudeGroup(items[0].name, 1.0),),
        others=tuple((AmplitudeGroup(item.name, 1.0),) for item in items[1:]),
        shares=(),
    )
    bank = SignatureBank((*rest, *items), (*(evidence.causes[name] for name in others), jump))
    own = point.with_bank(bank).evidence
    return own.beside(others, own.forms(others), [item.name for item in items])


def _weighed(gram: Gram, group: AmplitudeGroup, best: Sequence[int | None], sizes: Sequence[int]) -> float:
    """Return the log evidence of the same moments in all recordings that jump, each at one of so many instants."""
    jumping = [(r, k) for r, k in enumerate(best) if k is not None]
    if not jumping:
        return 0.0
    own = [gram.groups[f"{r},{k}"] for r, k in jumping]
    matrix = np.sum([gram.matrix[np.ix_(one, two)] for one in own for two in own], axis=0)
    score = np.sum([gram.score[one] for one in own], axis=0)
    spectra = GroupSpectrum.of([group], Gram(matrix, score, {group.name: np.arange(len(score))}))
    return float(log_evidences(spectra)[0]) - float(sum(np.log(sizes[r]) for r, _ in jumping))
