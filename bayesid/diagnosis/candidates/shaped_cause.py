"""Causes with a shape, such as instants, decays or a period: proposed in Gram space, then tuned with their own columns.

The bank holds a few forms, so that the cause is weighed and its power is known. Where something is there, the best
shape beside each of the most probable sets is proposed from the cosines of the generic candidates
(`bayesid.diagnosis.candidates.courses`), tuned by exact signatures, and added as one more form with the share of the
prior of the shape that the data leave: Laplace's approximation in its numbers (L. Tierney and J. B. Kadane, Accurate
approximations for posterior moments and marginal densities, JASA 81, 1986).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayesid._math.arrays import Floats, log_sum
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseAmplitude, CauseKind
from bayesid.diagnosis.candidates.courses import half_chi2
from bayesid.diagnosis.candidates.linear_model import Linearisation, Remaining, SignatureBank, Signatures
from bayesid.diagnosis.evidence.cause_sets import CauseSet, SetProbabilities
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.residual_view import by_recording
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound, Quantity

__all__ = ["ShapeProposal", "ShapedCause", "form_of", "responses_of"]

SHARE = 0.5
"""Prior probability of tuned shapes; the rest is that of the forms of the bank."""

COMPANIES = 3
"""Most probable sets of other causes, none among them, beside which shapes are proposed where something generic gains
there."""

WORTH = 6.0
"""Nats that a proposal must earn beyond its prior to be tuned: what a cause has to earn to be named is 8."""

LOST = 0.2
"""Share of what a shape gains that the cosines may lose, being too slow for it."""

ROUNDS, NARROWER, STEPS = 5, 3.0, (-1.0, -0.5, 0.5, 1.0)
"""Rounds of the tuning, each with a reach so many times smaller, and the steps that are tried of each number."""

SIZES = 4.0 ** np.arange(6)
"""Distances relative to the last reach at which it is measured how well the data know a number."""

POINTS, WIDENED = 8, 4.0
"""Values on either side of a tuned one by which its error is measured, and the factor by which a short reach grows."""


@dataclass(frozen=True)
class ShapeProposal:
    """A shape that Gram space proposes.

    Attributes
    ----------
    effect : Effect
        With the shape.
    gain : float
        Half of what chi-square decreases by it [nats].
    log_prior : float
        Logarithm of its share among the shapes that were compared.
    widths : (n,) array
        Range of each number of the shape, over which it is uniform beforehand.
    log_share : float
        Logarithm of the prior probability of what is discrete in it, such as the number of events.
    log_others : float
        Logarithm of the mean likelihood of all shapes relative to this one, where Gram space has it: where many do as
        well, as pulses do whose single steps are not seen, the cause has more than its best shape.
    log_occam : float
        Logarithm of the factor by which the freedom of the amplitudes lowers the evidence below that of the best
        amplitudes: one event in each recording has more of it than one that recurs.
    """

    effect: Effect
    gain: float
    log_prior: float
    widths: Floats
    log_share: float
    log_others: float = -np.inf
    log_occam: float = 0.0

    @property
    def worth(self) -> float:
        """What it earns beyond its prior [nats]."""
        return self.gain + self.log_prior


class ShapedCause(CauseKind):
    """Causes that are linear in amplitudes once their shape is chosen."""

    linearised_beside: ClassVar[bool] = True

    alone_as_well: ClassVar[bool] = False
    """Whether the best shape beside nothing is tuned in addition to the most probable one in other company."""

    def trials(self, effect: Effect, ends: Floats) -> list[tuple[Effect, bool]]:
        """Return the forms of the bank, and of each whether it stands for one in each recording by itself.

        Parameters
        ----------
        effect : Effect
        ends : (R,) array
            Lengths of the recordings [s].
        """
        raise NotImplementedError

    def of_recording(self, trial: Effect, recording: int) -> Effect:
        """Return what a form of the bank that stands for one in each recording is in one of them."""
        raise NotImplementedError

    def proposals(self, point: Linearisation, effect: Effect, causes: Sequence[str]) -> list[ShapeProposal]:
        """Return the shapes that are worth tuning beside some causes."""
        raise NotImplementedError

    def shape(self, effect: Effect) -> tuple[Floats, Floats]:
        """Return the numbers of a shape and the reach of each within which it is first tuned, (n,) both."""
        raise NotImplementedError

    def with_shape(self, effect: Effect, numbers: Floats) -> Effect | None:
        """Return an effect with other numbers of its shape, None where they make none."""
        raise NotImplementedError

    def shape_quantities(self, effect: Effect, names: Sequence[str]) -> list[Quantity]:
        """Return names and units of the numbers of a shape, given the names of the recordings."""
        raise NotImplementedError

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of a few forms of each cause."""
        ends = np.asarray(fit.operating.sample.environment.time).max(axis=1)
        signatures: list[Signatures] = []
        causes = []
        for effect in effects:
            forms = []
            trials = self.trials(effect, ends)
            responses = responses_of(perturbed, fit, [trial for trial, _ in trials])
            for number, ((trial, apart), columns) in enumerate(zip(trials, responses, strict=True)):
                parts = list(enumerate(by_recording(fit.posterior, columns))) if apart else [(None, columns)]
                for recording, part in parts:
                    where = "" if recording is None else f" in recording {recording + 1}"
                    one = trial if recording is None else self.of_recording(trial, recording)
                    label = f"{effect.label} #{number + 1}{where}"
                    parts_of_form, groups = form_of(label, one, part, bounds[effect.label])
                    signatures += [replace(signature, recording=recording) for signature in parts_of_form]
                    forms.append(groups)
            causes.append(CandidateCause(effect.label, forms[0], others=tuple(forms[1:])))
        return SignatureBank(tuple(signatures), tuple(causes))

    def refined(
        self, point: Linearisation, weighed: SetProbabilities, effects: Sequence[Effect], bounds: Bounds, least: float
    ) -> Linearisation:
        """Return the linear model with tuned forms of every cause that is worth it, or the same."""
        bank, evidence = point.bank, point.evidence
        mine = {effect.label for effect in effects}
        companies = [causes for causes in _companies(weighed, mine) if _something_left(evidence, causes)]
        likeliest = weighed.sets[0].log_prior + weighed.sets[0].log_evidence
        for effect in effects:
            tuned: list[tuple[float, tuple[str, ...], ShapeProposal]] = []
            for causes in companies:
                log_others = evidence.log_evidence(causes) if causes else 0.0
                proposals = self.proposals(point, effect, causes)
                tuned += [(log_others + proposal.worth, causes, proposal) for proposal in proposals]
            worth_it = [trial for trial in tuned if trial[2].worth > WORTH and _near(likeliest, trial[0], trial[2])]
            tuned = _with_exact_gains(point, worth_it, bounds[effect.label])
            if not tuned:
                continue
            names = [manoeuvre.recording.name for manoeuvre in point.fit.posterior.manoeuvres]
            forms: list[tuple[AmplitudeGroup, ...]] = []
            log_shares = []
            for total, causes, proposal in self._best_by_company(tuned):
                if not _near(likeliest, total, proposal):
                    continue
                tuning = self._tuned(point, proposal, causes, likeliest - total + proposal.gain)
                if tuning is None:
                    continue
                exact, log_share = tuning
                label = f"{effect.label} tuned with {' + '.join(causes) or 'nothing'}"
                (columns,) = responses_of(point.perturbed, point.fit, [exact])
                items, groups = form_of(label, self.with_names(exact, names), columns, bounds[effect.label])
                bank = replace(bank, signatures=(*bank.signatures, *items))
                forms.append(groups)
                log_shares.append(log_share)
            if not forms:
                continue
            cause = next(cause for cause in bank.causes if cause.name == effect.label)
            weights = [(1.0 - SHARE) * float(np.exp(variant.log_weight)) for variant in cause.variants]
            more = replace(
                cause,
                others=(*(variant.groups for variant in cause.variants[1:]), *forms),
                shares=(*weights, *(SHARE * float(np.exp(max(share, -200.0))) / len(forms) for share in log_shares)),
            )
            others = tuple(more if one is cause else one for one in bank.causes)
            bank = replace(bank, causes=others)
        return point if bank is point.bank else point.with_bank(bank)

    def _best_by_company(
        self, tuned: Sequence[tuple[float, tuple[str, ...], ShapeProposal]]
    ) -> list[tuple[float, tuple[str, ...], ShapeProposal]]:
        """Return the most probable proposal, and if wanted that beside nothing."""

        def evidence(trial: tuple[float, tuple[str, ...], ShapeProposal]) -> float:
            return trial[0] + trial[2].log_occam

        best = max(tuned, key=evidence)
        alone = [trial for trial in tuned if not trial[1]]
        if not self.alone_as_well or not best[1] or not alone:
            return [best]
        return [best, max(alone, key=evidence)]

    def with_names(self, effect: Effect, names: Sequence[str]) -> Effect:
        """Return an effect whose amplitudes have the names of their recordings."""
        return effect

    def _tuned(
        self, point: Linearisation, proposal: ShapeProposal, causes: Sequence[str], enough: float
    ) -> tuple[Effect, float] | None:
        """Return the effect whose shape has the least chi-square beside some causes, and the log of its prior's share.

        Of each number the share is what the data leave of its range, ``sqrt(2 pi)`` standard deviations, and shapes
        elsewhere count as far as they do as well. None where the proposal gains far from enough.
        """
        left = Remaining.of(point, causes, point.evidence.forms(causes))
        best, reach = self.shape(proposal.effect)
        axes = np.eye(len(best))

        def values(trials: Sequence[Floats]) -> Floats:
            possible = {k: self.with_shape(proposal.effect, trial) for k, trial in enumerate(trials)}
            known = {k: effect for k, effect in possible.items() if effect is not None}
            halves = np.full(len(trials), -np.inf)
            for k, columns in zip(known, responses_of(point.perturbed, point.fit, list(known.values())), strict=True):
                gram = left.gram(columns, "trial")
                halves[k] = half_chi2(gram.matrix, gram.score)
            return halves

        (first,) = values([best])
        if first < enough - max(WORTH, LOST * first):
            return None
        most = first
        for _ in range(ROUNDS):
            moves = [step * size * axis for axis, size in zip(axes, reach, strict=True) for step in STEPS]
            alone = values([best + move for move in moves]).reshape(len(best), -1)
            gains = alone.max(axis=1) > most
            chosen = [moves[len(STEPS) * k + int(np.argmax(row))] for k, row in enumerate(alone)]
            together = best + sum(move for move, gain in zip(chosen, gains, strict=True) if gain)
            trials = [(most, best), (float(alone.max()), best + moves[int(np.argmax(alone))])]
            if gains.sum() > 1:
                trials.append((float(values([together])[0]), together))
            most, best = max(trials, key=lambda trial: trial[0])
            reach = reach / NARROWER
        sizes = reach[:, None] * SIZES
        sided: list[Floats] = [
            best + sign * size * axis for axis, row in zip(axes, sizes, strict=True) for size in row for sign in (-1, 1)
        ]
        drops = most - values(sided).reshape(*sizes.shape, 2).mean(axis=2)
        log_volume = 0.0
        for row, drop, width in zip(sizes, drops, proposal.widths, strict=True):
            place = int(np.argmax(drop > 0.5)) if (drop > 0.5).any() else -1
            spread = row[place] * np.sqrt(np.pi / drop[place]) if 0.0 < drop[place] < np.inf else 2.0 * row[place]
            log_volume += float(np.log(min(spread / width, 1.0))) if drop[place] > 0.0 else 0.0
        effect = self.with_shape(proposal.effect, best)
        log_share = float(np.logaddexp(proposal.log_share + log_volume, proposal.log_others - (most - first)))
        return proposal.effect if effect is None else effect, min(log_share, 0.0)

    def with_form(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Effect:
        """Return the effect in its most probable form."""
        return point.most_probable_form(effect.label, names).effect or effect

    def starts(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Sequence[Floats]:
        """Return the mean amplitudes by the linear model."""
        sigma = [parameter.sigma for parameter in self.with_form(effect, point, names).parameters]
        return [point.mean_amplitudes(effect.label, names) / np.array(sigma)]

    def quantities(self, effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
        """Return the amplitudes of each effect in one form of the bank."""
        return {effect.label: tuple(effect.amplitude_quantities) for effect in effects}

    def instants(self, perturbed: PerturbedModel, fit: Fit, label: str) -> list[CauseAmplitude]:
        """Return the numbers of the shape of a cause, each with the error that the others leave it, fixed where it is.

        Beside it the amplitudes and all unknowns are fitted anew, to first order about the fit.
        """
        mine = (k for k, added in enumerate(fit.effects) if added.cause_kind == self.name and added.candidate == label)
        if (index := next(mine, None)) is None:
            return []
        effect, values = fit.effects[index], fit.values(index)
        numbers, reach = self.shape(effect)
        names = [manoeuvre.recording.name for manoeuvre in fit.posterior.manoeuvres]
        here = responses_of(perturbed, fit, [effect])[0] @ values
        numbers_of_shape = []
        for place, quantity in enumerate(self.shape_quantities(effect, names)):
            wide = reach[place] / NARROWER**ROUNDS
            for _ in range(ROUNDS + 1):
                steps = wide * np.arange(-POINTS, POINTS + 1) / POINTS
                moved = [self.with_shape(effect, numbers + step * (np.arange(len(numbers)) == place)) for step in steps]
                there = np.array([trial is not None for trial in moved])
                columns = responses_of(perturbed, fit, [trial for trial in moved if trial is not None])
                changes = np.stack([moved_columns @ values - here for moved_columns in columns], axis=1)
                steps = steps[there]
                cost = fit.residual @ changes + 0.5 * np.diag(fit.project(changes))
                weight = np.exp(cost.min() - cost)
                weight /= weight.sum()
                if max(weight[0], weight[-1]) < 1e-3:
                    break
                wide *= WIDENED
            mean = float(weight @ steps)
            sd = float(np.sqrt(weight @ (steps - mean) ** 2 + (wide / POINTS) ** 2 / 12.0))
            numbers_of_shape.append(CauseAmplitude(quantity, float(numbers[place]) + mean, sd))
        return numbers_of_shape


def _near(likeliest: float, total: float, proposal: ShapeProposal) -> bool:
    """Return whether a proposal may reach the log probability of the most probable set once it is tuned."""
    return total >= likeliest - max(WORTH, LOST * proposal.gain)


def _with_exact_gains(
    point: Linearisation,
    trials: Sequence[tuple[float, tuple[str, ...], ShapeProposal]],
    bounds: Sequence[PhysicalBound],
) -> list[tuple[float, tuple[str, ...], ShapeProposal]]:
    """Return proposals with the gains and evidence of their own signatures, by which they can be compared.

    The cosines overrate a shape where its company has taken directions that they resolve badly.
    """
    exact = []
    for causes in dict.fromkeys(causes for _, causes, _ in trials):
        left = Remaining.of(point, causes, point.evidence.forms(causes))
        beside = [(total, proposal) for total, others, proposal in trials if others == causes]
        responses = responses_of(point.perturbed, point.fit, [proposal.effect for _, proposal in beside])
        for (total, proposal), columns in zip(beside, responses, strict=True):
            of_units, groups = form_of("trial", proposal.effect, columns, bounds)
            gram = left.gram(np.concatenate([part.columns for part in of_units], axis=1), "trial")
            gain = float(half_chi2(gram.matrix, gram.score))
            places = np.split(np.arange(len(gram.score)), np.cumsum([part.columns.shape[1] for part in of_units])[:-1])
            split = replace(gram, groups=dict(zip((part.name for part in of_units), places, strict=True)))
            evidence = SetEvidence(split, [CandidateCause("trial", groups)])
            log_occam = evidence.log_evidence(("trial",)) - gain
            with_gain = replace(proposal, gain=gain, log_occam=log_occam)
            exact.append((total + gain - proposal.gain, causes, with_gain))
    return exact


def _companies(probabilities: SetProbabilities, mine: set[str]) -> list[tuple[str, ...]]:
    """Return nothing, the most probable sets of other causes, and what is most probable beside something generic.

    All of the most probable sets may hold a cause that stands for the shape, as something generic may: the most
    probable one counts without each of its causes, too.
    """
    companies: dict[tuple[str, ...], None] = {(): None}
    for cause_set in probabilities.sets:
        if cause_set.generic is None:
            companies[_others(cause_set, mine)] = None
        if len(companies) == COMPANIES:
            break
    best = next(filter(None, companies), ())
    companies |= {tuple(name for name in best if name != left_out): None for left_out in best}
    unnamed = next((cause_set for cause_set in probabilities.sets if cause_set.generic is not None), None)
    return list(companies if unnamed is None else companies | {_others(unnamed, mine): None})


def _others(cause_set: CauseSet, mine: set[str]) -> tuple[str, ...]:
    return tuple(name for name in cause_set.causes if name not in mine)


def _something_left(evidence: SetEvidence, causes: Sequence[str]) -> bool:
    """Return whether any generic candidate gains beside some causes."""
    gains = evidence.gains_beside(causes, evidence.forms(causes), evidence.generics)
    return any(log_sum(list(of_forms.values())) > 0.0 for of_forms in gains.values())


def responses_of(perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect]) -> list[Floats]:
    """Return the responses to unit amplitudes of some effects, (N, m) each.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
    effects : sequence of Effect
        In fixed shapes.
    """
    widths = [np.array([parameter.sigma for parameter in effect.parameters]) for effect in effects]
    points = [(effect, np.zeros(len(sigma))) for effect, sigma in zip(effects, widths, strict=True)]
    columns = perturbed.columns_together(points, fit.operating, fit.z, fit.data) if points else []
    return [part / sigma for part, sigma in zip(columns, widths, strict=True)]


def form_of(
    name: str, effect: Effect, columns: Floats, bounds: Sequence[PhysicalBound]
) -> tuple[list[Signatures], tuple[AmplitudeGroup, ...]]:
    """Return the signatures of a form and its groups, one for each unit.

    Parameters
    ----------
    name : str
        Of the form.
    effect : Effect
        In this form.
    columns : (N, m) array
        Responses to its unit amplitudes.
    bounds : sequence of PhysicalBound
        One for each unit.
    """
    items, groups = [], []
    units = np.array([parameter.unit for parameter in effect.parameters])
    for bound in bounds:
        whole = f"{name} [{bound.unit}]"
        items.append(Signatures(whole, columns[:, units == bound.unit], effect=effect))
        groups.append(AmplitudeGroup(whole, bound.largest))
    return items, tuple(groups)
