"""The report of a diagnosis: the verdict, its evidence, its gain, and the experiments to do next."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bayesid.diagnosis import Candidate, Diagnosis, Hypothesis, Status
from bayesid.diagnosis.rival_causes import improbable_rivals
from bayesid.inference import Identification
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.report import diagnosis_evidence as evidence
from bayesid.report.document import Document
from bayesid.report.identification_report import add_identification, add_joints
from bayesid.report.sentences import diagnosis_sentences as sentences
from bayesid.report.sentences.model_assumptions import model_sentences
from bayesid.report.tables import diagnosis_tables as tables

__all__ = ["diagnosis_report", "unseen_candidates"]

WEAK = 0.5
"""Power below which a candidate could hardly have been seen."""

NEXT = "Recommended experiments"
"""Title of the section that says what to fly next."""


def diagnosis_report(result: Diagnosis, identification: Identification | None, title: str, file: Path) -> None:
    """Write the report of a diagnosis as PDF, whole or not at all.

    Parameters
    ----------
    result : Diagnosis
    identification : Identification or None
        Identification with the extended model, None where it was not sampled.
    title : str
        Title of the study.
    file : path
    """
    document = Document(title, "Diagnosis")
    _add_verdict(document, result)
    evidence.add_residuals(document, result)
    evidence.add_candidates(document, result)
    evidence.add_hypotheses(document, result)
    if result.verdict.causes:
        evidence.add_causes(document, result)
    evidence.add_disturbance(document, result)
    _add_gain(document, result)
    _add_advice(document, result)
    if identification is None:
        _add_assumptions(document, result)
    else:
        document.section("Method of the diagnosis")
        document.items(list(sentences.method_sentences(result)))
        _add_sampled(document, result, identification)
    document.write(file)


def _add_verdict(document: Document, result: Diagnosis) -> None:
    verdict = result.verdict
    document.section("Verdict")
    document.paragraph(sentences.verdict_sentence(result))
    document.items(list(sentences.cause_sentences(result)))
    if verdict.rivals:
        document.paragraph(
            f"Explaining the data as well: {_sets(verdict.rivals)}. Section '{NEXT}' says how to tell them apart."
        )
    if others := improbable_rivals(result):
        document.paragraph(f"Leaving nothing but noise too, but less probable by their evidence: {_sets(others)}.")
    document.paragraph(sentences.gain_sentence(result))
    document.paragraph(sentences.alarm_sentence(result))
    if verdict.status in (Status.UNKNOWN, Status.UNRESOLVED):
        document.paragraph(
            f"{sentences.wrench_sentence(result.unexplained)} Inertial parameters identified with the present model "
            "may be shifted by more than their uncertainties say."
        )


def _sets(hypotheses: Sequence[Hypothesis]) -> str:
    return "; ".join(" + ".join(hypothesis.labels) for hypothesis in hypotheses)


def _add_gain(document: Document, result: Diagnosis) -> None:
    named = bool(result.verdict.causes)
    document.section("Gain of the extension" if named else "Fit of the present model")
    rows, header = tables.gain_rows(result), ["measure", "before", "after", "expected"]
    if not named:
        rows, header = [[name, value, expected] for name, value, _, expected in rows], ["measure", "value", "expected"]
    document.table(
        header,
        rows,
        "Fit and prediction. "
        + (
            "With one recording, none can be predicted from others."
            if result.gain.before.held_out is None
            else "The held-out log score of a recording is the logarithm of the density that the model, trained on the "
            "other recordings, gives to it."
        ),
        ["left", *["right"] * (len(header) - 1)],
    )
    shifts = tables.shift_rows(result)
    if shifts and named:
        document.table(
            ["parameter", "unit", "before ± sd", "after ± sd", "shift [sd before]", "sd after / before"],
            shifts,
            "Inertial parameters. A shift of many standard deviations is the error that would have been believed; a "
            "ratio above one is the honest price of the added unknowns. Widths before assume that the present model "
            "is right.",
            ["left", "left", "right", "right", "right", "right"],
        )
    elif shifts:
        document.table(
            ["parameter", "unit", "mean ± sd"],
            [row[:3] for row in shifts],
            "Inertial parameters by the present model (Laplace approximation).",
            ["left", "left", "right"],
        )


def _add_advice(document: Document, result: Diagnosis) -> None:
    document.section(NEXT)
    verdict = result.verdict
    improbable = improbable_rivals(result)
    if rivals := (*verdict.rivals, *improbable):
        _add_rivals(document, result, rivals, improbable)
    if verdict.status is Status.UNKNOWN:
        document.paragraph(
            "Nothing in the catalogue explains the residual. Repeat a manoeuvre unchanged but later: what depends on "
            "the clock then comes back at another instant of the motion, what depends on the motion at the same. Then "
            "repeat it with the base turned to another attitude, and record with the arm at rest."
        )
    if verdict.status is Status.UNRESOLVED:
        document.paragraph("Record longer, or repeat the manoeuvres: the signal grows with the root of their number.")
    if verdict.status is Status.EXPLAINED and not improbable:
        document.paragraph(
            "No other causes that were tried leave nothing but noise"
            + (", but for the other names given under 'Verdict'." if verdict.equivalents else ".")
        )
    if hidden := unseen_candidates(result.candidates):
        document.paragraph(
            "The following candidates could not have been seen: in the size that their priors expect, these manoeuvres "
            "would have raised no alarm in more than half of all cases. Their absence from the verdict says little "
            "about them."
        )
        document.table(
            ["candidate", "power", "95 % limits on its magnitude"],
            tables.unseen_rows(hidden),
            "Candidates out of reach of these manoeuvres.",
            ["left", "right", "left"],
        )
    elif not rivals and verdict.status in (Status.ADEQUATE, Status.EXPLAINED):
        document.paragraph(
            "Every candidate, drawn from its prior, would have raised the alarm in at least half of all cases: "
            "these manoeuvres are enough."
        )


def unseen_candidates(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates that these manoeuvres could hardly have shown, the least visible first."""
    weak = [(row.power, row) for row in candidates if row.power is not None and row.power < WEAK]
    return [row for _, row in sorted(weak, key=lambda item: item[0])]


