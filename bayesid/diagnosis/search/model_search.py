"""Probabilities of all sets of causes and of faults of the noise, alone and two together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid._math.memory import give_back_memory
from bayesid.diagnosis.candidates.linear_model import Linearisation
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities, enumerate_sets
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import classes_of_equivalents
from bayesid.diagnosis.noise import noise_faults
from bayesid.diagnosis.noise.family_alarm import FamilyAlarm, noise_tests
from bayesid.diagnosis.noise.noise_fault import FitResidual
from bayesid.diagnosis.noise.noise_model import NoiseModel
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.search.linearisation import Catalogue, linearise, linearise_along_data
from bayesid.diagnosis.search.relinearise import SetSearch, plausible_vibrations, search_sets, with_fitted_vibrations
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings

__all__ = ["ModelSearch", "search_models"]


@dataclass(frozen=True)
class ModelSearch:
    """All explanations with their probabilities.

    Attributes
    ----------
    base : Linearisation
        About the fit of the present model.
    alarm : FamilyAlarm
    searches : tuple of SetSearch
        Under the noise as declared first, then under the faults that were weighed.
    probabilities : SetProbabilities
        Of sets of causes, faults of the noise among them.
    settings : DiagnosisSettings
    """

    base: Linearisation
    alarm: FamilyAlarm
    searches: tuple[SetSearch, ...]
    probabilities: SetProbabilities
    settings: DiagnosisSettings = DEFAULT_SETTINGS

    @property
    def highest(self) -> float:
        """Log evidence of the best explanation."""
        return max(search.highest for search in self.searches)

    @property
    def noise(self) -> set[str]:
        """Names of the faults of the noise that were weighed."""
        return {name for search in self.searches for name in search.noise.names}

    def under(self, causes: Sequence[str]) -> SetSearch:
        """Return the search under the faults of the noise that are among some causes."""
        faulty = self.noise & set(causes)
        return next((search for search in self.searches if set(search.noise.names) == faulty), self.searches[0])

    def widened(self, bound: float, floor: float) -> SetProbabilities:
        """Return the probabilities with the bounds and the floors of all scales multiplied by factors.

        Only sets that matter are evaluated anew, in the most probable forms of their causes; the others keep their
        evidence.

        Parameters
        ----------
        bound, floor : float
        """
        probabilities = self.probabilities
        matter = {
            name
            for cause_set in probabilities.sets
            if cause_set.probability >= self.settings.matters
            for name in cause_set.names
        }
        wider = {
            search.noise.names: SetEvidence(
                search.point.evidence.gram,
                [
                    cause.rescaled(search.point.evidence.gram, bound, floor)
                    for name, cause in search.point.evidence.causes.items()
                    if name in matter
                ],
            )
            for search in self.searches
        }
        sets = []
        for cause_set in probabilities.sets:
            search = self.under(cause_set.causes)
            evidence = search.point.evidence
            names = [name for name in cause_set.names if name in evidence.causes]
            if cause_set.probability >= self.settings.matters and names:
                forms = [evidence.forms(names)]
                change = wider[search.noise.names].log_evidence(names, forms) - evidence.log_evidence(names, forms)
                cause_set = replace(cause_set, log_evidence=cause_set.log_evidence + change)
            sets.append(cause_set)
        return probabilities.with_sets(sets)

    def classes(self) -> tuple[tuple[str, ...], ...]:
        """Return the causes in classes of equivalents; a fault of the noise is a class of its own.

        A cause is compared in the form that it has in the most probable set that holds it.
        """
        evidence = self.searches[0].point.evidence
        forms: dict[str, int] = {}
        for cause_set in self.probabilities.sets:
            if cause_set.probability < self.settings.matters:
                break
            names = [name for name in cause_set.names if name in evidence.causes]
            for name in (name for name in names if name not in forms):
                forms[name] = evidence.forms(names)[name]
        classes = classes_of_equivalents(evidence, self.settings.visible_information, forms)
        members = {name for names in classes for name in names}
        return (*classes, *((name,) for name in self.probabilities.causes if name not in members))


def search_models(
    perturbed: PerturbedModel,
    fit: Fit,
    catalogue: Catalogue,
    rng: np.random.Generator,
    progress: Progress = silent,
    *,
    bodies_fixed: bool = False,
) -> ModelSearch:
    """Weigh every set of causes.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
        Of the present model.
    catalogue : Catalogue
    rng : Generator
        For the alarm.
    progress : Progress, optional
    bodies_fixed : bool
        Whether the bodies are fixed in the fit, which diverged: the model is then linearised along the data.
    """
    progress(0.2, "computing the effect of each candidate")
    base = linearise_along_data(perturbed, catalogue) if bodies_fixed else linearise(perturbed, fit, catalogue)
    progress(0.4, "testing the present model")
    alarm = FamilyAlarm.of(base.evidence, fit, rng, level=catalogue.settings.alarm_level)
    every = noise_faults(fit.view.kinds).values()
    faults = [fault.label for fault in every if fault.occurs(perturbed.posterior)]
    declared = NoiseModel((), base.perturbed, base.fit, 0.0, base.bodies_fixed)
    if alarm.silent:
        single = SetSearch(declared, base, enumerate_sets(base.evidence, catalogue.prior, largest=1), base.fit)
        return ModelSearch(base, alarm, (single,), _joined([single], faults), catalogue.settings)
    progress(0.5, "weighing the sets of causes")
    bare, handed_over = base.without_products(), [base]
    del base  # the search drops its columns as soon as it has others
    first = search_sets(declared, catalogue, handed_over.pop())
    base = bare
    give_back_memory()
    searches = _with_faults(first, alarm, catalogue, progress)
    likeliest = max(searches, key=lambda search: search.highest)
    if plausible_vibrations(_joined(searches, faults), catalogue):
        progress(0.6, "fitting vibrations")
        fitted = with_fitted_vibrations(likeliest, catalogue)
        if likeliest is first:
            searches = _with_faults(fitted, alarm, catalogue, progress)
        else:
            searches = [fitted if search is likeliest else search for search in searches]
    return ModelSearch(base, alarm, tuple(searches), _joined(searches, faults), catalogue.settings)


def _joined(searches: Sequence[SetSearch], faults: Sequence[str]) -> SetProbabilities:
    """Return the probabilities of all sets, with evidence relative to the declared noise and nothing."""
    declared = searches[0]
    every = []
    for search in searches:
        offset = search.log_nothing - declared.log_nothing
        for cause_set in search.probabilities.sets:
            causes = tuple(sorted((*cause_set.causes, *search.noise.names)))
            every.append(replace(cause_set, causes=causes, log_evidence=cause_set.log_evidence + offset))
    probabilities = declared.probabilities
    return SetProbabilities.of(every, (*probabilities.causes, *faults), probabilities.generics, probabilities.prior)


def _with_faults(first: SetSearch, alarm: FamilyAlarm, catalogue: Catalogue, progress: Progress) -> list[SetSearch]:
    """Return the searches under the noise as declared, under suspected faults by themselves, and under two together.

    A fault takes its share of what causes explain, so that sets of causes add no more to it than they do to the
    declared noise. Faults with which the best explanation would stay behind even so are left out; the others are
    weighed with all sets of causes, the most promising first.
    """
    settings, log_suspect = catalogue.settings, float(np.log(catalogue.settings.suspect_p_value))
    reach = first.highest - first.log_nothing
    models: dict[tuple[str, ...], NoiseModel] = {}
    searches = {first.noise.names: first}

    def best() -> SetSearch:
        return max(searches.values(), key=lambda search: search.highest)

    def fit(before: NoiseModel, suspects: Sequence[tuple[str, Fit]]) -> None:
        for label, residual in suspects:
            if label in before.names:
                continue
            progress(0.6, f"fitting {label}")
            known = models.get(tuple(sorted((*before.names, label))))
            model = before.with_fault(label, residual, best().highest, known, settings)
            if model is not None and (known is None or model.log_nothing > known.log_nothing):
                models[model.names] = model
                searches.pop(model.names, None)

    def weigh() -> None:
        for model in sorted(models.values(), key=lambda model: -model.log_nothing):
            if model.names in searches or model.log_nothing + reach < best().highest - settings.fault_far_behind:
                continue
            progress(0.6, f"weighing the causes together with {' and '.join(model.names)}")
            searches[model.names] = search_sets(model, catalogue)
            give_back_memory()

    fit(first.noise, _suspects(alarm, first, log_suspect))
    if models:
        loudest = max(models.values(), key=lambda model: model.log_nothing)
        fit(loudest, [(label, loudest.fit) for label in _seen(loudest.fit, log_suspect)])
    weigh()
    if best() is not first:
        fit(best().noise, [(label, best().best) for label in _seen(best().best, log_suspect)])
        weigh()
    return list(searches.values())


def _seen(fit: Fit, log_suspect: float) -> list[str]:
    """Return the names of the faults that a residual shows."""
    return [name for name, log_p in noise_tests(FitResidual(fit)).items() if log_p < log_suspect]


def _suspects(alarm: FamilyAlarm, first: SetSearch, log_suspect: float) -> list[tuple[str, Fit]]:
    """Return the faults of the noise to weigh, each with the fit from whose residual its size follows.

    What the best set leaves counts first; a fault that only the present model's residual shows may yet explain all of
    it by itself, unless there is no such residual because the present model's fit diverged. A slow fault is weighed
    from both: causes that vary with time take its slow part, and what is left of coloured noise seems to have a short
    correlation time.
    """
    best, base = first.best, first.noise.fit
    suspects = [(name, best) for name in _seen(best, log_suspect)]
    of_best = {name for name, _ in suspects}
    faults = noise_faults(base.view.kinds)
    for name, log_p in () if first.noise.bodies_fixed else alarm.noise.items():
        if log_p < log_suspect and name in faults:
            again = best is not base and faults[name].slow
            if name not in of_best or again:
                suspects.append((name, base))
    return suspects
