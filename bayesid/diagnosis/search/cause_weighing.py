"""Probabilities of all sets of causes and of faults of the noise, the model relinearised until they stand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid._math.memory import give_back_memory
from bayesid.diagnosis.evidence.cause_sets import CausePrior, SetProbabilities, enumerate_sets
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import classes_of_equivalents
from bayesid.diagnosis.noise.family_alarm import FamilyAlarm
from bayesid.diagnosis.noise.noise_states import FaultyFit, NoiseState, fault_names
from bayesid.diagnosis.response.followed_motion import linearise_along_data
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.search.fault_weighing import weighed_states
from bayesid.diagnosis.search.linearisation import Linearisation, linearise
from bayesid.diagnosis.search.settled_sets import settled
from bayesid.diagnosis.search.vibration_fits import plausible_vibrations, with_fitted_vibrations
from bayesid.diagnosis.search.weighed_state import WeighedState
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["WeighedCauses", "weigh_causes"]

MATTERS = 3e-3
"""Probability from which a set is evaluated anew under other ranges of the scales."""


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
        faulty = {name for state in self.states for name in state.names} & set(causes)
        return next((state for state in self.states if set(state.names) == faulty), self.states[0])

    def widened(self, bound: float, floor: float) -> SetProbabilities:
        """Return the probabilities with the bounds and the floors of all scales multiplied by factors.

        Only sets that matter are evaluated anew, in the most probable forms of their causes; the others keep their
        evidence.
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
                forms = [state.point.evidence.forms(names)]
                change = wider[state.names].log_evidence(names, forms)
                change -= state.point.evidence.log_evidence(names, forms)
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
    perturbed: PerturbedModel,
    fit: Fit,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
    rng: np.random.Generator,
    progress: Progress = silent,
    *,
    held: bool = False,
) -> WeighedCauses:
    """Weigh every set of causes.

    Parameters
    ----------
    perturbed : PerturbedModel
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
    held : bool
        Whether the bodies are held in the fit, which diverged: the model is then linearised along the data.
    """
    progress(0.2, "computing what each candidate would change")
    base = linearise_along_data(perturbed, effects, bounds) if held else linearise(perturbed, fit, effects, bounds)
    progress(0.4, "testing the present model")
    alarm = FamilyAlarm.of(base, fit, rng)
    faults = fault_names(perturbed)
    if alarm.silent:
        single = enumerate_sets(base.evidence, prior, largest=1)
        return WeighedCauses(base, alarm, (NoiseState((), base),), _with_faults(single, faults))
    progress(0.5, "weighing the sets of causes")
    point, found, best = settled(base, effects, bounds, prior)
    base = base.without_products()
    give_back_memory()
    first = WeighedState(FaultyFit.declared(base), NoiseState((), point.without_products()), found, best)
    weighed = weighed_states(first, alarm, effects, bounds, prior, progress)
    likeliest = max(weighed, key=lambda item: item.highest)
    if plausible_vibrations(_joined(weighed, faults), effects):
        progress(0.6, "fitting vibrations")
        fitted = with_fitted_vibrations(likeliest, effects)
        if likeliest is first:
            weighed = weighed_states(fitted, alarm, effects, bounds, prior, progress)
        else:
            weighed = [fitted if item is likeliest else item for item in weighed]
    return WeighedCauses(base, alarm, tuple(item.state for item in weighed), _joined(weighed, faults))


def _with_faults(found: SetProbabilities, faults: Sequence[str]) -> SetProbabilities:
    """Return probabilities with the faults of the noise in the catalogue, of which none was weighed."""
    return SetProbabilities.of(found.sets, (*found.causes, *faults), found.generics, found.prior)


def _joined(weighed: Sequence[WeighedState], faults: Sequence[str]) -> SetProbabilities:
    """Return the probabilities of the sets of all states, with evidence relative to the declared noise and nothing."""
    declared = weighed[0]
    every = []
    for item in weighed:
        offset = item.state.log_nothing - declared.state.log_nothing
        for own in item.found.sets:
            causes = tuple(sorted((*own.causes, *item.state.names)))
            every.append(replace(own, causes=causes, log_evidence=own.log_evidence + offset))
    found = declared.found
    return SetProbabilities.of(every, (*found.causes, *faults), found.generics, found.prior)
