"""Evidence of any set of causes relative to nothing, from the Gram alone.

Amplitudes and scales are integrated out (D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992, with the
average over the scales in place of their most probable values), and the forms of each cause are averaged over.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import product

import numpy as np
from scipy.special import logsumexp

from bayesid._math.arrays import Floats, Integers, log_sum
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scale_integral import (
    GroupSpectrum,
    ScaleAverage,
    average_over_scales,
    log_evidences,
    log_evidences_beside,
    log_evidences_of_scores,
)
from bayesid.diagnosis.evidence.scales import CandidateCause

__all__ = ["SetEvidence", "near_best"]

FEW_COMBINATIONS = 8  # combinations of the forms of a set up to which all are integrated
MOST_FORMS = 20  # forms of one cause that are weighed beside a set: those that do best by themselves
FORMS_NEAR, MOST_NEAR = 4.0, 4  # nats below a cause's best form of those evaluated in full, and how many at most

_Forms = tuple[tuple[str, ...], tuple[int, ...]]  # causes, sorted, with a form of each


def near_best(values: Mapping[int, float]) -> list[int]:
    """Return the forms of a cause whose log evidence is near that of the best, the best first."""
    order = sorted(values, key=lambda form: (-values[form], form))[:MOST_NEAR]
    return [form for form in order if values[form] > values[order[0]] - FORMS_NEAR]


class SetEvidence:
    """Evidence of sets of causes.

    Parameters
    ----------
    gram : Gram
    causes : iterable of CandidateCause
        Candidates, generic ones included, whose groups are in the Gram.
    known : SetEvidence, optional
        Of another bank about the same fit: what is known of sets whose causes are the same objects in both is kept.

    Raises
    ------
    ValueError
        If two candidates have one name, or a candidate has no group, one that is not in the Gram, or one twice.
    """

    def __init__(self, gram: Gram, causes: Iterable[CandidateCause], known: SetEvidence | None = None) -> None:
        self.gram = gram
        self.causes: dict[str, CandidateCause] = {}
        for cause in causes:
            if cause.name in self.causes:
                raise ValueError(f"two causes have the name {cause.name!r}; names must differ")
            for groups, _ in cause.variants:
                absent = [group.name for group in groups if group.name not in gram.groups]
                if absent or not groups:
                    raise ValueError(f"{cause.name!r} needs groups of columns of the Gram, received {absent or 'none'}")
                if len({group.name for group in groups}) < len(groups):
                    raise ValueError(f"{cause.name!r} names one group of columns twice; each has one scale")
            self.causes[cause.name] = cause
        self._spectra: dict[str, tuple[tuple[GroupSpectrum, ...], ...]] = {}  # of the groups of each form
        self._chosen: dict[tuple[str, ...], dict[str, int]] = {}
        self._known: dict[_Forms, float] = {}
        self._gains: dict[tuple[_Forms, str], dict[int, float]] = {}  # beside a set, of each other cause
        self._scaled: dict[_Forms, tuple[Integers, Floats]] = {}
        if known is not None:
            self._take(known)
        new = {name: cause for name, cause in self.causes.items() if name not in self._spectra}
        spectra = iter(GroupSpectrum.of([g for cause in new.values() for v in cause.variants for g in v.groups], gram))
        self._spectra |= {
            name: tuple(tuple(next(spectra) for _ in variant.groups) for variant in cause.variants)
            for name, cause in new.items()
        }

    def _take(self, known: SetEvidence) -> None:
        """Take over what is known of causes that are the same objects in another bank about the same fit."""
        same = {name for name, cause in self.causes.items() if known.causes.get(name) is cause}
        for name in same:
            self._spectra[name] = tuple(
                tuple(
                    replace(spectrum, columns=group.columns(self.gram))
                    for spectrum, group in zip(spectra, variant.groups, strict=True)
                )
                for spectra, variant in zip(known._spectra[name], self.causes[name].variants, strict=True)
            )
        self._chosen |= {names: forms for names, forms in known._chosen.items() if same.issuperset(names)}
        self._known |= {key: value for key, value in known._known.items() if same.issuperset(key[0])}
        self._gains |= {key: gains for key, gains in known._gains.items() if same.issuperset((*key[0][0], key[1]))}

    @cached_property
    def catalogue(self) -> tuple[str, ...]:
        """Names of the causes of the catalogue, sorted."""
        return tuple(sorted(name for name, cause in self.causes.items() if not cause.generic))

    @cached_property
    def generics(self) -> tuple[str, ...]:
        """Names of the generic causes, sorted."""
        return tuple(sorted(name for name, cause in self.causes.items() if cause.generic))

    @property
    def invisible(self) -> tuple[str, ...]:
        """Names of the candidates that the data cannot see within their physical bounds, sorted."""
        return tuple(
            name
            for name, forms in sorted(self._spectra.items())
            if not any(spectrum.range.visible for form in forms for spectrum in form)
        )

    def forms(self, names: Iterable[str]) -> dict[str, int]:
        """Return the most probable form of each cause of a set, by its place among `CandidateCause.variants`.

        Where there are many combinations the forms are chosen one cause after another, each beside those before it, and
        once more beside all others.
        """
        ordered = tuple(sorted(names))
        if ordered not in self._chosen:
            self._chosen[ordered] = self._most_probable_forms(ordered)
        return dict(self._chosen[ordered])

    def _most_probable_forms(self, ordered: Sequence[str]) -> dict[str, int]:
        combinations = self._combinations(ordered)
        if combinations is not None:
            best = combinations[0]
            if len(combinations) > 1:
                best = max(combinations, key=lambda forms: self._log_evidence(ordered, forms))
            return dict(zip(ordered, best, strict=True))
        chosen = {name: 0 for name in ordered if len(self._spectra[name]) == 1}
        several = sorted(set(ordered) - set(chosen), key=lambda name: (-self.of_forms(name).max(), name))
        for name in (*several, *several) if len(ordered) > 1 else several:
            chosen.pop(name, None)
            gains = self.gains_beside(chosen, chosen, [name])[name]
            chosen[name] = max(gains, key=lambda form: (gains[form], -form))
        return chosen

    def _combinations(self, ordered: Sequence[str]) -> list[tuple[int, ...]] | None:
        """Return all combinations of the forms of some causes, or None where they are many."""
        counts = [len(self._spectra[name]) for name in ordered]
        return list(product(*map(range, counts))) if math.prod(counts) <= FEW_COMBINATIONS else None

    def gains_beside(
        self, names: Iterable[str], forms: Mapping[str, int], others: Iterable[str]
    ) -> dict[str, dict[int, float]]:
        """Return what each other cause adds to the log evidence of a set, by the cause's forms: a screening of sets.

        The set's scales are held at their most probable values, at which its amplitudes take their share of the Gram;
        what remains is a Gram of single causes. One such Gram serves all other causes. Scales that the addition moves
        make the true gain larger.

        Parameters
        ----------
        names : iterable of str
        forms : mapping of str to int
            Form of each of the set's causes.
        others : iterable of str
            Causes to add, each by itself, in those of its forms that do best by themselves.
        """
        others, ordered = list(others), tuple(sorted(names))
        beside: _Forms = ordered, tuple(forms[name] for name in ordered)
        new = {name: self.ranked[name][:MOST_FORMS] for name in others if (beside, name) not in self._gains}
        if ordered and new:
            for name, gains in self._left_by(ordered, forms, new).items():
                self._gains[beside, name] = gains
        else:
            for name, places in new.items():
                self._gains[beside, name] = dict(zip(places, self.of_forms(name)[list(places)], strict=True))
        return {name: self._gains[beside, name] for name in others}

    def _left_by(
        self, names: Sequence[str], forms: Mapping[str, int], others: Mapping[str, Sequence[int]]
    ) -> dict[str, dict[int, float]]:
        """Return `of_forms` of other causes, each in some of its forms, on what a set leaves them."""
        several = {name for name in others if self.causes[name].fixed or max(map(len, self._spectra[name])) > 1}
        places = [(name, place) for name, some in others.items() if name not in several for place in some]
        values: dict[str, dict[int, float]] = {name: {} for name in others}
        if places:
            gram = replace(self.gram, score=self.score_beside(names))
            spectra = [self._spectra[name][place][0] for name, place in places]
            each = log_evidences_beside(spectra, *self.most_probable(names, forms), gram)
            for (name, place), value in zip(places, each.tolist(), strict=True):
                values[name][place] = value + self.causes[name].variants[place].log_weight
        if several:
            causes = [self.causes[name].in_forms(others[name]) for name in sorted(several)]
            groups = {group.name for cause in causes for variant in cause.variants for group in variant.groups}
            rest = SetEvidence(self.beside(names, forms, groups), causes)
            for name in several:
                values[name] = dict(zip(others[name], rest.of_forms(name), strict=True))
        return values

    def places(self, names: Iterable[str], forms: Mapping[str, int] | None = None) -> list[tuple[str, int]]:
        """Return the groups of a set, each by its cause and its place in that, in the order of the integration.

        The order, and so the last digit of the result, depends neither on the order of the names nor on that of the
        candidates: the group with most columns comes first.

        Parameters
        ----------
        names : iterable of str
        forms : mapping of str to int, optional
            Form of each cause; by default the most probable ones.
        """
        forms = self.forms(names) if forms is None else forms
        sizes = {
            (name, place): len(spectrum.columns)
            for name in sorted(names)
            for place, spectrum in enumerate(self._spectra[name][forms[name]])
        }
        return sorted(sizes, key=lambda place: -sizes[place])

    def spectra(self, names: Iterable[str], forms: Mapping[str, int] | None = None) -> list[GroupSpectrum]:
        """Return the spectra of the groups of a set, in the order of `places`.

        Parameters
        ----------
        names : iterable of str
        forms : mapping of str to int, optional
            Form of each cause; by default the most probable ones.
        """
        forms = self.forms(names) if forms is None else forms
        return [self._spectra[name][forms[name]][place] for name, place in self.places(names, forms)]

    def average(self, names: Iterable[str]) -> ScaleAverage:
        """Return the evidence of a set in its most probable form, and the posterior of its scales."""
        ordered = sorted(names)
        forms = self.forms(ordered)
        return self._of(ordered, tuple(forms[name] for name in ordered))

    def log_evidence(self, names: Iterable[str], choices: Sequence[Mapping[str, int]] | None = None) -> float:
        """Return the logarithm of the evidence of a set, relative to nothing, averaged over the forms of its causes.

        Parameters
        ----------
        names : iterable of str
        choices : sequence of mappings of str to int, optional
            Forms of each cause beyond which the evidence is negligible; by default all, or the best of each.
        """
        ordered = sorted(names)
        forms = self._choices(ordered)
        if choices is not None:
            forms = [tuple(choice[name] for name in ordered) for choice in choices]
        values = [self._log_evidence(ordered, choice) for choice in forms]
        best = dict(zip(ordered, forms[int(np.argmax(values))], strict=True))
        return log_sum(values) + self._bodily(ordered, best)

    def _log_evidence(self, ordered: Sequence[str], forms: tuple[int, ...]) -> float:
        """Return the log evidence of causes in given forms, times the prior probability of these."""
        key = (tuple(ordered), forms)
        if key not in self._known:
            self._known[key] = self._of(ordered, forms).log_evidence + self._log_weight(ordered, forms)
        return self._known[key]

    def _bodily(self, ordered: Sequence[str], forms: Mapping[str, int]) -> float:
        """Return what it adds to the log evidence of a set that some of its amplitudes are moments of a body.

        A body has a positive mass at a place, where the linear prior has ten free moments. Each is weighed beside the
        others of the set at their most probable scales, both ways.
        """
        total = 0.0
        for name in ordered:
            cause = self.causes[name]
            if cause.body is not None:
                (group,) = cause.variants[forms[name]].groups
                beside = self.beside([other for other in ordered if other != name], forms, [group.name])
                lightest = self._spectra[name][forms[name]][0].range.low
                body = cause.body.log_evidence(beside.matrix, beside.score, lightest)
                alone = SetEvidence(beside, [replace(cause, groups=(group,), others=(), shares=())])
                total += body - alone._of([name], (0,)).log_evidence
        return total

    @cached_property
    def bodily(self) -> dict[str, float]:
        """What it adds to the log evidence of each cause by itself that its amplitudes are moments of a body."""
        names = [name for name, cause in self.causes.items() if cause.body is not None]
        return {name: self._bodily([name], self.forms([name])) for name in names}

    def beside(self, names: Iterable[str], forms: Mapping[str, int], groups: Iterable[str]) -> Gram:
        """Return the Gram of some groups of columns after a set at its most probable scales has taken its share.

        Parameters
        ----------
        names : iterable of str
        forms : mapping of str to int
            Form of each of the set's causes.
        groups : iterable of str
            Names of the groups in the Gram.
        """
        names = list(names)
        if not names:
            return self.gram.keeping(sorted(groups))
        gram = replace(self.gram, score=self.score_beside(names))
        return gram.conditioned(*self.most_probable(names, forms), sorted(groups))

    def _log_weight(self, ordered: Sequence[str], forms: Sequence[int]) -> float:
        """Return the logarithm of the prior probability of a combination of forms."""
        return sum(self.causes[name].variants[form].log_weight for name, form in zip(ordered, forms, strict=True))

    def of_forms(self, name: str) -> Floats:
        """Return the logarithms of the evidence of each form of one cause, times the form's prior probability."""
        return np.array(
            [
                (self._of([name], (form,)).log_evidence if alone is None else alone) + variant.log_weight
                for form, (alone, variant) in enumerate(zip(self._alone[name], self.causes[name].variants, strict=True))
            ]
        )

    @cached_property
    def _alone(self) -> dict[str, list[float | None]]:
        """Logarithm of the evidence of each form of each cause, None for those of several groups or of fixed size."""
        places = [
            (name, place)
            for name, forms in self._spectra.items()
            for place, form in enumerate(forms)
            if len(form) == 1 and not self.causes[name].fixed
        ]
        values = log_evidences([self._spectra[name][place][0] for name, place in places])
        known = dict(zip(places, values.tolist(), strict=True))
        return {name: [known.get((name, k)) for k in range(len(forms))] for name, forms in self._spectra.items()}

    def most_probable(self, names: Iterable[str], forms: Mapping[str, int]) -> tuple[Integers, Floats]:
        """Return the columns of a set and the standard deviations of their amplitudes at the most probable scales.

        What physics fixes is left out.

        Parameters
        ----------
        names : iterable of str
        forms : mapping of str to int
            Form of each cause.

        Returns
        -------
        columns : (k,) array of int
        deviations : (k,) array
            In the units of the amplitudes.
        """
        ordered = tuple(sorted(names))
        key = (ordered, tuple(forms[name] for name in ordered))
        if key not in self._scaled:
            average = self._of(*key)
            where = np.unravel_index(int(np.argmax(average.log_posterior)), average.log_posterior.shape)
            columns, deviations = [np.zeros(0, dtype=int)], [np.zeros(0)]
            spectra = self.spectra([name for name in ordered if not self.causes[name].fixed], forms)
            for nodes, index, spectrum in zip(average.nodes, where, spectra, strict=True):
                columns.append(spectrum.columns)
                deviations.append(nodes.scales[index] * spectrum.root)
            self._scaled[key] = np.concatenate(columns), np.concatenate(deviations)
        return self._scaled[key]

    def score_beside(self, names: Iterable[str]) -> Floats:
        """Return the score of all columns after the causes of fixed size among a set are in the model."""
        return self._with_fixed(sorted(names), self.gram.score[None])[0][0]

    def _choices(self, ordered: Sequence[str]) -> list[tuple[int, ...]]:
        """Return the combinations of forms that are integrated: all, or those near the best."""
        if (combinations := self._combinations(ordered)) is not None:
            return combinations
        if len(ordered) == 1:
            return [(form,) for form in self.ranked[ordered[0]]]
        best = self.forms(ordered)
        near = {name: near_best(self.gains_beside(set(best) - {name}, best, [name])[name]) for name in best}
        return [
            choice
            for choice in product(*(near[name] for name in ordered))
            if sum(form != best[name] for name, form in zip(ordered, choice, strict=True)) < 2
        ]

    @cached_property
    def ranked(self) -> dict[str, tuple[int, ...]]:
        """Forms of each cause, the most probable by itself first."""
        return {name: tuple(np.argsort(-self.of_forms(name), kind="stable").tolist()) for name in self._spectra}

    def _of(self, ordered: Sequence[str], forms: tuple[int, ...]) -> ScaleAverage:
        """Return the evidence of causes, sorted, in given forms."""
        free = [name for name in ordered if not self.causes[name].fixed]
        chosen = dict(zip(ordered, forms, strict=True))
        spectra = self.spectra(free, chosen)
        if len(free) == len(ordered):
            return average_over_scales(spectra, self.gram)
        shifted, gain = self._with_fixed(ordered, self.gram.score[None])
        moved = [
            replace(spectrum, score=spectrum.vectors.T @ (spectrum.root * shifted[0][spectrum.columns]))
            for spectrum in spectra
        ]
        average = average_over_scales(moved, replace(self.gram, score=shifted[0]))
        return average._replace(log_evidence=average.log_evidence + float(gain[0]))

    def _with_fixed(self, ordered: Sequence[str], scores: Floats) -> tuple[Floats, Floats]:
        """Return scores, (d, m), after the causes of fixed size are in the model, and what those gain, (d,)."""
        gain = np.zeros(len(scores))
        for name in ordered:
            if self.causes[name].fixed:
                columns = self.gram.groups[self.causes[name].groups[0].name]
                gain = gain - scores[:, columns].sum(axis=1) - 0.5 * self.gram.matrix[np.ix_(columns, columns)].sum()
                scores = scores + self.gram.matrix[:, columns].sum(axis=1)
        return scores, gain

    def log_evidences(self, names: Iterable[str], scores: Floats) -> Floats:
        """Return the logarithm of the evidence of one set for many scores, shape (d,).

        The nodes are those of `log_evidence`, unless the set has so many groups that their product is thinned.

        Parameters
        ----------
        names : iterable of str
        scores : (d, m) array
            Scores of all columns of the Gram.
        """
        ordered = sorted(names)
        free = [name for name in ordered if not self.causes[name].fixed]
        shifted, gain = self._with_fixed(ordered, scores)
        values = []
        for forms in self._choices(ordered):
            spectra = self.spectra(free, dict(zip(ordered, forms, strict=True)))
            each = log_evidences_of_scores(spectra, self.gram, shifted)
            values.append(each + self._log_weight(ordered, forms))
        return np.asarray(logsumexp(values, axis=0)) + gain
