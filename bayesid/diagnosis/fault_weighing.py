"""Faults of the noise weighed beside all causes, alone and two together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._io.progress import Progress
from bayesid.diagnosis.cause_prior import CausePrior
from bayesid.diagnosis.family_alarm import FamilyAlarm
from bayesid.diagnosis.linearisation import Linearisation
from bayesid.diagnosis.noise_states import NoiseState, noise_state
from bayesid.diagnosis.noise_tests import noise_tests
from bayesid.diagnosis.perturbed_fit import Fit
from bayesid.diagnosis.set_probabilities import SetProbabilities
from bayesid.diagnosis.settled_sets import settled
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["WeighedState", "weighed_states"]

SUSPECT = 1e-3
"""Local p-value of a test of the noise below which the fault is weighed as a cause."""


@dataclass(frozen=True)
class WeighedState:
    """A state of the noise with the probabilities of all sets of causes under it.

    Attributes
    ----------
    start : Linearisation
        About the fit without causes.
    state : NoiseState
        Linearised where the best set holds.
    found : SetProbabilities
    best : Fit
        Of the most probable set that names all of its causes.
    """

    start: Linearisation
    state: NoiseState
    found: SetProbabilities
    best: Fit

    @property
    def highest(self) -> float:
        """Log evidence of the best explanation."""
        return self.state.log_nothing + max(item.log_evidence for item in self.found.sets)


def weighed_states(
    first: WeighedState,
    alarm: FamilyAlarm,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
    progress: Progress,
) -> list[WeighedState]:
    """Return the noise as declared, every suspected fault by itself, and pairs with the best of them.

    Parameters
    ----------
    first : WeighedState
        The noise as declared.
    alarm : FamilyAlarm
    effects : sequence of Effect
        Candidates of the catalogue.
    bounds : mapping of str to sequence of PhysicalBound
        Of each candidate, by its label.
    prior : CausePrior
    progress : Progress
    """
    found = {first.state.names: first}

    def weigh(before: WeighedState, suspects: Sequence[tuple[str, Fit]]) -> None:
        for label, residual in suspects:
            progress(0.6, f"weighing {label}")
            best = max(item.highest for item in found.values())
            at_start = replace(before.state, point=before.start)
            state = noise_state(label, residual, at_start, effects, bounds, best)
            if state is None:
                continue
            point, sets, fit = settled(state.point, effects, bounds, prior)
            item = WeighedState(state.point, replace(state, point=point), sets, fit)
            if state.names not in found or item.highest > found[state.names].highest:
                found[state.names] = item

    weigh(first, _suspects(alarm, first))
    best = max(found.values(), key=lambda item: item.highest)
    if best is not first:
        weigh(best, [(name, best.best) for name in _seen(best.best) if name not in best.state.names])
    return list(found.values())


def _seen(fit: Fit) -> list[str]:
    """Return the names of the faults that a residual shows."""
    return [name for name, log_p in noise_tests(fit.posterior, fit).items() if log_p < np.log(SUSPECT)]


def _suspects(alarm: FamilyAlarm, first: WeighedState) -> list[tuple[str, Fit]]:
    """Return the faults of the noise to weigh, each with the fit from whose residual its size follows.

    What the best set leaves counts first; a fault that only the present model's residual shows may yet explain all of
    it by itself, unless there is no such residual because the present model's fit diverged. Coloured noise is weighed
    from both: causes that vary with time take its slow part, and what is left of it seems to have a short correlation
    time.
    """
    best, base = first.best, first.start.fit
    found = [(name, best) for name in _seen(best)]
    of_best = {name for name, _ in found}
    for name, log_p in () if first.start.held else alarm.noise.items():
        if log_p < np.log(SUSPECT) and not name.startswith("variance"):
            again = best is not base and name.startswith("coloured-noise")
            if name not in of_best or again:
                found.append((name, base))
    return found
