"""Faults of the noise weighed beside all causes, alone and two together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesid._io.progress import Progress
from bayesid._math.memory import give_back_memory
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.noise.family_alarm import FamilyAlarm
from bayesid.diagnosis.noise.noise_states import FaultyFit, faulty_fit
from bayesid.diagnosis.noise.noise_tests import noise_tests
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.settled_sets import settled
from bayesid.diagnosis.search.weighed_state import WeighedState
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["weighed_states"]

FAR_BEHIND = 10.0
"""Nats by which the sets of a state may be expected to stay behind the best explanation to be weighed."""

SUSPECT = 1e-3
"""Local p-value of a test of the noise below which the fault is weighed as a cause."""


def weighed_states(
    first: WeighedState,
    alarm: FamilyAlarm,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    prior: CausePrior,
    progress: Progress,
) -> list[WeighedState]:
    """Return the noise as declared, suspected faults by themselves, and two together.

    A fault takes its share of what causes explain, so that sets of causes add no more to it than they do to the
    declared noise. Faults with which the best explanation would stay behind even so are left out; the others are
    weighed with all sets of causes, the most promising first.

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
    reach = first.highest - first.state.log_nothing
    fits: dict[tuple[str, ...], FaultyFit] = {}
    found = {first.state.names: first}

    def best() -> WeighedState:
        return max(found.values(), key=lambda item: item.highest)

    def fit(before: FaultyFit, suspects: Sequence[tuple[str, Fit]]) -> None:
        for label, residual in suspects:
            if label in before.names:
                continue
            progress(0.6, f"fitting {label}")
            known = fits.get(tuple(sorted((*before.names, label))))
            item = faulty_fit(label, residual, before, best().highest, known)
            if item is not None and (item.names not in fits or item.log_nothing > fits[item.names].log_nothing):
                fits[item.names] = item
                found.pop(item.names, None)

    def weigh() -> None:
        for item in sorted(fits.values(), key=lambda item: -item.log_nothing):
            if item.names in found or item.log_nothing + reach < best().highest - FAR_BEHIND:
                continue
            progress(0.6, f"weighing the causes beside {' and '.join(item.names)}")
            state = item.linearised(effects, bounds)
            point, sets, nearest = settled(state.point, effects, bounds, prior)
            found[item.names] = WeighedState(item, replace(state, point=point.without_products()), sets, nearest)
            give_back_memory()

    fit(first.start, _suspects(alarm, first))
    if fits:
        loudest = max(fits.values(), key=lambda item: item.log_nothing)
        fit(loudest, [(name, loudest.fit) for name in _seen(loudest.fit)])
    weigh()
    if best() is not first:
        fit(best().start, [(name, best().best) for name in _seen(best().best)])
        weigh()
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
