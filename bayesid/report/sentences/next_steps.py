"""Sentences on what to do after a diagnosis: with the model, and in the next manoeuvre."""

from __future__ import annotations

from collections.abc import Iterator

from bayesid._io.words import joined
from bayesid.diagnosis import Diagnosis, Status
from bayesid.diagnosis.candidates.initial_rate_signatures import INITIAL_RATE
from bayesid.report.sentences.next_experiment import advice

__all__ = ["SEPARATE_UNKNOWN", "action_sentence", "advice_sentences"]

SEPARATE_UNKNOWN = (
    "Repeat a manoeuvre unchanged but later: what depends on the clock then comes back at another instant of the "
    "motion, what depends on the motion at the same. Then repeat it with the base turned to another attitude, and "
    "record with the arm at rest."
)
"""Advice where no cause of the catalogue is at work."""


def action_sentence(result: Diagnosis) -> str:
    """Return what to do now, in one or two sentences."""
    match result.verdict.status:
        case Status.ADEQUATE:
            return "Use the model as it is."
        case Status.EXPLAINED:
            return _addition(result)
        case Status.AMBIGUOUS:
            first = next(advice_sentences(result), "")
            return f"Do not rely on one of the alternatives; fly the manoeuvre that separates them. {first}".rstrip()
        case Status.UNRESOLVED:
            return "Record longer, or repeat the manoeuvres: the signal grows with the root of their number."
    return f"Do not use the present model's values. {SEPARATE_UNKNOWN}"


def _addition(result: Diagnosis) -> str:
    """Return how to put the named causes into the model: effects, faults of the noise, and a base that turned."""
    causes = result.verdict.causes
    faults = [fault.label for fault in result.after.faults]
    steps = []
    if effects := [effect.entry for effect in result.after.fit.effects if effect.candidate in causes]:
        steps.append(f"add {joined(effects)} to the model's effects")
    if INITIAL_RATE in causes:
        steps.append("let the initial rates be unknown")
    if named := [name for name in causes if name in faults]:
        keys = [f"sensors.{name.partition(':')[2] or name.removesuffix('-noise')}.sigma" for name in named]
        steps.append(f"state {joined(keys)} as large as the noise with {joined(named)}")
    steps.append(f"use the values fitted with {'it' if len(causes) == 1 else 'them'}")
    text = f"{joined(steps)}."
    return text[0].upper() + text[1:]


def advice_sentences(result: Diagnosis) -> Iterator[str]:
    """Return the manoeuvre that would bring out each cause in which the alternatives differ."""
    for name in result.differing_causes:
        yield f"{name}: {advice(name)}"
    if pair := result.rivals:
        yield f"A manoeuvre that tells them apart is designed by: bayesid design STUDY.toml --separate {' '.join(pair)}"
