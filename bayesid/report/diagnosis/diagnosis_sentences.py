"""Sentences of a diagnosis: verdict, causes, alternatives, gain, what is left, joint torques, and what to do next."""

from __future__ import annotations

from collections.abc import Iterator

from bayesid._io.words import abridged, joined
from bayesid.diagnosis import (
    Diagnosis,
    DisturbingWrench,
    Frame,
    Hypothesis,
    Rest,
    Status,
    TorqueReading,
    TorquesNotRead,
)
from bayesid.diagnosis.candidates.cause_kind import cause_kinds
from bayesid.diagnosis.candidates.motion_errors import JOINT, SENSOR
from bayesid.diagnosis.evidence.verdict import UNKNOWN
from bayesid.diagnosis.noise import noise_faults
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of, instants_of
from bayesid.report.diagnosis.cause_words import NOTHING, amplitude_text, probability_text, set_text
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_p_value,
    format_percent,
    format_probability,
    format_quantity,
    format_signed,
    format_unit,
    relation,
)
from bayesid.simulation.effects import known_effects

__all__ = [
    "action_sentence",
    "advice",
    "advice_sentences",
    "alarm_sentence",
    "alternative_sentences",
    "cause_sentences",
    "cause_summary",
    "diagnosis_sentences",
    "gain_sentence",
    "remainder_sentence",
    "torque_sentence",
    "torque_size",
    "verdict_sentence",
    "wrench_sentence",
]

AT_MOST = 6  # largest number of quantities of one cause in a sentence
SHOWN_SETS = 3  # sets named in the sentence of a verdict that names none

FIXED = {
    Frame.BASE: "The direction of the torque is fixed in base axes: the source is on board.",
    Frame.ORBIT: "The direction of the torque is fixed in axes that turn with the orbit: the source follows the "
    "direction of the Earth or of flight.",
    Frame.INERTIAL: "The direction of the torque is fixed in inertial space: the source is outside the orbit, such as "
    "the Sun.",
}
"""Where the source of a disturbance is, by the axes in which it keeps its direction."""

SEPARATE_UNKNOWN = (
    "Repeat a manoeuvre unchanged at a later time: effects that depend on the clock then recur at a different instant "
    "of the motion, effects that depend on the motion at the same instant. Then repeat it with the base in a different "
    "attitude, and record with the arm at rest."
)
"""Advice where no cause of the catalogue is present."""

ANYTHING = "Repeat the manoeuvre with different amplitudes and speeds, and with the base in a different attitude."
"""Advice on a cause of which nothing is known."""


def diagnosis_sentences(result: Diagnosis) -> Iterator[str]:
    """Return the verdict, its causes, its alternatives and its gain, for the terminal."""
    yield verdict_sentence(result)
    yield from cause_sentences(result)
    yield from alternative_sentences(result)
    yield gain_sentence(result)
    if result.undetermined:
        yield undetermined_sentence(result)
    if result.verdict.status in (Status.UNKNOWN, Status.UNRESOLVED, Status.PARTLY_EXPLAINED):
        yield wrench_sentence(result.unexplained)
    if result.torques is not None:
        yield torque_sentence(result.torques)


def undetermined_sentence(result: Diagnosis) -> str:
    """Return which inertial parameters the recordings say nothing of, whatever the verdict."""
    bodies = [prior.name for prior in result.before.fit.posterior.model.bodies]
    every = len(result.undetermined) == len(result.parameter_changes)
    what = f"any parameter of {joined(bodies)}" if every else abridged(result.undetermined)
    return (
        f"These recordings do not determine {what}: the posterior equals the prior. Record large and fast joint "
        "motions."
    )


