"""Evidence of hidden vibrations corrected by fits, since a vibration is not linear in its frequency and coupling."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesid._io.errors import InputError
from bayesid.diagnosis.evidence.cause_sets import CauseSet, SetProbabilities
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.hypothesis_fit import fit_hypothesis
from bayesid.diagnosis.search.weighed_state import WeighedState
from bayesid.simulation.effects.effect import Effect

__all__ = ["plausible_vibrations", "with_fitted_vibrations"]

PLAUSIBLE = 0.01
"""Probability from which a vibration is tuned and fitted, and with it all others of the catalogue."""

BEHIND = 40.0
"""Nats behind the best vibration from which the fit of another is not followed to its end."""


def plausible_vibrations(found: SetProbabilities, effects: Sequence[Effect]) -> dict[str, tuple[str, ...]]:
    """Return all vibrations where one is plausible, each with its company in the most probable set that holds it."""
    inclusion = found.inclusion
    labels = [effect.label for effect in effects if effect.modes_count]
    if not any(inclusion[label] > PLAUSIBLE for label in labels):
        return {}
    return _companies(found, labels)


def _companies(found: SetProbabilities, labels: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return vibrations, each with the other causes of the most probable set that holds it and nothing generic."""
    beside = {}
    for label in labels:
        own = next(item for item in found.sets if label in item.causes and item.generic is None)
        beside[label] = tuple(name for name in own.causes if name not in labels)
    return beside


def with_fitted_vibrations(weighed: WeighedState, effects: Sequence[Effect]) -> WeighedState:
    """Return a state of the noise with the evidence of vibrations taken from fits, and the fit of the best set.

    Each vibration is fitted in its best company, with its frequency, its damping and the yielding of the base. What the
    Laplace evidence of that fit is above the linear one counts in all sets that hold the vibration. A fit that ends
    below the linear evidence has failed and counts for nothing.

    Parameters
    ----------
    weighed : WeighedState
    effects : sequence of Effect
        Candidates of the catalogue.
    """
    point, found = weighed.state.point, weighed.found
    gains: dict[str, float] = {}
    fits: dict[str, Fit] = {}
    linear = {}
    for label, others in _companies(found, [effect.label for effect in effects if effect.modes_count]).items():
        names = tuple(sorted((*others, label)))
        known = next((item.log_evidence for item in found.sets if item.names == names), None)
        linear[label, names] = point.evidence.log_evidence(names) if known is None else known
    for label, names in sorted(linear, key=lambda key: -linear[key]):
        hopeless = min((fit.cost for fit in fits.values()), default=np.inf) + BEHIND
        try:
            fits[label] = fit_hypothesis(weighed.state, names, effects, hopeless).fit
        except InputError:  # no motion with this vibration
            continue
        gains[label] = max(fits[label].log_evidence - point.log_nothing - linear[label, names], 0.0)
    if not gains:
        return weighed
    each = {item.names: item.log_evidence for item in found.sets}
    sets = [replace(item, log_evidence=_corrected(item, gains, each)) for item in found.sets]
    corrected = SetProbabilities.of(sets, found.causes, found.generics, found.prior)
    top = next((item for item in corrected.sets if item.names), None)
    chosen = [label for label in fits if top is not None and label in top.causes]
    return replace(weighed, found=corrected, best=fits[chosen[0]] if chosen else weighed.best)


def _corrected(item: CauseSet, gains: Mapping[str, float], known: Mapping[tuple[str, ...], float]) -> float:
    """Return the log evidence of a set with the gain of its vibration.

    Two vibrations of the linear model may stand for one that is not linear: a set with both is at least as probable as
    one of them fitted, but does not gain again.
    """
    own = [name for name in item.causes if name in gains]
    if len(own) < 2:
        return item.log_evidence + sum(gains[name] for name in own)
    values = [item.log_evidence]
    for label in own:
        fewer = tuple(name for name in item.names if name == label or name not in own)
        values.append(known.get(fewer, -np.inf) + gains[label])
    return max(values)
