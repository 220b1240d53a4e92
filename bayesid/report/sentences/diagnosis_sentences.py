"""Sentences of a diagnosis: the verdict, its causes, what they gain, and how the verdict was reached."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from bayesid._io.words import joined
from bayesid.diagnosis import Diagnosis, Frame, Hypothesis, Status, Unexplained
from bayesid.diagnosis.amplitude_scale import SCALES
from bayesid.diagnosis.cause_amplitudes import amplitudes_of
from bayesid.diagnosis.noise_faults import SUMMARIES
from bayesid.diagnosis.rival_causes import differing
from bayesid.diagnosis.test_suite import FALSE_ALARM
from bayesid.diagnosis.verdict import RIVALRY
from bayesid.report.numbers import format_fixed, format_number, format_p_value, format_signed
from bayesid.report.sentences.amplitude_words import amplitude_text
from bayesid.report.sentences.next_experiment import advice

__all__ = [
    "advice_sentences",
    "alarm_sentence",
    "cause_sentences",
    "diagnosis_sentences",
    "gain_sentence",
    "method_sentences",
    "verdict_sentence",
    "wrench_sentence",
]

AT_MOST = 6
"""Largest number of quantities of one cause in a sentence."""

RELEASED = "The base was already turning when the recordings began, although the study takes it to be at rest."
"""Summary of the cause that the initial rate is not zero."""

FIXED = {
    Frame.BASE: "It keeps its direction in base axes: its source is on board.",
    Frame.ORBIT: "It keeps its direction in orbit axes, which turn with the orbit: its source follows the Earth or the "
    "flight.",
    Frame.INERTIAL: "It keeps its direction in inertial space: its source lies outside the orbit, as the Sun does.",
}
"""Where the source of a disturbance is, by the axes in which it keeps its direction."""


def diagnosis_sentences(result: Diagnosis) -> Iterator[str]:
    """Return the verdict, its causes, its rivals and its gain, for the terminal."""
    yield verdict_sentence(result)
    yield from cause_sentences(result)
    for rival in result.verdict.rivals:
        yield f"Rival: {' + '.join(rival.labels)}."
    yield gain_sentence(result)
    if result.verdict.status in (Status.UNKNOWN, Status.UNRESOLVED):
        yield wrench_sentence(result.unexplained)


def verdict_sentence(result: Diagnosis) -> str:
    """Return the verdict and what it means."""
    causes = joined(result.verdict.causes)
    one = len(result.verdict.causes) == 1
    return {
        Status.ADEQUATE: "Adequate: the simulation leaves nothing but the declared noise.",
        Status.EXPLAINED: f"Explained by {causes}: with {'it' if one else 'them'} the simulation leaves nothing but "
        "noise, and nothing else in the catalogue does so as well.",
        Status.AMBIGUOUS: f"Ambiguous: {causes} {'explains' if one else 'explain'} what the simulation leaves, and so "
        f"do other causes, about as well. These recordings cannot tell them apart.",
        Status.UNRESOLVED: "Unresolved: the simulation leaves more than noise, but too faintly to name the cause.",
        Status.UNKNOWN: "Unknown: the simulation leaves more than noise, and no set of up to three causes of the "
        "catalogue explains it.",
    }[result.verdict.status]


def alarm_sentence(result: Diagnosis) -> str:
    """Return the most significant test before, and after where causes are named."""
    before, after = result.before.outcome, result.after.outcome
    first = (
        f"Of {len(before.log_p)} tests of what the present simulation leaves, the most significant is "
        f"that for {before.worst} (p {_relation(before.p_value)}, all tests counted)"
    )
    if not result.verdict.causes:
        return f"{first}; an alarm is raised below {FALSE_ALARM:g}."
    return (
        f"{first}. With the named cause{'s' if len(result.verdict.causes) > 1 else ''} it is that for {after.worst} "
        f"(p {_relation(after.p_value)}); an alarm is raised below {FALSE_ALARM:g}."
    )


def _relation(p_value: float) -> str:
    text = format_p_value(p_value)
    return text if text.startswith("<") else f"= {text}"


def cause_sentences(result: Diagnosis) -> Iterator[str]:
    """Return what each named cause is, how large it is, and by which other names it goes."""
    best = result.verdict.best
    for label in result.verdict.causes:
        parts = [f"{label}. {_summary(best, label)}"]
        amplitude = amplitudes_of(best, label)
        if amplitude:
            rest = "; all are in the table of the named causes" if len(amplitude) > AT_MOST else ""
            parts.append(f"Its size: {amplitude_text(amplitude, AT_MOST)}{rest}.")
        if others := result.verdict.equivalents.get(label):
            parts.append(f"Other names for the same change: {joined(others)}.")
        yield " ".join(parts)


def _summary(hypothesis: Hypothesis, label: str) -> str:
    for effect in hypothesis.fit.effects:
        if effect.label == label:
            return effect.summary
    if label == "initial-rate":
        return RELEASED
    return next((text for key, text in reversed(SUMMARIES.items()) if key in label), "")


def gain_sentence(result: Diagnosis) -> str:
    """Return what the named causes gain, or how the present model fits where none is named."""
    before, after = result.gain.before, result.gain.after
    if not result.verdict.causes:
        return (
            f"Chi-square per sample is {before.chi2_per_sample:.3f}, and {100.0 * before.inside:.1f} % of the "
            "residuals lie within one σ, where noise alone gives 1 and 68.3 %."
        )
    parts = [f"chi-square per sample goes from {before.chi2_per_sample:.3f} to {after.chi2_per_sample:.3f}"]
    if before.held_out is not None and after.held_out is not None:
        change = float(after.held_out.sum() - before.held_out.sum())
        verb = "rises" if change >= 0.0 else "falls"
        parts.append(f"the log score of recordings predicted from the others {verb} by {format_number(abs(change), 4)}")
    if shifts := dict(zip(before.bodies.names, result.gain.shift.tolist(), strict=True)):
        name = max(shifts, key=lambda key: abs(shifts[key]))
        parts.append(
            f"the inertial parameter that moves most is {name}, by {format_signed(shifts[name])} of the standard "
            "deviations that would have been believed without it"
        )
    text = f"{', '.join(parts[:-1])}, and {parts[-1]}" if len(parts) > 1 else parts[0]
    return f"What it gains: {text}."


def wrench_sentence(wrench: Unexplained) -> str:
    """Return how strong a reconstructed disturbance is, and in which axes it keeps its direction."""
    if wrench.signal_to_noise == 0.0:
        return "A free torque and force on the base would explain no more than noise does."
    where = FIXED[wrench.fixed_in] if wrench.fixed_in else "In which axes it keeps its direction is not decided."
    strength = format_fixed(wrench.signal_to_noise, 1)
    return f"As a free torque and force on the base it has a signal-to-noise ratio of {strength}. {where}"


def advice_sentences(result: Diagnosis, rivals: Sequence[Hypothesis]) -> Iterator[str]:
    """Return the manoeuvre that would bring out each cause in which the best hypothesis and its rivals differ."""
    if not rivals:
        return
    leader = result.verdict.best if result.verdict.best.labels else rivals[0]
    names = [name for rival in rivals for side in differing(leader, rival) for name in side]
    for name in dict.fromkeys(names):
        yield f"{name}: {advice(name)}"


def method_sentences(result: Diagnosis) -> Iterator[str]:
    """Return how the verdict was reached."""
    search = result.search
    yield (
        f"An alarm is raised where the smallest p-value of the whole family of {len(search.base.outcome.log_p)} tests "
        f"is one that noise alone gives in less than {100.0 * FALSE_ALARM:g} % of cases. The family holds every "
        "candidate, smooth disturbing torques and forces, vibrations, the residual of each channel, and the sensors' "
        "noise. The distribution of the smallest p-value under noise alone was simulated, with all dependence between "
        "the tests."
    )
    yield (
        f"{len(search.candidates)} causes of the catalogue are possible here: {', '.join(search.candidates)}. Others "
        "were not considered."
    )
    yield (
        "Causes are tried one at a time, then the best in pairs, then in threes. The smallest set that leaves nothing "
        "but noise is named; sets of one size are ranked by their evidence, from the Laplace approximation. Rivals "
        f"are within {RIVALRY:g} of the best in the logarithm of the Bayes factor. The scale of a cause's amplitudes "
        f"of one unit is unknown: it is that of the priors shown, or one of {len(SCALES) - 1} smaller scales down to "
        f"{SCALES[-1]:g} of it, all equally probable."
    )
    yield "Faults of the noise are named only where no physical cause explains the residual."
    yield f"Seed of all random numbers: {search.seed}."
