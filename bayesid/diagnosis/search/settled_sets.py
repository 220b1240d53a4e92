"""Sets of causes at fixed noise, enumerated about the best of them until the linear model holds there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bayesid._math.memory import give_back_memory
from bayesid.diagnosis.candidates.burst_signatures import burst_signatures
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.candidates.shift_tuning import plausible_shift, with_tuned_shift
from bayesid.diagnosis.candidates.signature_bank import SignatureBank
from bayesid.diagnosis.candidates.tone_tuning import with_tuned_tones
from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities, enumerate_sets
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.amplitude_fit import fit_in_amplitudes
from bayesid.diagnosis.search.linearisation import Linearisation, linearise
from bayesid.diagnosis.search.vibration_fits import plausible_vibrations
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.mass_shift import MassShift
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["settled"]

AGREES = 0.5
"""Difference between the cost of a fit and its linear prediction below which the linear evidence stands [nats]."""

ROUNDS = 3
"""Most linearisations about the best set."""

LARGE = 50.0
"""Log evidence of a cause beside the others of a fit from which no linear model can leave it out [nats]: that of ten
standard deviations."""


def settled(
    base: Linearisation,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
) -> tuple[Linearisation, SetProbabilities, Fit]:
    """Enumerate, linearise about the best set where the linear model fails there, and again until it holds.

    Parameters
    ----------
    base : Linearisation
        About a fit without causes.
    effects : sequence of Effect
        Candidates of the catalogue.
    bounds : mapping of str to sequence of PhysicalBound
        Of each candidate, by its label.
    prior : CausePrior

    Returns
    -------
    point : Linearisation
        With bursts of the sensors among its candidates.
    found : SetProbabilities
    best : Fit
        Of the most probable set that names all of its causes.
    """
    base = _with_bursts(base)
    point, found, best = base, enumerate_sets(base.evidence, prior), base.fit
    point, found = _tuned(point, found, effects, bounds, prior)
    if base.held:
        return _settled_far(point, found, effects, bounds, prior)
    for _ in range(ROUNDS):
        chosen, released = _best_known(found, effects)
        if not chosen and not released:
            return point, found, best
        fit, expected = fit_in_amplitudes(point, chosen, released)
        if not np.isfinite(fit.cost) or fit.cost > best.cost:
            return point, found, best
        best = fit
        if abs(fit.cost - expected) < AGREES:
            return point, found, best
        point = _with_bursts(linearise(point.perturbed, best, effects, bounds))
        found = enumerate_sets(point.evidence, prior)
        point, found = _tuned(point, found, effects, bounds, prior)
    return point, found, best


def _tuned(
    point: Linearisation,
    found: SetProbabilities,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
) -> tuple[Linearisation, SetProbabilities]:
    """Resolve the forms of plausible causes between those of the grid: tones of vibrations, instants of a jump."""
    if beside := plausible_vibrations(found, effects):
        point = with_tuned_tones(point, effects, bounds, beside)
        found = enumerate_sets(point.evidence, prior)
    if plausible := plausible_shift(found, effects):
        point = with_tuned_shift(point, *plausible, bounds)
        found = enumerate_sets(point.evidence, prior)
    return point, found


def _settled_far(
    base: Linearisation,
    found: SetProbabilities,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
) -> tuple[Linearisation, SetProbabilities, Fit]:
    """Weigh every set about the nearest motion, where the present model itself comes nowhere near the data.

    A linear model about the fit of some causes cannot say what happens without one of them that is large: it lets
    others make up for it that never would. Sets that hold all large causes of a fit are therefore weighed about that
    fit, with free bodies, and the others along the data, until the most probable set has a fit of its own.
    """
    near: dict[frozenset[str], _Near] = {}
    fitted: set[frozenset[str]] = set()
    point, along = base, found
    for _ in range(ROUNDS):
        chosen, released = _best_known(found, effects)
        names = frozenset([*(effect.label for effect in chosen), *([INITIAL_RATE] if released else [])])
        if not names or names in fitted:
            break
        fit, _ = fit_in_amplitudes(base, chosen, released)
        if not np.isfinite(fit.cost):
            break
        fitted.add(names)
        point = _with_bursts(linearise(base.perturbed, fit, effects, bounds, far=True))
        large = _large(point, names)
        near[large] = _Near(point, enumerate_sets(point.evidence, prior, beside=large))
        found = _nearest(_Near(base, along), near, point.log_nothing)
    return point, found, point.fit


def _large(point: Linearisation, names: frozenset[str]) -> frozenset[str]:
    """Return the causes of a fit without which its motion would be another: bodies do not make up for them."""
    evidence = point.holding_bodies().evidence
    rest = {name: names - {name} for name in names}
    whole = evidence.log_evidence(names)
    return frozenset(
        name for name, others in rest.items() if whole - (evidence.log_evidence(others) if others else 0.0) > LARGE
    )


class _Near(NamedTuple):
    """A linearisation, and the sets that are weighed there."""

    point: Linearisation
    found: SetProbabilities


def _nearest(along: _Near, near: Mapping[frozenset[str], _Near], log_nothing: float) -> SetProbabilities:
    """Return the probabilities of all sets, each from the fit with most of its large causes, or else along the data."""
    best: dict[tuple[tuple[str, ...], str | None], tuple[int, CauseSet]] = {}
    for size, (point, found) in [(0, along), *((len(names), own) for names, own in near.items())]:
        for item in found.sets:
            key = (item.causes, item.generic)
            if key not in best or size >= best[key][0]:
                moved = replace(item, log_evidence=item.log_evidence + point.log_nothing - log_nothing)
                best[key] = size, moved
    catalogue = along.found
    sets = (item for _, item in best.values())
    return SetProbabilities.of(sets, catalogue.causes, catalogue.generics, catalogue.prior)


def _with_bursts(point: Linearisation) -> Linearisation:
    """Return the linearisation with bursts of the sensors among its candidates."""
    found = point.with_bank(SignatureBank.joined([point.bank, burst_signatures(point.perturbed, point.fit)]))
    give_back_memory()
    return found


def _best_known(found: SetProbabilities, effects: Sequence[Effect]) -> tuple[list[Effect], bool]:
    """Return the effects of the most probable set that names all of its causes, and whether it frees initial rates.

    There are none where one of them has several forms.
    """
    best = next((item for item in found.sets if item.causes and item.generic is None), None)
    causes = () if best is None else best.causes
    chosen = [effect for effect in effects if effect.label in causes]
    if any(effect.modes_count or isinstance(effect, MassShift) for effect in chosen):
        return [], False
    return chosen, INITIAL_RATE in causes