def verdict_sentence(result: Diagnosis) -> str:
    """Return the verdict and what it means."""
    causes = joined(result.verdict.causes)
    match result.verdict.status:
        case Status.ADEQUATE:
            return "Adequate: the declared noise alone explains the residuals of the simulation."
        case Status.EXPLAINED:
            beside = f"with {_them(result)} in the model, no other explanation is needed."
            return f"Explained by {causes}: {beside} {_together(result)} {remainder_sentence(result)}"
        case Status.PARTLY_EXPLAINED:
            return f"Partly explained by {causes}. {_together(result)} {remainder_sentence(result)}"
        case Status.AMBIGUOUS:
            names = "; or ".join(map(set_text, result.alternatives))
            return (
                f"Ambiguous: possible explanations of the residuals are {names}. Together these alternatives have a "
                f"probability of at least {format_percent(result.settings.covered, 2)}, and the recordings do not "
                "discriminate between them."
            )
        case Status.UNRESOLVED:
            sets = result.probabilities.sets[:SHOWN_SETS]
            most = "; ".join(f"{set_text(item.names)} ({probability_text(item.probability)})" for item in sets)
            if not sets[0].names:
                return (
                    "Unresolved: a test of the residuals raised the alarm, but that no cause is present is the most "
                    f"probable explanation. The most probable sets are: {most}."
                )
            return (
                "Unresolved: the residuals contain more than noise, but the probability is spread over too many "
                f"explanations for a cause to be named. The most probable sets are: {most}."
            )
    generic, _ = max(
        ((name, result.probabilities.inclusion[name]) for name in result.probabilities.generics),
        key=lambda item: item[1],
        default=(NOTHING, 0.0),
    )
    return (
        "Unknown: the anomaly most probably has a cause that is not in the catalogue "
        f"({probability_text(result.probabilities.unknown)}). Among the candidates outside the catalogue, the most "
        f"probable is: {_named_in_full(result, generic)}."
    )


def _named_in_full(result: Diagnosis, generic: str) -> str:
    """Return the name of a candidate outside the catalogue, of one that follows the motion with joint or readings."""
    point = result.search.searches[0].point
    if not generic.startswith((JOINT, SENSOR)) or generic not in point.evidence.causes:
        return generic
    return point.most_probable_form(generic, (generic,)).name


def remainder_sentence(result: Diagnosis) -> str:
    """Return whether something that is not named acts beside the named causes, with its probability."""
    probability = probability_text(result.remainder.probability)
    match result.remainder.verdict:
        case Rest.NONE:
            return f"An unnamed cause in addition to {_them(result)} is improbable ({probability})."
        case Rest.UNDECIDED:
            return f"Whether an unnamed cause acts in addition to {_them(result)} is undecided ({probability})."
    return (
        f"An unnamed cause acts in addition to {_them(result)} ({probability}). A single unnamed cause that resembles "
        f"{_them(result)} would lead to the same verdict."
    )


def _them(result: Diagnosis) -> str:
    return "it" if len(result.verdict.causes) == 1 else "them"


def _together(result: Diagnosis) -> str:
    """Return the probability that the named causes are present."""
    which = "Its probability" if len(result.verdict.causes) == 1 else "The probability that all of them are present"
    return f"{which} is {_is(result.probability_of(result.verdict.causes))}."


def _is(value: float) -> str:
    """Return a probability after "is": the number, or the bound in words."""
    text = format_probability(value)
    return text.replace("> ", "more than ").replace("< ", "less than ")


def alarm_sentence(result: Diagnosis) -> str:
    """Return the loudest test of the present model, with its family-wise p-value and the level of the alarm."""
    alarm = result.alarm
    found = "no alarm is raised" if alarm.silent else "an alarm is raised"
    return (
        f"Of {alarm.tests} tests of the residuals of the present model, the most significant is that for "
        f"{alarm.loudest} (p {relation(format_p_value(alarm.p_value))}, adjusted for all tests). The alarm "
        f"threshold is {alarm.level:g}: {found}. A low p indicates that something is missing, not what it is."
    )


