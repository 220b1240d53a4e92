"""Sets of causes at one noise, enumerated about the best of them and linearised there anew until the model holds.

Vibrations are not linear in their frequency and coupling: where one is plausible all of them are fitted in full, and
their evidence is corrected by these fits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.memory import give_back_memory
from bayesid.diagnosis.candidates.cause_kind import cause_kinds, companies, kind_of
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank
from bayesid.diagnosis.evidence.cause_sets import CauseSet, SetProbabilities, enumerate_sets
from bayesid.diagnosis.noise.noise_model import NoiseModel
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.fitted_set import Hypothesis, fit_hypothesis, fit_in_amplitudes
from bayesid.diagnosis.search.linearisation import Catalogue, linearise, linearise_along_data
from bayesid.diagnosis.settings import DiagnosisSettings
from bayesid.simulation.effects.effect import Effect

__all__ = ["SetSearch", "plausible_vibrations", "search_sets", "with_fitted_vibrations"]


@dataclass(frozen=True)
class SetSearch:
    """All sets of causes, weighed under one model of the noise.

    Attributes
    ----------
    noise : NoiseModel
    point : Linearisation
        About the best set, with bursts of the sensors among its candidates.
    probabilities : SetProbabilities
    best : Fit
        Of the most probable set that names all of its causes.
    """

    noise: NoiseModel
    point: Linearisation
    probabilities: SetProbabilities
    best: Fit

    @property
    def log_nothing(self) -> float:
        """Logarithm of the evidence of the present model with this noise and no other cause."""
        return self.point.log_nothing + self.noise.log_charge

    @property
    def highest(self) -> float:
        """Log evidence of the best explanation."""
        return self.log_nothing + max(cause_set.log_evidence for cause_set in self.probabilities.sets)

    def fit(self, causes: Sequence[str], effects: Sequence[Effect], hopeless: float = np.inf) -> Hypothesis:
        """Fit the present model with some causes (`fit_hypothesis`).

        Parameters
        ----------
        causes : sequence of str
            Names of causes.
        effects : sequence of Effect
            Candidates of the catalogue.
        hopeless : float
            Cost at which a fit that nears its end is given up.
        """
        return fit_hypothesis(self.point, self.noise.faults, causes, effects, hopeless)


def search_sets(noise: NoiseModel, catalogue: Catalogue, base: Linearisation | None = None) -> SetSearch:
    """Enumerate, linearise about the best set where the linear model fails there, and again until it holds.

    Parameters
    ----------
    noise : NoiseModel
    catalogue : Catalogue
    base : Linearisation, optional
        About the fit of the noise model, which has no causes.
    """
    if base is None and noise.bodies_fixed:
        base = linearise_along_data(noise.perturbed, catalogue)
    base = _with_suggested(linearise(noise.perturbed, noise.fit, catalogue) if base is None else base)
    point, probabilities = _tuned(base, enumerate_sets(base.evidence, catalogue.prior), catalogue)
    best, bodies_fixed = base.fit, base.bodies_fixed
    del base
    if bodies_fixed:
        point, probabilities = _about_large_causes(point, probabilities, catalogue)
        best = point.fit
    else:
        for _ in range(catalogue.settings.most_linearisations):
            causes = _best_known(probabilities, catalogue)
            if not causes:
                break
            fit, expected = fit_in_amplitudes(point, causes, catalogue.effects, catalogue.settings.restart_from)
            if not np.isfinite(fit.cost) or fit.cost > best.cost:
                break
            best = fit
            if abs(fit.cost - expected) < catalogue.settings.agrees:
                break
            perturbed = point.perturbed
            del point  # with its columns, before those about the new fit are computed
            point = _with_suggested(linearise(perturbed, best, catalogue))
            point, probabilities = _tuned(point, enumerate_sets(point.evidence, catalogue.prior), catalogue)
    return SetSearch(noise, point.without_products(), probabilities, best)


def _tuned(
    point: Linearisation, probabilities: SetProbabilities, catalogue: Catalogue
) -> tuple[Linearisation, SetProbabilities]:
    """Resolve plausible forms between those of the grid, such as frequencies of vibrations and instants of a jump."""
    shaped = False
    for kind in cause_kinds():
        refined = kind.refined(
            point, probabilities, kind.of(catalogue.effects), catalogue.bounds, catalogue.settings.plausible
        )
        if refined is not point and not kind.linearised_beside:
            probabilities = enumerate_sets(refined.evidence, catalogue.prior)
        shaped = shaped or (refined is not point and kind.linearised_beside)
        point = refined
    return point, enumerate_sets(point.evidence, catalogue.prior) if shaped else probabilities


def _about_large_causes(
    base: Linearisation, probabilities: SetProbabilities, catalogue: Catalogue
) -> tuple[Linearisation, SetProbabilities]:
    """Weigh every set about the nearest motion, where the present model itself comes nowhere near the data.

    A linear model about the fit of some causes cannot say what happens without one of them that is large: it lets
    others make up for it that never would. Sets that hold all large causes of a fit are therefore weighed about that
    fit, with free bodies, and the others along the data, until the most probable set has a fit of its own.
    """
    near: dict[frozenset[str], _Near] = {}
    fitted: set[frozenset[str]] = set()
    point, along = base, probabilities
    for _ in range(catalogue.settings.most_linearisations):
        names = frozenset(_best_known(probabilities, catalogue))
        if not names or names in fitted:
            break
        fit, _ = fit_in_amplitudes(base, sorted(names), catalogue.effects, catalogue.settings.restart_from)
        if not np.isfinite(fit.cost):
            break
        fitted.add(names)
        point = _with_suggested(linearise(base.perturbed, fit, catalogue, far=True))
        large = _large(point, names, catalogue.settings)
        near[large] = _Near(point, enumerate_sets(point.evidence, catalogue.prior, beside=large))
        probabilities = _nearest(_Near(base, along), near, point.log_nothing)
    return point, probabilities


def _large(point: Linearisation, names: frozenset[str], settings: DiagnosisSettings) -> frozenset[str]:
    """Return the causes of a fit without which its motion would be another: bodies do not make up for them.

    Beside a cause that moves the base far, a small one takes up what the linear model gets wrong of it.
    """
    evidence = point.with_bodies_fixed().evidence
    rest = {name: names - {name} for name in names}
    whole = evidence.log_evidence(names)
    lost = {name: whole - (evidence.log_evidence(others) if others else 0.0) for name, others in rest.items()}
    least = max(settings.cannot_be_left_out, settings.not_linear * max(lost.values()))
    return frozenset(name for name, loss in lost.items() if loss > least)


class _Near(NamedTuple):
    """A linearisation, and the sets that are weighed there."""

    point: Linearisation
    probabilities: SetProbabilities


def _nearest(along: _Near, near: Mapping[frozenset[str], _Near], log_nothing: float) -> SetProbabilities:
    """Return the probabilities of all sets, each from the fit with most of its large causes, or else along the data."""
    best: dict[tuple[tuple[str, ...], str | None], tuple[int, CauseSet]] = {}
    for size, (point, probabilities) in [(0, along), *((len(names), there) for names, there in near.items())]:
        for cause_set in probabilities.sets:
            key = (cause_set.causes, cause_set.generic)
            if key not in best or size >= best[key][0]:
                moved = replace(cause_set, log_evidence=cause_set.log_evidence + point.log_nothing - log_nothing)
                best[key] = size, moved
    sets = (cause_set for _, cause_set in best.values())
    return along.probabilities.with_sets(sets)


def _with_suggested(point: Linearisation) -> Linearisation:
    """Return the linearisation with what the residual suggests among its candidates, such as bursts of the sensors."""
    suggested = (kind.suggested(point.perturbed, point.fit) for kind in cause_kinds())
    extended = point.with_bank(SignatureBank.joined([point.bank, *suggested]))
    give_back_memory()
    return extended


def _best_known(probabilities: SetProbabilities, catalogue: Catalogue) -> tuple[str, ...]:
    """Return those of the most probable set that names all of its causes about whose fit the model is linearised.

    They have one form. None where another has several forms and these are not so large by themselves that the linear
    model may be wrong about all others.
    """
    known = {cause_set.causes: cause_set.log_evidence for cause_set in probabilities.sets if cause_set.generic is None}
    best = next((causes for causes in known if causes), ())
    kinds = {effect.label: kind_of(effect) for effect in catalogue.effects}
    best = tuple(name for name in best if name not in kinds or not kinds[name].linearised_beside)
    certain = tuple(name for name in best if name not in kinds or kinds[name].one_form)
    if certain == best or known.get(certain, 0.0) > catalogue.settings.cannot_be_left_out:
        return certain
    return ()


def plausible_vibrations(probabilities: SetProbabilities, catalogue: Catalogue) -> bool:
    """Return whether a cause of a kind whose evidence takes a fit, such as a vibration, is plausible.

    Parameters
    ----------
    probabilities : SetProbabilities
    catalogue : Catalogue
    """
    kinds = (kind for kind in cause_kinds() if kind.weighed_by_fits)
    return any(
        kind.plausible(probabilities, kind.of(catalogue.effects), catalogue.settings.plausible) for kind in kinds
    )


def with_fitted_vibrations(search: SetSearch, catalogue: Catalogue) -> SetSearch:
    """Return a search with the evidence of vibrations taken from fits, and the fit of the best set.

    Each vibration is fitted in its best company, with its frequency, its damping and the yielding of the base. What the
    Laplace evidence of that fit is above the linear one counts in all sets that hold the vibration. A fit that ends
    below the linear evidence has failed and counts for nothing.

    Parameters
    ----------
    search : SetSearch
    catalogue : Catalogue
    """
    point, probabilities = search.point, search.probabilities
    gains: dict[str, float] = {}
    fits: dict[str, Fit] = {}
    each = {cause_set.names: cause_set.log_evidence for cause_set in probabilities.sets}
    linear = {}
    for label, others in companies(probabilities, catalogue.weighed_by_fits).items():
        names = tuple(sorted((*others, label)))
        linear[label, names] = each[names] if names in each else point.evidence.log_evidence(names)
    for label, names in sorted(linear, key=lambda key: -linear[key]):
        hopeless = min((fit.cost for fit in fits.values()), default=np.inf)
        hopeless += catalogue.settings.vibration_far_behind
        try:
            fits[label] = search.fit(names, catalogue.effects, hopeless).fit
        except InputError:  # no motion with this vibration
            continue
        gains[label] = max(fits[label].log_evidence - point.log_nothing - linear[label, names], 0.0)
    if not gains:
        return search
    sets = [replace(cause_set, log_evidence=_corrected(cause_set, gains, each)) for cause_set in probabilities.sets]
    corrected = probabilities.with_sets(sets)
    top = next((cause_set for cause_set in corrected.sets if cause_set.names), None)
    named = [label for label in fits if top is not None and label in top.causes]
    return replace(search, probabilities=corrected, best=fits[named[0]] if named else search.best)


def _corrected(cause_set: CauseSet, gains: Mapping[str, float], known: Mapping[tuple[str, ...], float]) -> float:
    """Return the log evidence of a set with the gain of its vibration.

    Two vibrations of the linear model may stand for one that is not linear: a set with both is at least as probable as
    one of them fitted, but does not gain again.
    """
    vibrations = [name for name in cause_set.causes if name in gains]
    if len(vibrations) < 2:
        return cause_set.log_evidence + sum(gains[name] for name in vibrations)
    values = [cause_set.log_evidence]
    for label in vibrations:
        fewer = tuple(name for name in cause_set.names if name == label or name not in vibrations)
        values.append(known.get(fewer, -np.inf) + gains[label])
    return max(values)
