"""Sets of causes at fixed noise, enumerated about the best of them until the linear model holds there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bayesid.diagnosis.amplitude_fit import fit_in_amplitudes
from bayesid.diagnosis.burst_signatures import burst_signatures
from bayesid.diagnosis.cause_prior import CausePrior
from bayesid.diagnosis.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.linearisation import Linearisation, linearise
from bayesid.diagnosis.perturbed_fit import Fit
from bayesid.diagnosis.set_enumeration import enumerate_sets
from bayesid.diagnosis.set_probabilities import SetProbabilities
from bayesid.diagnosis.signature_bank import SignatureBank
from bayesid.diagnosis.tone_tuning import with_tuned_tones
from bayesid.diagnosis.vibration_fits import plausible_vibrations
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.mass_shift import MassShift
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["settled"]

AGREES = 0.5
"""Difference between the cost of a fit and its linear prediction below which the linear evidence stands [nats]."""

ROUNDS = 3
"""Most linearisations about the best set."""


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
    along = best if base.held else None  # no explanation: a torque that follows the data
    if beside := plausible_vibrations(found, effects):
        point = with_tuned_tones(point, effects, bounds, beside)
        found = enumerate_sets(point.evidence, prior)
    for _ in range(ROUNDS):
        chosen, released = _best_known(found, effects)
        if not chosen and not released:
            return point, found, best
        fit, expected = fit_in_amplitudes(point, chosen, released)
        if not np.isfinite(fit.cost) or (fit.cost > best.cost and best is not along):
            return point, found, best
        best = fit
        if abs(fit.cost - expected) < AGREES:
            return point, found, best
        point = _with_bursts(linearise(point.engine, best, effects, bounds, held=point.held))
        found = enumerate_sets(point.evidence, prior)
        if beside := plausible_vibrations(found, effects):
            point = with_tuned_tones(point, effects, bounds, beside)
            found = enumerate_sets(point.evidence, prior)
    return point, found, best


def _with_bursts(point: Linearisation) -> Linearisation:
    """Return the linearisation with bursts of the sensors among its candidates."""
    return point.with_bank(SignatureBank.joined([point.bank, burst_signatures(point.engine, point.fit)]))


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
