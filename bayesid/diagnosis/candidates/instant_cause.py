"""Causes that set in at an unknown instant of each recording, such as a mass that moves over inside the base.

The bank holds one such cause in one recording, at instants of a grid. The same amplitudes may set in in several
recordings, each at its own instant (a tank that is switched, a part that falls over whenever the arm moves), and at
high ratios of signal to noise the grid is too coarse. The information on the amplitudes is a sum over the recordings in
which it acts, so that instants are sought one recording after another in Gram space, first on the grid and then from
sample to sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations_with_replacement, product

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseAmplitude, CauseKind
from bayesid.diagnosis.candidates.generic_cause import instants_of_each
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank, Signatures
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scale_integral import GroupSpectrum, log_evidences
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.residual_view import by_recording, rows_of
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound, Quantity
from bayesid.simulation.effects.mass_shift import MassShift

__all__ = ["InstantCause", "MassShiftCause", "grid_instants", "sample_intervals"]

INSTANTS = 16
"""Instants of the grid in each recording."""

SWEEPS = 3
"""Most times that the instant of every recording is sought beside those of the others."""

POINTS = 8
"""Instants tried on either side in each round, which end at the interval of the samples; and of the fitted one."""

SHARE = 0.5
"""Prior probability of the instants of all recordings together; the rest is that of one recording and the grid."""

FINER = 0.25
"""First interval of the instants about the fitted one, relative to that of the samples."""

EDGE = 1e-4
"""Largest weight of the outermost of them, relative to all; where they have more, the intervals are widened."""

WIDENED = 4.0
"""By this factor."""


class InstantCause(CauseKind):
    """Causes whose effect has an instant in each recording as a constant, and else is linear in its amplitudes.

    The constants are `Effect.instants`, infinite where the effect does not act. All its amplitudes are one group, whose
    bound is that of the first unit. Through `Effect.table` it may act at another instant in each recording
    (`Effect.in_recording`); through other hooks one instant serves all.
    """

    name = "instant"

    def responses(self, perturbed: PerturbedModel, fit: Fit, effect: Effect, instants: Floats) -> Floats:
        """Return the responses of each recording to unit amplitudes that set in at some instants of its own.

        By default the effect is perturbed at each instant by its own hooks.

        Parameters
        ----------
        perturbed : PerturbedModel
        fit : Fit
        effect : Effect
        instants : (R, K) array
            Instants in each recording [s]; infinite ones change nothing.

        Returns
        -------
        (R, K, rows, m) array
        """
        sigma = np.array([parameter.sigma for parameter in effect.parameters])
        points = [(effect.at(tuple(row)), np.zeros(len(sigma))) for row in instants.T.tolist()]
        columns = perturbed.columns(points, fit.operating, fit.z, fit.data)
        return np.stack([by_recording(fit.posterior, own / sigma) for own in columns], axis=1)

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of causes whose forms are one recording and one instant of its grid.

        The recordings are independent given the unknowns, so that one perturbation acts on all of them at once.
        """
        grid = _grid(fit)
        banks = []
        for effect in effects:
            columns = self.responses(perturbed, fit, effect, _padded(grid))
            size, spread = _spread(effect, bounds[effect.label])
            signatures = [
                Signatures(
                    f"{effect.label} at {instant:.5g} s in recording {r + 1}",
                    columns[r, k],
                    r,
                    instants=tuple(float(instant) if other == r else np.inf for other in range(len(grid))),
                )
                for r, row in enumerate(grid)
                for k, instant in enumerate(row)
            ]
            forms = [(AmplitudeGroup(item.name, size, spread=spread),) for item in signatures]
            cause = CandidateCause(effect.label, forms[0], others=tuple(forms[1:]))
            banks.append(SignatureBank(tuple(signatures), (cause,)))
        return SignatureBank.joined(banks)

    def refined(
        self, point: Linearisation, found: SetProbabilities, effects: Sequence[Effect], bounds: Bounds, least: float
    ) -> Linearisation:
        """Return the linear model with the most probable instants of all recordings among the forms of its causes.

        Every number of recordings may be concerned, and each at any sample; all choices are equally probable
        beforehand.
        """
        for effect in effects:
            if found.inclusion[effect.label] >= least:
                best = next(item for item in found.sets if effect.label in item.causes)
                others = tuple(name for name in best.causes if name != effect.label)
                events = {form.effect.candidate for form in point.bank.signatures if form.effect is not None}
                # an event among them may stand for the jump of a recording in which the grid has none
                for company in {others: None, tuple(name for name in others if name not in events): None}:
                    point = self._tuned(point, effect, company, bounds[effect.label])
        return point

    def with_form(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Effect:
        """Return the effect at the instants of its most probable form."""
        return effect.at(point.most_probable_form(effect.label, names).instants or ())

    def starts(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Sequence[Floats]:
        """Return the mean amplitudes by the linear model."""
        sigma = np.array([parameter.sigma for parameter in effect.parameters])
        return [point.mean_amplitudes(effect.label, names) / sigma]

    def quantities(self, effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
        """Return the amplitudes of each effect."""
        return {effect.label: tuple(effect.amplitude_quantities) for effect in effects}

    def instants(self, perturbed: PerturbedModel, fit: Fit, label: str) -> list[CauseAmplitude]:
        """Return the instant [s] in each recording in which a cause acts, with a prior that is uniform.

        Beside it the amplitudes and all unknowns are fitted anew, to first order about the fit; the other recordings
        keep their instants.
        """
        mine = (k for k, own in enumerate(fit.effects) if own.cause_kind == self.name and own.candidate == label)
        index = next(mine, None)
        if index is None:
            return []
        effect = fit.effects[index]
        count = len(fit.posterior.manoeuvres)
        fitted = np.broadcast_to(effect.instants, count)
        times = np.asarray(fit.operating.sample.environment.time)
        reach = FINER * POINTS * np.array([np.median(steps) for steps in sample_intervals(fit)])
        found: dict[int, tuple[float, float]] = {}
        unsettled = [r for r in range(count) if 0.0 <= fitted[r] <= times[r].max()]
        while unsettled:
            tried = fitted[:, None] + reach[:, None] * np.arange(-POINTS, POINTS + 1) / POINTS
            finite = np.where(np.isfinite(tried), tried, np.inf)
            changes = self.responses(perturbed, fit, effect, finite) @ fit.values(index)  # (R, K, rows)
            for r in list(unsettled):
                weight = _weights(fit, r, changes[r])
                inside = (tried[r] >= 0.0) & (tried[r] <= times[r].max())
                weight = np.where(inside, weight, 0.0) / weight[inside].sum()
                if max(weight[0], weight[-1]) > EDGE and reach[r] < times[r].max():
                    reach[r] *= WIDENED
                    continue
                found[r] = _mean_and_sd(weight, tried[r], reach[r] / POINTS)
                unsettled.remove(r)
        names = [item.recording.name for item in fit.posterior.manoeuvres]
        return [CauseAmplitude(Quantity(f"{names[r]}.time", "s"), *found[r]) for r in sorted(found)]

    def _tuned(
        self, point: Linearisation, effect: Effect, others: Sequence[str], bounds: Sequence[PhysicalBound]
    ) -> Linearisation:
        """Return the linear model with one more form: an instant for each recording, sought beside other causes."""
        ends = np.asarray(point.fit.operating.sample.environment.time).max(axis=1)
        intervals = sample_intervals(point.fit)
        finest = np.array([np.median(steps) for steps in intervals])
        grid = _grid(point.fit)
        size, spread = _spread(effect, bounds)
        group = AmplitudeGroup(effect.label, size, spread=spread)
        chosen: list[float | None] = [None] * len(ends)
        reach = ends / instants_of_each(INSTANTS, len(ends))
        choices = [list(map(float, row)) for row in grid]
        while True:
            chosen = self._sought(point, effect, others, group, choices, chosen)
            if (reach < finest).all() or not any(instant is not None for instant in chosen):
                break
            around = zip(chosen, reach, ends, strict=True)
            choices = [_around(instant, wide, float(end)) for instant, wide, end in around]
            reach = reach / POINTS
        samples = [len(steps) + 1 for steps, instant in zip(intervals, chosen, strict=True) if instant is not None]
        if not samples:
            return point
        share = _share(samples, len(ends))
        instants = tuple(np.inf if instant is None else instant for instant in chosen)
        name = f"{effect.label} at {', '.join(f'{instant:.5g}' for instant in instants)} s"
        if any(signatures.name == name for signatures in point.bank.signatures):  # sought beside others before
            return point
        columns = self.responses(point.perturbed, point.fit, effect, np.array(instants)[:, None])[:, 0]
        item = Signatures(name, columns.reshape(-1, columns.shape[-1]), instants=instants)
        cause = next(cause for cause in point.bank.causes if cause.name == effect.label)
        tuned = replace(
            cause,
            others=(*(variant.groups for variant in cause.variants[1:]), (replace(group, name=name),)),
            shares=(*((1.0 - SHARE) * np.exp(variant.log_weight) for variant in cause.variants), share),
        )
        causes = tuple(tuned if one is cause else one for one in point.bank.causes)
        return point.with_bank(replace(point.bank, signatures=(*point.bank.signatures, item), causes=causes))

    def _sought(
        self,
        point: Linearisation,
        effect: Effect,
        others: Sequence[str],
        group: AmplitudeGroup,
        choices: Sequence[Sequence[float]],
        chosen: Sequence[float | None],
    ) -> list[float | None]:
        """Return the best instant of each recording among some, or None where the cause does not act."""
        padded = _padded(choices)
        columns = self.responses(point.perturbed, point.fit, effect, padded)
        items = [Signatures(f"{r},{k}", columns[r, k], r) for r, row in enumerate(choices) for k in range(len(row))]
        gram = _beside(point, items, others, effect.label)
        best = [None if now is None else int(np.argmin(np.abs(padded[r] - now))) for r, now in enumerate(chosen)]
        sizes = [len(row) for row in choices]
        if not any(k is not None for k in best):
            best = _best_pair(gram, group, sizes)
        value = _weighed(gram, group, best, sizes)
        for _ in range(SWEEPS):
            before = list(best)
            for r, row in enumerate(choices):
                for k in (None, *range(len(row))):
                    trial = [*best[:r], k, *best[r + 1 :]]
                    now = _weighed(gram, group, trial, sizes)
                    if now > value:
                        best, value = trial, now
            if best == before:
                break
        return [None if k is None else float(padded[r, k]) for r, k in enumerate(best)]


class MassShiftCause(InstantCause):
    """Jumps of the base's first and second moments, whose columns depend neither on the robot nor on its motion."""

    name = "mass-shift"

    def responses(self, perturbed: PerturbedModel, fit: Fit, effect: Effect, instants: Floats) -> Floats:
        """Return the responses to unit moments that jump at some instants, from one perturbation for many of them."""
        parts = -(-instants.shape[1] // max(1, perturbed.most_pushes // len(effect.parameters)))
        some = np.array_split(instants, parts, axis=1) if parts > 1 else [instants]
        return np.concatenate([self._together(perturbed, fit, part) for part in some], axis=1)

    def _together(self, perturbed: PerturbedModel, fit: Fit, instants: Floats) -> Floats:
        tables = []
        for side in (fit.operating.node, fit.operating.sample):
            time = np.asarray(side.environment.time)
            each = [[MassShift.table_at(time[r], instant) for r, instant in enumerate(row)] for row in instants.T]
            tables.append(np.moveaxis(np.array(each), -1, 1))  # (K, 9, R, T, 28)
        some, count = tables[0].shape[:2]
        rows = [part.reshape(some * count, *part.shape[2:]) for part in tables]
        perturbation = perturbed.perturbation(some * count, node_rows=rows[0], sample_rows=rows[1])
        found = by_recording(fit.posterior, perturbed.respond(perturbation, fit.z, fit.data))
        return np.moveaxis(found.reshape(*found.shape[:2], some, count), 2, 1)


def _share(samples: Sequence[int], recordings: int) -> float:
    """Return the prior probability of one instant in each of some recordings, which have so many samples."""
    return SHARE / (2.0**recordings - 1.0) / float(np.prod(samples, dtype=float))


def _mean_and_sd(weight: Floats, times: Floats, interval: float) -> tuple[float, float]:
    """Return mean and standard deviation of a time that is uniform in intervals of these probabilities."""
    mean = float(weight @ times)
    return mean, float(np.sqrt(weight @ (times - mean) ** 2 + interval**2 / 12.0))


def grid_instants(end: float, count: int = INSTANTS) -> Floats:
    """Return the instants of the grid in a recording of some length [s].

    Parameters
    ----------
    end : float
    count : int
        Number of instants.
    """
    return end * (np.arange(count) + 0.5) / count


def _grid(fit: Fit) -> list[Floats]:
    """Return the instants [s] at which a jump is tried first in every recording: an even grid, and its shocks."""
    ends = np.asarray(fit.operating.node.environment.time).max(axis=1)
    count = instants_of_each(INSTANTS, len(ends))
    felt = [[shock.middle for shock in recorded.shocks] for recorded in fit.posterior.data.recorded]
    return [np.append(grid_instants(float(end), count), own) for end, own in zip(ends, felt, strict=True)]


def _padded(rows: Sequence[Floats | Sequence[float]]) -> Floats:
    """Return instants of each recording as an array (R, K) whose shorter rows end with infinite ones."""
    most = max(map(len, rows))
    return np.array([[*row, *[np.inf] * (most - len(row))] for row in rows])


def sample_intervals(fit: Fit) -> list[Floats]:
    """Return the intervals between the sampling times of each recording [s], without the copies that fill its grid."""
    steps = np.diff(np.asarray(fit.operating.sample.environment.time), axis=1)
    return [row[row > 0.0] for row in steps]


def _spread(effect: Effect, bounds: Sequence[PhysicalBound]) -> tuple[float, Floats]:
    """Return the bound of the amplitudes of the first unit, and the variances of all relative to its square."""
    sizes = {bound.unit: bound.largest for bound in bounds}
    each = np.array([sizes[quantity.unit] for quantity in effect.amplitude_quantities])
    return float(each[0]), (each / each[0]) ** 2


def _around(instant: float | None, reach: float, end: float) -> list[float]:
    if instant is None:
        return []
    tried = instant + reach * np.arange(-POINTS, POINTS + 1) / POINTS
    return sorted({float(time) for time in np.clip(tried, 0.0, end)})


def _beside(point: Linearisation, items: Sequence[Signatures], others: Sequence[str], label: str) -> Gram:
    """Return the Gram of instants after the other causes, at their most probable scales, have taken their share."""
    evidence = point.evidence
    names = {g.name for name in others for form in evidence.causes[name].variants for g in form.groups}
    names |= {name for name, values in point.present.items() if np.any(values)}
    rest = [item for item in point.bank.signatures if item.name in names]
    cause = replace(
        evidence.causes[label],
        groups=(AmplitudeGroup(items[0].name, 1.0),),
        others=tuple((AmplitudeGroup(item.name, 1.0),) for item in items[1:]),
        shares=(),
    )
    bank = SignatureBank((*rest, *items), (*(evidence.causes[name] for name in others), cause))
    own = point.with_bank(bank).evidence
    return own.beside(others, own.forms(others), [item.name for item in items])


def _best_pair(gram: Gram, group: AmplitudeGroup, sizes: Sequence[int]) -> list[int | None]:
    """Return the best instants of one or two recordings, and None of the others, from which all are sought in turn.

    Jumps in two recordings may be imitated by a single one at the start of either, which gives that recording a body of
    its own, and from there no change of one instant alone leads to both.
    """
    tried: list[list[int | None]] = [[None] * len(sizes)]
    for one, other in combinations_with_replacement(range(len(sizes)), 2):
        pairs = product(range(sizes[one]), range(sizes[other])) if one != other else ((k, k) for k in range(sizes[one]))
        tried += [[{one: k, other: j}.get(r) for r in range(len(sizes))] for k, j in pairs]
    return max(tried, key=lambda trial: _weighed(gram, group, trial, sizes))


def _weighed(gram: Gram, group: AmplitudeGroup, best: Sequence[int | None], sizes: Sequence[int]) -> float:
    """Return the log evidence of the same amplitudes in all recordings in which the cause acts, at one of so many."""
    acting = [(r, k) for r, k in enumerate(best) if k is not None]
    if not acting:
        return 0.0
    own = [gram.groups[f"{r},{k}"] for r, k in acting]
    matrix = np.sum([gram.matrix[np.ix_(one, two)] for one in own for two in own], axis=0)
    score = np.sum([gram.score[one] for one in own], axis=0)
    spectra = GroupSpectrum.of([group], Gram(matrix, score, {group.name: np.arange(len(score))}))
    return float(log_evidences(spectra)[0]) - float(sum(np.log(sizes[r]) for r, _ in acting))


def _weights(fit: Fit, recording: int, changes: Floats) -> Floats:
    """Return the likelihood of each instant of a recording relative to the best, from their changes (K, rows)."""
    change = np.zeros((len(fit.residual), len(changes)))
    change[rows_of(fit.posterior, recording)] = (changes - changes[POINTS]).T
    cost = fit.residual @ change + 0.5 * np.diag(fit.project(change))
    return np.asarray(np.exp(cost.min() - cost))