def cause_sentences(result: Diagnosis) -> Iterator[str]:
    """Return what each named cause is, how probable and how large it is, and by which other names it goes."""
    for label in result.verdict.causes:
        parts = [
            f"{label}. {cause_summary(result.after, label)}".rstrip(),
            f"Its probability is {_is(result.cause_probability(label))}.",
        ]
        if amplitude := amplitudes_of(result.after, label):
            rest = "; the table of the named causes lists all of them" if len(amplitude) > AT_MOST else ""
            parts.append(f"Its size (± 1 sd): {amplitude_text(amplitude, AT_MOST)}{rest}.")
        if instants := instants_of(result.after, label):
            parts.append(f"When: {amplitude_text(instants, len(instants))}.")
        if others := result.verdict.equivalent_to.get(label):
            parts.append(f"Equivalent causes: {joined(others)}.")
        yield " ".join(parts)


def alternative_sentences(result: Diagnosis) -> Iterator[str]:
    """Return each alternative to the named causes, with its probability and the other names of its causes."""
    for names in result.verdict.ambiguous_with:
        text = f"Alternative: {set_text(names)} ({probability_text(result.probability_of(names))})."
        for name in names:
            if name != UNKNOWN and (others := result.verdict.equivalent_to.get(name)):
                text += f" Equivalent to {name}: {joined(others)}."
        yield text


def cause_summary(hypothesis: Hypothesis, label: str) -> str:
    """Return what a cause of a hypothesis is, in one sentence."""
    for effect in hypothesis.fit.effects:
        if effect.candidate == label:
            return effect.summary
    fault = noise_faults().get(label)
    if fault is not None:
        return fault.summary
    return next((kind.summary for kind in cause_kinds() if kind.name == label), "")


def gain_sentence(result: Diagnosis) -> str:
    """Return what the named causes gain, or how the present model fits where none is named."""
    before, after = result.gain.before, result.gain.after
    if not result.verdict.causes:
        return (
            f"Chi-square per sample is {before.chi2_per_sample:.3f}, and {100.0 * before.inside:.1f} % of the "
            "residuals lie within one σ; noise alone gives 1 and 68.3 %."
        )
    parts = [f"chi-square per sample goes from {before.chi2_per_sample:.3f} to {after.chi2_per_sample:.3f}"]
    if before.held_out is not None and after.held_out is not None:
        change = float(after.held_out.sum() - before.held_out.sum())
        verb = "rises" if change >= 0.0 else "falls"
        parts.append(f"the log score of recordings predicted from the others {verb} by {format_number(abs(change), 4)}")
    if shifts := dict(zip(before.bodies.names, result.gain.shift.tolist(), strict=True)):
        name = max(shifts, key=lambda key: abs(shifts[key]))
        parts.append(
            f"the inertial parameter that changes most is {name}, by {format_signed(shifts[name])} standard deviations "
            f"of the fit without the named {'cause' if len(result.verdict.causes) == 1 else 'causes'}"
        )
    text = f"{', '.join(parts[:-1])}, and {parts[-1]}" if len(parts) > 1 else parts[0]
    return f"Effect on the fit: {text}."


def wrench_sentence(wrench: DisturbingWrench) -> str:
    """Return how strong a reconstructed disturbance is, and in which axes it keeps its direction."""
    if wrench.signal_to_noise == 0.0:
        return "No torque or force on the base would reduce the residual by more than it would reduce pure noise."
    where = (
        FIXED[wrench.fixed_in]
        if wrench.fixed_in
        else "The data do not show whether the torque's direction is fixed in base, orbit or inertial axes."
    )
    strength = format_fixed(wrench.signal_to_noise, 1)
    return (
        "The torque and force on the base that best explain the residual have a signal-to-noise ratio of "
        f"{strength}. {where}"
    )


