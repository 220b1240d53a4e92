"""Probabilities of all sets of causes and of faults of the noise, the model relinearised until they stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid.diagnosis.amplitude_fit import fit_in_amplitudes
from bayesid.diagnosis.burst_signatures import burst_signatures
from bayesid.diagnosis.cause_prior import CausePrior
from bayesid.diagnosis.equivalent_causes import classes_of_equivalents
from bayesid.diagnosis.family_alarm import FamilyAlarm
from bayesid.diagnosis.initial_rate_signatures import INITIAL_RATE
from bayesid.diagnosis.linearisation import Linearisation, linearise
from bayesid.diagnosis.noise_states import NoiseState, fault_names, noise_state
from bayesid.diagnosis.noise_tests import noise_tests
from bayesid.diagnosis.perturbed_fit import Engine, Fit
from bayesid.diagnosis.set_enumeration import enumerate_sets
from bayesid.diagnosis.set_evidence import SetEvidence
from bayesid.diagnosis.set_probabilities import CauseSet, SetProbabilities
from bayesid.diagnosis.signature_bank import SignatureBank
from bayesid.diagnosis.tone_tuning import with_tuned_tones
from bayesid.diagnosis.vibration_fits import plausible_vibrations, with_fitted_vibrations
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.mass_shift import MassShift
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["WeighedCauses", "weigh_causes"]

AGREES = 0.5
"""Difference between the cost of a fit and its linear prediction below which the linear evidence stands [nats]."""

ROUNDS = 3
"""Most linearisations about the best set."""

MATTERS = 3e-3
"""Probability from which a set is evaluated anew under other ranges of the scales."""

SUSPECT = 1e-3
"""Local p-value of a test of the noise below which the fault is weighed as a cause."""


@dataclass(frozen=True)
class WeighedCauses:
    """All explanations with their probabilities.

    Attributes
    ----------
    base : Linearisation
        About the fit of the present model.
    alarm : FamilyAlarm
    states : tuple of NoiseState
        The noise as declared first, then the faults that were weighed.
    probabilities : SetProbabilities
        Of sets of causes, faults of the noise among them.
    """

    base: Linearisation
    alarm: FamilyAlarm
    states: tuple[NoiseState, ...]
    probabilities: SetProbabilities

    def state(self, causes: Sequence[str]) -> NoiseState:
        """Return the state of the noise in a set of causes."""
        return next((state for state in self.states[1:] if state.names[0] in causes), self.states[0])

    def widened(self, bound: float, floor: float) -> SetProbabilities:
        """Return the probabilities with the bounds and the floors of all scales multiplied by factors.

        Only sets that matter are evaluated anew; the others keep their evidence.
        """
        matter = {name for item in self.probabilities.sets if item.probability >= MATTERS for name in item.names}
        wider = {
            state.names: SetEvidence(
                state.point.evidence.gram,
                [
                    cause.rescaled(state.point.evidence.gram, bound, floor)
                    for name, cause in state.point.evidence.causes.items()
                    if name in matter
                ],
            )
            for state in self.states
        }
        sets = []
        for item in self.probabilities.sets:
            state = self.state(item.causes)
            names = [name for name in item.names if name in state.point.evidence.causes]
            if item.probability >= MATTERS and names:
                change = wider[state.names].log_evidence(names) - state.point.evidence.log_evidence(names)
                item = replace(item, log_evidence=item.log_evidence + change)
            sets.append(item)
        found = self.probabilities
        return SetProbabilities.of(sets, found.causes, found.generics, found.prior)

    def classes(self) -> tuple[tuple[str, ...], ...]:
        """Return the causes in classes of equivalents; a fault of the noise is a class of its own."""
        found = classes_of_equivalents(self.states[0].point.evidence)
        held = {name for members in found for name in members}
        return (*found, *((name,) for name in self.probabilities.causes if name not in held))


def weigh_causes(
    engine: Engine,
    fit: Fit,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
    rng: np.random.Generator,
    progress: Progress = silent,
) -> WeighedCauses:
    """Weigh every set of causes.

    Parameters
    ----------
    engine : Engine
    fit : Fit
        Of the present model.
    effects : sequence of Effect
        Candidates of the catalogue.
    bounds : mapping of str to sequence of PhysicalBound
        Of each candidate, by its label.
    prior : CausePrior
    rng : Generator
        For the alarm.
    progress : Progress, optional
    """
    progress(0.2, "computing what each candidate would change")
    base = linearise(engine, fit, effects, bounds)
    progress(0.4, "testing the present model")
    alarm = FamilyAlarm.of(base, rng)
    faults = fault_names(engine)
    if alarm.silent:
        single = enumerate_sets(base.evidence, prior, largest=1)
        return WeighedCauses(base, alarm, (NoiseState(None, base),), _with_faults(single, faults))
    progress(0.5, "weighing the sets of causes")
    point, found, best = _settled(_with_bursts(base), effects, bounds, prior)
    found, best = with_fitted_vibrations(point, found, effects, best)
    states = [NoiseState(None, point)]
    sets = [list(found.sets)]
    for label, residual in _suspects(alarm, best, base.fit).items():
        progress(0.6, f"weighing {label}")
        highest = point.log_nothing + max(item.log_evidence for item in found.sets)
        state = noise_state(label, residual, base, effects, bounds, highest)
        if state is not None:
            settled, own, _ = _settled(_with_bursts(state.point), effects, bounds, prior)
            states.append(replace(state, point=settled))
            sets.append(list(own.sets))
    return WeighedCauses(base, alarm, tuple(states), _joined(states, sets, found, faults))


def _settled(
    base: Linearisation,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
) -> tuple[Linearisation, SetProbabilities, Fit]:
    """Enumerate, linearise about the best set where the linear model fails there, and again until it holds."""
    point, found, best = base, enumerate_sets(base.evidence, prior), base.fit
    if beside := plausible_vibrations(found, effects):
        point = with_tuned_tones(point, effects, bounds, beside)
        found = enumerate_sets(point.evidence, prior)
    for _ in range(ROUNDS):
        chosen, released = _best_known(found, effects)
        if not chosen and not released:
            return point, found, best
        fit, expected = fit_in_amplitudes(point, chosen, released)
        if fit.cost > best.cost:
            return point, found, best
        best = fit
        if abs(fit.cost - expected) < AGREES:
            return point, found, best
        point = _with_bursts(linearise(point.engine, best, effects, bounds))
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


def _suspects(alarm: FamilyAlarm, best: Fit, base: Fit) -> dict[str, Fit]:
    """Return the faults of the noise to weigh, each with the fit from whose residual its size follows.

    What the best set leaves counts first; a fault that only the present model's residual shows may yet explain all of
    it by itself.
    """
    found = {}
    for name, log_p in noise_tests(best.posterior, best).items():
        if log_p < np.log(SUSPECT):
            found[name] = best
    for name, log_p in alarm.noise.items():
        if log_p < np.log(SUSPECT) and name not in found and not name.startswith("variance"):
            found[name] = base
    return found


def _with_faults(found: SetProbabilities, faults: Sequence[str]) -> SetProbabilities:
    """Return probabilities with the faults of the noise in the catalogue, of which none was weighed."""
    return SetProbabilities.of(found.sets, (*found.causes, *faults), found.generics, found.prior)


def _joined(
    states: Sequence[NoiseState], sets: Sequence[Sequence[CauseSet]], found: SetProbabilities, faults: Sequence[str]
) -> SetProbabilities:
    """Return the probabilities of the sets of all states, with evidence relative to the declared noise and nothing."""
    every = []
    for state, own in zip(states, sets, strict=True):
        offset = state.log_nothing - states[0].log_nothing
        for item in own:
            causes = tuple(sorted((*item.causes, *state.names)))
            every.append(replace(item, causes=causes, log_evidence=item.log_evidence + offset))
    return SetProbabilities.of(every, (*found.causes, *faults), found.generics, found.prior)
