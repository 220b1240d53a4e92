"""Appendix of a diagnosis report: all candidates, bounds, sensitivity of the verdict, other recordings, glossary."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid.diagnosis import Candidate, Diagnosis, TorqueReading
from bayesid.diagnosis.candidates.cause_kind import CauseAmplitude
from bayesid.inference.predicted_readings import sensor_fits
from bayesid.report import figures
from bayesid.report.diagnosis.cause_words import NOTHING, SOMETHING, amplitude_text, limit_text, verdict_text
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
    "add_measured",
    "bound_rows",
    "candidate_rows",
    "sensitivity_rows",
    "torque_rows",
]

GLOSSARY = (
    ("σ", "Standard deviation of a sensor's noise per sample, including encoder noise propagated by the dynamics."),
    ("chi-square per sample", "Mean square of the residuals in units of σ; one if the model is correct."),
    ("log evidence", "Natural logarithm of the probability of the data under a set of causes over that under none."),
    ("probability", "Of a set: evidence times prior over the sum of all sets. Of a cause: sum over the sets with it."),
    ("class", "Causes whose effects on the model these data cannot distinguish; they share a probability."),
    ("something unknown", "Any candidate outside the catalogue: a smooth torque, force or sensor error, or a pulse."),
    (
        "p, family-wise",
        "Probability that noise alone makes the most significant of all tests at least this significant.",
    ),
    ("signal to noise", "Square root of a candidate's decrease of chi-square minus its degrees of freedom."),
    ("power", "Probability that a candidate with a size drawn from its prior would have raised the alarm."),
    ("95 % limit", "Value below which the magnitude of a quantity lies with a probability of 95 %."),
    ("cosine", "Correlation of the signals of two causes, without the part that the model's unknowns can explain."),
    ("left-out log score", "Logarithm of the density of a recording under the model fitted to the other recordings."),
    ("without, with", "Fitted with the present model, and with the named causes added to it."),
)
"""Terms of the report and their meanings."""

SEEN = 2.0  # distance from zero, in standard deviations, above which an amplitude is given and below which a limit


def add_appendix(document: Document, result: Diagnosis) -> None:
    """Add sensitivity, candidates, bounds, the residuals of the other recordings, and the glossary."""
    document.section("Appendix: robustness of the verdict")
    changed = result.sensitivity.changes
    document.paragraph(
        f"The verdict would change under {len(changed)} of {len(result.sensitivity.others)} other choices"
        + (f": {', '.join(changed)}." if changed else ".")
    )
    document.table(
        ["choice", "verdict", "changed"],
        sensitivity_rows(result),
        "Sensitivity of the verdict to the two numbers of the prior and to the range of the causes' scales.",
    )
    _add_candidates(document, result)
    _add_torques(document, result)
    document.table(
        ["cause", "largest size:", "why a larger size is implausible"],
        bound_rows(dict(result.bounds)),
        "Physical bounds on the scales of the causes.",
    )
    add_other_residuals(document, result)
    document.table(["term", "meaning"], [list(entry) for entry in GLOSSARY], "Glossary.")


def _add_candidates(document: Document, result: Diagnosis) -> None:
    document.table(
        [
            "candidate",
            "probability:",
            "signal to noise:",
            "p, adjusted:",
            "log Bayes factor:",
            "size, or 95 % limit",
            "power:",
        ],
        candidate_rows(result.candidates, result.alarm.level),
        f"All {len(result.candidates)} candidates, each added alone to the present model, from the linear response. "
        "The probability is that of being at work, whatever accompanies it. The p-value is adjusted for all tests. "
        "Detected candidates have a size; for the others, the magnitudes lie below the given limits with 95 % "
        "probability. Empty cells were not evaluated.",
    )


def _add_torques(document: Document, result: Diagnosis) -> None:
    if isinstance(result.torques, TorqueReading):
        document.table(
            ["candidate", "probability:", "size ± sd"],
            torque_rows(result.torques),
            "Candidates that could act on the joint torques alone, evaluated after the verdict on the motion: the "
            "probability of being at work, and the size in that case. Something unknown is a torque with any smooth "
            "time history at one joint.",
        )


def add_measured(document: Document, result: Diagnosis) -> None:
    """Add measured and simulated readings of every recording, with the named causes in the model."""
    document.section("Measured and simulated")
    posterior = result.posterior
    for manoeuvre, sensors in zip(posterior.manoeuvres, sensor_fits(posterior, result.start), strict=True):
        document.figure(
            figures.measured_against_simulated(sensors),
            f"Measured and simulated readings of {manoeuvre.recording.name}, sensor axes; below, the residual in σ.",
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


def sensitivity_rows(result: Diagnosis) -> Rows:
    """Return choice, verdict under it, and whether it is another, the verdict itself first."""
    sensitivity = result.sensitivity
    return [
        ["as chosen", verdict_text(sensitivity.verdict), ""],
        *(
            [name, verdict_text(other), "yes" if name in sensitivity.changes else "no"]
            for name, other in sensitivity.others.items()
        ),
    ]


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