def torque_sentence(found: TorqueReading | TorquesNotRead) -> str:
    """Return what the joint torques say beside the verdict on the motion, or why they were not read."""
    if isinstance(found, TorquesNotRead):
        return f"The joint torques were not evaluated. {found.reason}"
    before, after = (format_fixed(value, 2) for value in found.chi2_per_sample)
    match found.verdict.status:
        case Status.ADEQUATE:
            return (
                "The declared noise alone explains the residuals of the joint torques "
                f"(p {relation(format_p_value(found.p_value))}, chi-square per sample {before})."
            )
        case Status.EXPLAINED | Status.PARTLY_EXPLAINED:
            rows = [row for row in found.causes if row.name in found.verdict.causes]
            sizes = joined([f"{row.name} ({torque_size(found, row.name)}, ± sd)" for row in rows])
            partly = "partly " if found.verdict.status is Status.PARTLY_EXPLAINED else ""
            return (
                f"The joint torques are {partly}explained by {sizes}; chi-square per sample goes from {before} to "
                f"{after}. The motion is unaffected, because that of the joints is measured."
            )
        case Status.AMBIGUOUS:
            others = [found.verdict.causes, *found.verdict.ambiguous_with]
            return (
                "The joint torques are ambiguous. Possible explanations of their residuals are "
                f"{'; or '.join(map(set_text, others))}."
            )
        case Status.UNRESOLVED:
            return (
                "The residuals of the joint torques contain more than noise, and the recordings do not determine the "
                "cause."
            )
    return (
        "The residuals of the joint torques contain something that is neither friction nor a constant sensor error "
        f"({probability_text(found.probabilities.unknown)}); chi-square per sample is {before}."
    )


def torque_size(found: TorqueReading, name: str) -> str:
    """Return the amplitudes of one candidate, ± sd."""
    row = next(row for row in found.causes if row.name == name)
    return ", ".join(
        f"{item.name} {format_quantity(mean, sd)} {format_unit(item.unit)}"
        for item, mean, sd in zip(row.quantities, row.mean.tolist(), row.sd.tolist(), strict=True)
    )


def action_sentence(result: Diagnosis) -> str:
    """Return what to do now, in one or two sentences."""
    match result.verdict.status:
        case Status.ADEQUATE:
            return "Use the model as it is."
        case Status.EXPLAINED:
            return _addition(result)
        case Status.PARTLY_EXPLAINED:
            if result.remainder.verdict is Rest.PRESENT:
                return (
                    f"{_addition(result)} An unexplained part remains, so these values may be in error. "
                    f"{SEPARATE_UNKNOWN}"
                )
            return f"{_addition(result)} Record more data to decide whether an unexplained part remains."
        case Status.AMBIGUOUS:
            first = next(advice_sentences(result), "")
            return f"Do not rely on any of the alternatives; fly the manoeuvre that separates them. {first}".rstrip()
        case Status.UNRESOLVED:
            return (
                "Make longer recordings or repeat the manoeuvres: the signal grows with the square root of their "
                "number."
            )
    return f"Do not use the values of the present model. {SEPARATE_UNKNOWN}"


def _addition(result: Diagnosis) -> str:
    """Return how to put the named causes into the model: effects, faults of the noise, and a base that turned."""
    causes = result.verdict.causes
    faults = [fault for fault in result.after.faults if fault.label in causes]
    steps = []
    if effects := [effect.entry for effect in result.after.fit.effects if effect.candidate in causes]:
        steps.append(f"add {joined(effects)} to the model's effects")
    steps += [kind.statement for kind in cause_kinds() if kind.statement and kind.name in causes]
    if faults:
        steps.append(f"state under [model.noise] {joined([fault.statement for fault in faults])}")
    steps.append(f"use the values fitted with {'it' if len(causes) == 1 else 'them'}")
    text = f"{joined(steps)}."
    return text[0].upper() + text[1:]


def advice_sentences(result: Diagnosis) -> Iterator[str]:
    """Return the manoeuvre that would bring out each cause in which the alternatives differ."""
    for name in result.differing_causes:
        yield f"{name}: {advice(name)}"
    if pair := result.rivals:
        yield f"To design a manoeuvre that separates them: bayesid design STUDY.toml --separate {' '.join(pair)}"


def advice(name: str) -> str:
    """Return the manoeuvre that would bring a cause out, as a sentence; of an effect its class states it."""
    said = next((kind.advice for kind in cause_kinds() if kind.advice and kind.name == name), None)
    if said is not None:
        return said
    if fault := noise_faults().get(name):
        return fault.advice
    effect = known_effects().get(name.partition(":")[0])
    return (effect.separated_by if effect else "") or ANYTHING
