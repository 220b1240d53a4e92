"""Appendix of a diagnosis report: all candidates, bounds, sensitivity of the verdict, other recordings, glossary."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid._io.words import joined
from bayesid.diagnosis import Candidate, Diagnosis, TorqueReading
from bayesid.diagnosis.candidates.cause_kind import CauseAmplitude
from bayesid.report.diagnosis.cause_words import NOTHING, SOMETHING, amplitude_text, limit_text, verdict_text
from bayesid.report.diagnosis.causes_page import SETS
from bayesid.report.diagnosis.diagnosis_sentences import torque_size
from bayesid.report.diagnosis.evidence_page import add_other_residuals
from bayesid.report.document import Document, Rows
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_p_value,
    format_probability,
    format_signed,
    format_text,
    format_unit,
)
from bayesid.simulation.effects.effect_parameters import PhysicalBound

__all__ = [
    "GLOSSARY",
    "add_appendix",
    "bound_rows",
    "candidate_rows",
    "choice_text",
    "robustness_sentence",
    "sensitivity_rows",
    "torque_rows",
]

GLOSSARY = (
    ("σ", "Standard deviation of a sensor's noise per sample, including encoder noise propagated by the dynamics."),
    ("chi-square per sample", "Mean square of the residuals in units of σ; one if the model is correct."),
    ("log evidence", "Natural logarithm of the probability of the data under a set of causes over that under none."),
    ("log BF", "Natural logarithm of the Bayes factor of a candidate alone over none."),
    (
        "probability",
        "Of a set of causes: its evidence times its prior, divided by the sum of that product over all sets. Of a "
        "cause: the sum over all sets that contain it.",
    ),
    ("class", "Causes whose effects these data cannot distinguish; one probability applies to all of them."),
    (
        "something unknown",
        "Any of the candidates that represent causes outside the catalogue: a smooth torque, force or sensor error, an "
        "error or torque that depends on the motion, a pulse of torque, a burst of a sensor, or a residual that a fit "
        "with named causes does not explain.",
    ),
    (
        "p, adjusted",
        "Probability that noise alone makes the most significant of all tests at least as significant as this one.",
    ),
    (
        "SNR",
        "Signal-to-noise ratio. Of a candidate: √max(Δχ² − n, 0), where Δχ² is its decrease of chi-square with all "
        "unknowns fitted again and n its number of free amplitudes. Of a noise fault: standard normal quantile of its "
        "unadjusted p.",
    ),
    ("power", "Probability that a candidate with a size drawn from its prior would have raised the alarm."),
    ("95 % limit", "Value below which the magnitude of a quantity lies with a probability of 95 %."),
    (
        "cosine",
        "Correlation between the signals of two causes, after the parts that the model's unknowns can explain are "
        "removed.",
    ),
    ("left-out log score", "Logarithm of the density of a recording under the model fitted to the other recordings."),
    (
        "given, prior sd",
        "Value in the study or robot file, and half the width of the interval with the central 68 % of the prior.",
    ),
    ("without, with", "Fitted with the present model, and with the named causes added to it."),
)
"""Terms of the report and their meanings."""

CHOICES = {
    "causes half as probable": "half the prior probability of one more cause",
    "causes twice as probable": "twice the prior probability of one more cause",
    "unknown half as probable": "half the prior probability of a cause outside the catalogue",
    "unknown twice as probable": "twice the prior probability of a cause outside the catalogue",
    "bounds a decade higher": "largest plausible sizes of all causes ten times as large",
    "floors a decade lower": "smallest sizes of all causes one tenth as large",
}
"""What each choice of the sensitivity changes, by its name in diagnosis.json."""

SEEN = 2.0  # distance from zero, in standard deviations, above which an amplitude is given and below which a limit


def add_appendix(document: Document, result: Diagnosis) -> None:
    """Add sensitivity, candidates, bounds, the residuals of the other recordings, and the glossary."""
    document.section("Appendix: robustness of the verdict")
    document.paragraph(robustness_sentence(result))
    if rows := sensitivity_rows(result):
        document.table(["choice", "verdict"], rows, "Choices that would change the verdict.")
    _add_candidates(document, result)
    _add_torques(document, result)
    document.table(
        ["cause", "largest size:", "why a larger size is implausible"],
        bound_rows({label: result.bounds[label] for label in _weighed(result) if label in result.bounds}),
        f"Physical bounds on the scales of the causes in the {SETS} most probable sets; diagnosis.json contains all.",
    )
    add_other_residuals(document, result)
    document.table(["term", "meaning"], [list(entry) for entry in GLOSSARY], "Glossary.")


def _add_candidates(document: Document, result: Diagnosis) -> None:
    document.table(
        [
            "candidate",
            "probability:",
            "SNR:",
            "p, adjusted:",
            "log BF:",
            "size, or 95 % limit",
            "power:",
        ],
        candidate_rows(result.candidates, result.alarm.level),
        f"All {len(result.candidates)} candidates, each added alone to the present model, in the linear approximation. "
        "The probability is that of being present, alone or with other causes. Candidates that stand out have a size, "
        "the others a 95 % limit. Both apply only if the candidate is the only cause, not if it acts in addition to a "
        "named cause. Empty cells were not evaluated.",
    )


def _add_torques(document: Document, result: Diagnosis) -> None:
    if isinstance(result.torques, TorqueReading):
        document.table(
            ["candidate", "probability:", "size ± sd"],
            torque_rows(result.torques),
            "Candidates that could act on the joint torques alone, evaluated after the verdict on the motion: the "
            "probability of being present, and the size in that case. Something unknown is a torque with any smooth "
            "time history at one joint.",
        )


def candidate_rows(rows: Sequence[Candidate], alarm: float) -> Rows:
    """Return name, probability, signal-to-noise ratio, p-value, log Bayes factor, size or limit, and power.

    Parameters
    ----------
    rows : sequence of Candidate
    alarm : float
        Adjusted p-value below which a candidate is significant.
    """
    return [
        [
            row.name,
            format_probability(row.probability),
            format_fixed(row.signal_to_noise, 1),
            format_p_value(row.p_value_adjusted),
            "" if row.log_bayes_factor is None else format_signed(row.log_bayes_factor),
            _size_text(row, alarm),
            "" if row.power is None else format_fixed(row.power, 2),
        ]
        for row in rows
    ]


def _size_text(row: Candidate, alarm: float) -> str:
    amplitude = list(map(CauseAmplitude, row.quantities, np.asarray(row.mean).tolist(), np.asarray(row.sd).tolist()))
    seen = row.p_value_adjusted < alarm and any(item.distance > SEEN for item in amplitude)
    return amplitude_text(amplitude) if seen else limit_text(row)


def torque_rows(found: TorqueReading) -> Rows:
    """Return name, probability and size of each candidate that acts on the joint torques, nothing and unknown last."""
    rows = [[row.name, format_probability(row.probability), torque_size(found, row.name)] for row in found.causes]
    return [
        *rows,
        [SOMETHING, format_probability(found.probabilities.unknown), ""],
        [NOTHING, format_probability(found.probabilities.nothing), ""],
    ]


def robustness_sentence(result: Diagnosis) -> str:
    """Return under which choices of the prior's numbers and of the range of scales the verdict stays the same."""
    sensitivity = result.sensitivity
    same = joined(choice_text(name) for name in sensitivity.others if name not in sensitivity.changes)
    count = len(sensitivity.others)
    if not sensitivity.changes:
        return f"The verdict is the same under each of {count} other choices: {same}."
    text = f"The verdict would change under {len(sensitivity.changes)} of {count} other choices."
    return f"{text} It remains the same with {same}." if same else text


def choice_text(name: str) -> str:
    """Return what a choice of the sensitivity changes."""
    return CHOICES.get(name, name)


def sensitivity_rows(result: Diagnosis) -> Rows:
    """Return each choice that changes the verdict, and the verdict under it."""
    others = result.sensitivity.others
    return [[choice_text(name), verdict_text(others[name])] for name in result.sensitivity.changes]


def _weighed(result: Diagnosis) -> set[str]:
    """Return the causes of the most probable sets."""
    return {cause for weighed in result.probabilities.sets[:SETS] for cause in weighed.causes}


def bound_rows(bounds: dict[str, tuple[PhysicalBound, ...]]) -> Rows:
    """Return cause, largest size with its unit, and reason of every bound."""
    return [
        [
            label if place == 0 else "",
            f"{format_number(item.largest)} {format_unit(item.unit)}".rstrip(),
            format_text(item.reason),
        ]
        for label, own in sorted(bounds.items())
        for place, item in enumerate(own)
    ]
