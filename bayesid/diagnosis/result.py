"""Result of a diagnosis: everything that a report or a user asks for, and the content of diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

from bayesid._io.short_form import ShortForm, Summary, format_probability, format_spread
from bayesid._io.words import joined
from bayesid._math.arrays import Floats
from bayesid.design.design_result import Design
from bayesid.diagnosis.candidates.generic_cause import FEW
from bayesid.diagnosis.candidates.motion_errors import JOINT
from bayesid.diagnosis.evidence.cause_sets import CauseSet, SetProbabilities
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import UNKNOWN, ProbableVerdict, Remainder, Status, VerdictSensitivity
from bayesid.diagnosis.noise.family_alarm import FamilyAlarm
from bayesid.diagnosis.outcome.candidate_table import Candidate, amplitudes_of, amplitudes_of_others, instants_of
from bayesid.diagnosis.outcome.cause_sizes import GroupSize, group_sizes, vector_size
from bayesid.diagnosis.outcome.disturbance import DisturbingWrench, TorqueCorrelation, torque_correlations
from bayesid.diagnosis.outcome.gain import (
    FOLDS,
    Gain,
    ParameterChange,
    SimulationError,
    parameter_changes,
    simulation_errors,
    strongest_recording,
)
from bayesid.diagnosis.outcome.inseparable_causes import CausePair, inseparable_pairs
from bayesid.diagnosis.outcome.joint_error import JointError, joint_error
from bayesid.diagnosis.outcome.motion_change import MotionChange, motion_change
from bayesid.diagnosis.outcome.torque_reading import TorqueReading, TorquesNotRead
from bayesid.diagnosis.search.fitted_set import Hypothesis, extended_posterior, extended_start
from bayesid.diagnosis.search.model_search import ModelSearch
from bayesid.diagnosis.settings import FULL, DiagnosisSettings
from bayesid.inference import Identification
from bayesid.inference.body_quantities import ContractionVerdict, quantity
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound

__all__ = ["Diagnosis"]

SHOWN = 0.01  # probability down to which sets of causes are listed; the most probable one always is
PAIRS = 10  # largest number of pairs of causes that imitate each other in diagnosis.json


@dataclass(frozen=True, repr=False)
class Diagnosis(ShortForm):
    """Result of `diagnose`.

    Attributes
    ----------
    before : Hypothesis
        The present model.
    after : Hypothesis
        The extended model; the present one if nothing is named.
    search : ModelSearch
        Every set of causes with its probability.
    classes : tuple of tuples of str
        Causes that change the model in the same way.
    sensitivity : VerdictSensitivity
        The verdict, and what it would be under other choices.
    candidates : list of Candidate
        Every candidate cause, added alone to the present model.
    gain : Gain
        Present model against the extended one.
    disturbance : DisturbingWrench
        Torque and force on the base that would explain the residual of the present model.
    unexplained : DisturbingWrench
        The same for the residual with the named causes, or of the present model if none is named.
    torques : TorqueReading, TorquesNotRead or None
        What the joint torques add to the motion, or why they were not evaluated; None if the study has none.
    effects : tuple of Effect
        Candidates of the catalogue.
    bounds : mapping of str to tuple of PhysicalBound
        Largest plausible size of each candidate.
    seed : int
        Seed of all random numbers.
    seconds : dict of str to float
        Time by phase.
    identification : Identification or None
        Of the extended model, if it was sampled.
    not_sampled : str or None
        Why the sampling of the extended model failed.
    next_manoeuvre : Design or None
        Manoeuvre that would decide an undecided verdict, if it was designed.
    advice : str or None
        What to fly next, or why no manoeuvre was designed.
    """

    before: Hypothesis
    after: Hypothesis
    search: ModelSearch
    classes: tuple[tuple[str, ...], ...]
    sensitivity: VerdictSensitivity
    candidates: list[Candidate]
    gain: Gain
    disturbance: DisturbingWrench
    unexplained: DisturbingWrench
    torques: TorqueReading | TorquesNotRead | None
    effects: tuple[Effect, ...]
    bounds: Mapping[str, tuple[PhysicalBound, ...]]
    seed: int
    seconds: dict[str, float]
    identification: Identification | None = None
    not_sampled: str | None = None
    next_manoeuvre: Design | None = None
    advice: str | None = None

    @property
    def verdict(self) -> ProbableVerdict:
        """Status and named causes."""
        return self.sensitivity.verdict

    @property
    def remainder(self) -> Remainder:
        """Whether something acts in addition to the named causes, and how probable that is."""
        return self.verdict.remainder

    @property
    def probabilities(self) -> SetProbabilities:
        """Probabilities of all sets."""
        return self.search.probabilities

    @property
    def alarm(self) -> FamilyAlarm:
        """Whether the data contain more than the declared noise."""
        return self.search.alarm

    @property
    def bodies_fixed(self) -> bool:
        """Whether every fit of the present model diverged, so that its bodies stay at their prior's centre."""
        return self.search.base.bodies_fixed

    @property
    def settings(self) -> DiagnosisSettings:
        """Thresholds of the decisions."""
        return self.search.settings

    @property
    def evidence(self) -> SetEvidence:
        """Evidence of sets of causes about the present model's fit."""
        return self.search.base.evidence

    @property
    def named(self) -> bool:
        """Whether the verdict names causes."""
        return bool(self.verdict.causes)

    @property
    def recordings(self) -> list[str]:
        """Names of the recordings."""
        return [manoeuvre.recording.name for manoeuvre in self.before.fit.posterior.manoeuvres]

    @property
    def bounded(self) -> str | None:
        """What is weighed in only a part of many recordings, None if everything is weighed in all of them."""
        count = len(self.recordings)
        if count <= FULL:
            return None
        return (
            f"With {count} recordings the effort for each is limited: smooth disturbances of all speeds are weighed in "
            f"{FEW} of them, slow ones in all; pulses and jumps at fewer instants; causes with a separate time history "
            "in each recording, such as that of a wheel, are not candidates; the disturbance is reconstructed in the "
            f"{FULL} recordings with the largest residuals; the left-out score omits {FOLDS} groups of recordings in "
            "turn, by one linear step."
        )

    @property
    def residuals(self) -> list[ResidualView]:
        """Whitened residuals of the present model, and of the extended one where causes are named."""
        return [self.before.fit.view, self.after.fit.view] if self.named else [self.before.fit.view]

    @property
    def alternatives(self) -> tuple[tuple[str, ...], ...]:
        """Explanations that the verdict names, those of `verdict.causes` first; none if it names nothing."""
        verdict = self.verdict
        return (verdict.causes, *verdict.ambiguous_with) if verdict.causes else ()

    @property
    def differing_causes(self) -> tuple[str, ...]:
        """Causes that only some of the verdict's alternatives contain, the most probable alternative first."""
        if len(self.alternatives) < 2:
            return ()
        common = set.intersection(*map(set, self.alternatives))
        names = (name for causes in self.alternatives for name in causes if name not in common and name != UNKNOWN)
        return tuple(dict.fromkeys(names))

    @property
    def rivals(self) -> tuple[str, str] | None:
        """Two causes that the next manoeuvre should separate; None unless two of the verdict have adjustable sizes.

        They are the first two in which the alternatives of an ambiguous verdict differ, and the most probable two
        classes of an unresolved one.
        """
        match self.verdict.status:
            case Status.AMBIGUOUS:
                names = self.differing_causes
            case Status.UNRESOLVED:
                inclusion = self.probabilities.inclusion
                leading = [max(members, key=lambda name: inclusion[name]) for members in self.classes]
                names = tuple(sorted(leading, key=lambda name: -inclusion[name]))
            case _:
                return None
        sized = {effect.label for effect in self.effects if effect.parameters}
        pair = [name for name in names if name in sized][:2]
        return (pair[0], pair[1]) if len(pair) == 2 else None

    @property
    def unseen_candidates(self) -> tuple[Candidate, ...]:
        """Candidates that these manoeuvres could hardly have detected, the least visible first."""
        least = self.settings.weak_power
        weak = [(row.power, row) for row in self.candidates if row.power is not None and row.power < least]
        return tuple(row for _, row in sorted(weak, key=lambda entry: entry[0]))

    @cached_property
    def parameter_changes(self) -> tuple[ParameterChange, ...]:
        """Inertial parameters of the identified bodies: given, without the named causes, with them."""
        return parameter_changes(self.before, self.gain)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Inertial parameters whose posterior is their prior, so that the recordings do not determine them."""
        shrinkage = {change.name: 1.0 - change.fitted_sd / change.prior_sd for change in self.parameter_changes}
        return tuple(n for n, value in shrinkage.items() if ContractionVerdict.of(value) is ContractionVerdict.NOT)

    @cached_property
    def simulation_errors(self) -> tuple[SimulationError, ...]:
        """Errors of the simulation of every sensor, before and after."""
        return simulation_errors(self.before, self.after, self.gain)

    @cached_property
    def motion_change(self) -> MotionChange | None:
        """How far the motions predicted with and without the named causes are apart; None where none is named."""
        return motion_change(self.before, self.after) if self.named else None

    @property
    def strongest_recording(self) -> int:
        """Recording whose chi-square decreases most by the named causes, or is largest where none is named."""
        return strongest_recording(self.before, self.after if self.named else None)

    @cached_property
    def inseparable_pairs(self) -> tuple[CausePair, ...]:
        """Pairs of a named cause, or of the most probable ones, with every other, those that imitate best first."""
        named = [name for names in self.alternatives for name in names]
        return inseparable_pairs(self.evidence, named, self.probabilities.inclusion, self.classes)

    @cached_property
    def torque_correlations(self) -> list[TorqueCorrelation]:
        """Largest correlations of the torque of `disturbance` with motion, orbit and clock."""
        return torque_correlations(self.disturbance, self.before)

    @property
    def joint_error(self) -> JointError | None:
        """Error of a joint's recorded position by the position, if that is most probably what is unnamed."""
        probability = self.probabilities.inclusion.get(JOINT, 0.0)
        return joint_error(self.search.searches[0].point) if probability > self.settings.unknown_from else None

    @cached_property
    def posterior(self) -> Posterior:
        """The extended model's posterior, simulated in full."""
        return extended_posterior(self.after)

    @property
    def start(self) -> Floats:
        """The mode of the fit, as a starting point for `posterior`."""
        return extended_start(self.after, self.posterior)

    def class_of(self, cause: str) -> tuple[str, ...]:
        """Return the causes that the data cannot distinguish from one, including that cause itself."""
        return next((tuple(members) for members in self.classes if cause in members), (cause,))

    def probability_of(self, names: Sequence[str]) -> float:
        """Return the probability that all given causes are at work, alone or with others; without any, that none is.

        Parameters
        ----------
        names : sequence of str
            Causes, each of which stands for its class; ``unknown`` stands for any generic candidate.
        """
        if not names:
            return self.probabilities.nothing
        classes = [set(self.class_of(name)) for name in names if name != UNKNOWN]
        return float(
            sum(
                considered.probability
                for considered in self.probabilities.sets
                if all(not members.isdisjoint(considered.causes) for members in classes)
                and (UNKNOWN not in names or considered.generic is not None)
            )
        )

    def cause_probability(self, cause: str) -> float:
        """Return the probability that a cause or one of its equivalents is at work, alone or with others."""
        return self.probabilities.of_any(self.class_of(cause))

    def sizes_of(self, cause_set: CauseSet) -> list[GroupSize]:
        """Return the sizes of all causes of a set with their bounds, by cause and group of amplitudes."""
        return group_sizes(cause_set, self.search.under(cause_set.causes), self.bounds, self.candidates)

    def fitted(self, causes: Sequence[str]) -> Hypothesis:
        """Fit the present model with some causes of the catalogue."""
        return self.search.under(causes).fit(causes, self.effects) if causes else self.before

    def summary(self) -> Summary:
        """Return the verdict, its gain, and the candidates that are named or have a probability of one per cent."""
        verdict, probabilities, gain = self.verdict, self.probabilities, self.gain
        named = [
            f"{name} (probability {format_probability(self.cause_probability(name))})"
            for name in verdict.causes
            if name != UNKNOWN
        ]
        sentences = [
            f"Verdict: {verdict.status.value}" + (f", {joined(named)}." if named else "."),
            f"Probability of nothing {format_probability(probabilities.nothing)}, of something outside the catalogue "
            f"{format_probability(probabilities.unknown)}, in addition to the named causes "
            f"{format_probability(self.remainder.probability)}.",
            f"Chi-square per sample {gain.before.chi2_per_sample:.4g}"
            + (f", with the causes {gain.after.chi2_per_sample:.4g}." if named else "."),
        ]
        rows = []
        for row in self.candidates:
            if row.name in verdict.causes or row.probability >= SHOWN:
                after = amplitudes_of(self.after, row.name) if row.name in verdict.causes else None
                sizes = zip(row.quantities, row.mean, row.sd, strict=True) if after is None else after
                text = ", ".join(f"{key} {format_spread(mean, sd, unit)}" for (key, unit), mean, sd in sizes)
                rows.append((row.name, format_probability(row.probability), f"{row.signal_to_noise:.1f}", text))
        return Summary(sentences, ("cause", "probability", "signal/noise", "size"), rows)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of diagnosis.json."""
        verdict, probabilities = self.verdict, self.probabilities
        fitted = {name: _fitted(self, name) for name in verdict.causes}
        return {
            "status": verdict.status.value,
            "causes": [name for name in verdict.causes if name in probabilities.causes],
            "remainder": {"probability": self.remainder.probability, "verdict": self.remainder.verdict.value},
            "conventions": [],  # a wrong one ends a diagnosis before its search
            "equivalent_to": {cause: list(names) for cause, names in verdict.equivalent_to.items()},
            "ambiguous_with": [list(names) for names in verdict.ambiguous_with],
            "probability": {
                "nothing": probabilities.nothing,
                "unknown": probabilities.unknown,
                "causes": {members[0]: probabilities.of_any(members) for members in _ordered(self)},
            },
            "sets": _sets(self),
            "candidates": [_candidate(row, fitted.get(row.name)) for row in self.candidates],
            "unexplained": {"file": "unexplained.csv", **_wrench(self.unexplained)},
            "disturbance": {
                **_wrench(self.disturbance),
                "correlations": [correlation._asdict() for correlation in self.torque_correlations],
            },
            "joint_torques": _torques(self.torques),
            "bounded": self.bounded,
            "undetermined": list(self.undetermined),
            "bodies_held": self.bodies_fixed,
            "gain": _gain(self),
            "inertial_parameters": {change.name: change.to_dict() for change in self.parameter_changes},
            "simulation_error": {error.kind.value: error.to_dict() for error in self.simulation_errors},
            "motion_change": None if self.motion_change is None else self.motion_change.to_dict(),
            "strongest_recording": self.recordings[self.strongest_recording],
            "vectors": {name: vector.to_dict() for name in verdict.causes if (vector := vector_size(self.after, name))},
            "inseparable": [pair.to_dict() for pair in self.inseparable_pairs[:PAIRS]],
            "unseen": [row.name for row in self.unseen_candidates],
            "rivals": None if self.rivals is None else list(self.rivals),
            "p_value": self.alarm.p_value,
            "most_significant": self.alarm.loudest,
            "sensitivity": {
                choice: {"status": other.status.value, "causes": list(other.causes)}
                for choice, other in self.sensitivity.others.items()
            },
            "sensitivity_varies": list(self.sensitivity.varied),
            "settings": asdict(self.settings),
            "bounds": {
                label: {bound.unit: {"largest": bound.largest, "reason": bound.reason} for bound in bounds}
                for label, bounds in self.bounds.items()
            },
            "prior": {"one_more_cause": probabilities.prior.one_more, "generic": probabilities.prior.generic},
            "seconds": dict(self.seconds),
            "identification": None if self.identification is None else self.identification.to_dict(),
        }


def _ordered(result: Diagnosis) -> list[list[str]]:
    """Return the classes of equivalents, of each the most probable name first."""
    inclusion = result.probabilities.inclusion
    named = result.verdict.causes
    return [sorted(members, key=lambda name: (name not in named, -inclusion[name], name)) for members in result.classes]


def _wrench(wrench: DisturbingWrench) -> dict[str, Any]:
    fixed_in = None if wrench.fixed_in is None else wrench.fixed_in.value
    return {"signal_to_noise": wrench.signal_to_noise, "fixed_in": fixed_in}


def _sets(result: Diagnosis) -> list[dict[str, Any]]:
    best, *others = result.probabilities.sets
    fitted = [frozenset(result.after.labels), frozenset()]
    return [
        {
            "causes": list(cause_set.causes),
            "generic": [] if cause_set.generic is None else [cause_set.generic],
            "probability": cause_set.probability,
            "log_evidence": cause_set.log_evidence,
            "refitted": cause_set.generic is None and frozenset(cause_set.causes) in fitted,
            "sizes": [size.to_dict() for size in result.sizes_of(cause_set)],
        }
        for cause_set in (best, *(other for other in others if other.probability >= SHOWN))
    ]


def _gain(result: Diagnosis) -> dict[str, Any]:
    gain = result.gain
    score = {
        key: None if figures.held_out is None else float(figures.held_out.sum())
        for key, figures in (("before", gain.before), ("after", gain.after))
    }
    names = gain.before.bodies.names
    return {
        "chi2_per_sample": {"before": gain.before.chi2_per_sample, "after": gain.after.chi2_per_sample},
        "held_out_log_score": score if score["before"] is not None else None,
        "residual_rms_in_sigma": {"before": gain.before.rms, "after": gain.after.rms},
        "within_one_sigma": {"before": gain.before.inside, "after": gain.after.inside},
        "parameter_shift_in_sd": dict(zip(names, gain.shift.tolist(), strict=True)),
        "parameter_sd_ratio": dict(zip(names, (gain.after.bodies.sd / gain.before.bodies.sd).tolist(), strict=True)),
    }


def _torques(reading: TorqueReading | TorquesNotRead | None) -> dict[str, Any] | None:
    if reading is None:
        return None
    if isinstance(reading, TorquesNotRead):
        return {"status": "not evaluated", "reason": reading.reason}
    before, after = reading.chi2_per_sample
    return {
        "status": reading.verdict.status.value,
        "causes": [name for name in reading.verdict.causes if name in reading.probabilities.causes],
        "ambiguous_with": [list(names) for names in reading.verdict.ambiguous_with],
        "probability": {"nothing": reading.probabilities.nothing, "unknown": reading.probabilities.unknown},
        "candidates": [
            {
                "name": row.name,
                "probability": row.probability,
                "amplitude": {
                    amplitude.name: quantity(mean, sd, amplitude.unit)
                    for amplitude, mean, sd in zip(row.quantities, row.mean.tolist(), row.sd.tolist(), strict=True)
                },
            }
            for row in reading.causes
        ],
        "p_value": reading.p_value,
        "chi2_per_sample": {"before": before, "after": after},
    }


def _fitted(result: Diagnosis, name: str) -> dict[str, Any]:
    """Return what the extended model says of a named cause: its amplitudes, and of a jump the instants.

    Of a cause with amplitudes in each recording the first recording's have plain keys.
    """
    after = result.after
    amplitudes = amplitudes_of(after, name) + amplitudes_of_others(after, name) + instants_of(after, name)
    return {"amplitude": {key: quantity(mean, sd, unit) for (key, unit), mean, sd in amplitudes}}


def _candidate(row: Candidate, fitted: dict[str, Any] | None) -> dict[str, Any]:
    """Return a candidate beside the present model alone, with its amplitudes in the extended model if it is named."""
    entries = list(zip(row.quantities, row.mean.tolist(), row.sd.tolist(), row.upper_limit.tolist(), strict=True))
    return {
        "name": row.name,
        "probability": row.probability,
        "signal_to_noise": row.signal_to_noise,
        "p_value": row.p_value,
        "p_value_adjusted": row.p_value_adjusted,
        "log_bayes_factor": row.log_bayes_factor,
        "amplitude": {key: quantity(mean, sd, unit) for (key, unit), mean, sd, _ in entries},
        "upper_limit_95": {key: limit for (key, _), _, _, limit in entries},
        "power": row.power,
        "generic": row.generic,
        **(fitted or {}),
    }