def _add_rivals(
    document: Document, result: Diagnosis, rivals: Sequence[Hypothesis], improbable: Sequence[Hypothesis]
) -> None:
    leader = " + ".join(result.verdict.best.labels or rivals[0].labels)
    document.table(
        ["rival", "log Bayes factor", "p of what it leaves", "it has", "cosine"],
        tables.rival_rows(result, rivals),
        f"Other causes that leave nothing but noise. Log Bayes factor: that of {leader} over the rival. Cosine: the "
        f"share of the signal of {leader} that the rival can make, apart from what the model's unknowns explain; at "
        "one, these manoeuvres cannot tell them apart, whatever the noise.",
        ["left", "right", "right", "left", "right"],
    )
    if improbable:
        document.paragraph(
            f"By fit alone {_sets(improbable)} would be sufficient. The Bayes factor speaks against "
            f"{'it' if len(improbable) == 1 else 'them'}: it counts the size and the number of the parameters needed "
            "against their priors. Where the priors are in doubt, do these experiments:"
        )
    document.items(list(sentences.advice_sentences(result, rivals)))


def _add_assumptions(document: Document, result: Diagnosis) -> None:
    posterior = result.posterior
    document.section("Assumptions")
    document.items(
        [
            *sentences.method_sentences(result),
            *model_sentences(posterior, integration_error_at(posterior, result.start)),
        ]
    )
    add_joints(document, posterior)


def _add_sampled(document: Document, result: Diagnosis, identification: Identification) -> None:
    document.section("The extended model, sampled")
    document.paragraph(
        "The rest of this report is the identification with the "
        + ("model that holds the named causes" if result.verdict.causes else "present model")
        + " by sampling: uncertainties from here on need no linearisation."
    )
    add_identification(document, identification, [])
