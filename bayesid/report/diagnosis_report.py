"""The report of a diagnosis: what the simulation gets wrong, its cause, the evidence, and what to fly next."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from bayesid.diagnosis import Diagnosis, Status
from bayesid.inference import Identification
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.report import diagnosis_evidence as evidence
from bayesid.report import diagnosis_tables as rows
from bayesid.report import diagnosis_text as text
from bayesid.report.assumptions import model_sentences
from bayesid.report.diagnosis_advice import adequate_too, unseen
from bayesid.report.document import Document
from bayesid.report.identification_report import add_identification
from bayesid.report.report_tables import joint_rows

__all__ = ["diagnosis_report", "diagnosis_sentences"]


def diagnosis_sentences(result: Diagnosis) -> Iterator[str]:
    """Say the verdict in sentences."""
    yield text.verdict_sentence(result)
    yield from text.cause_sentences(result)
    for rival in result.verdict.rivals:
        yield f"Rival: {' + '.join(rival.labels)}."
    yield text.gain_sentence(result)
    if result.verdict.status in (Status.UNKNOWN, Status.UNRESOLVED):
        yield text.wrench_sentence(result.unexplained)


def diagnosis_report(result: Diagnosis, identification: Identification | None, title: str, file: Path) -> None:
    """Write the report of a diagnosis as PDF, all or nothing.

    Parameters
    ----------
    result : Diagnosis
    identification : Identification or None
        Of the extended model, where it was sampled.
    title : str
        Of the study.
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
    _add_assumptions(document, result, identification)
    if identification is not None:
        document.section("The extended model, sampled")
        document.paragraph(
            "The rest of this report is the identification of the "
            + ("model with the named causes" if result.verdict.causes else "present model")
            + ", by sampling: uncertainties from here on need no linearisation."
        )
        add_identification(document, identification, [])
    document.write(file)


def _add_verdict(document: Document, result: Diagnosis) -> None:
    document.section("Verdict")
    document.paragraph(text.verdict_sentence(result))
    document.items(list(text.cause_sentences(result)))
    if result.verdict.rivals:
        names = "; ".join(" + ".join(rival.labels) for rival in result.verdict.rivals)
        document.paragraph(f"Doing as well: {names}. What to fly to tell them apart is said under 'What to fly next'.")
    if others := adequate_too(result):
        names = "; ".join(" + ".join(other.labels) for other in others)
        document.paragraph(f"Leaving nothing but noise too, but less probable by their evidence: {names}.")
    document.paragraph(text.gain_sentence(result))
    document.paragraph(text.rest_sentence(result))
    if result.verdict.status in (Status.UNKNOWN, Status.UNRESOLVED):
        document.paragraph(
            f"{text.wrench_sentence(result.unexplained)} Inertial parameters identified with the present model may be "
            "shifted by more than their uncertainties say."
        )


def _add_gain(document: Document, result: Diagnosis) -> None:
    named = bool(result.verdict.causes)
    document.section("What the extension gains" if named else "How the present model stands")
    table, header = rows.gain_rows(result), ["measure", "before", "after", "expected"]
    aligned = ["left", "right", "right", "right"]
    if not named:
        table, header, aligned = (
            [[row[0], row[1], row[3]] for row in table],
            ["measure", "value", "expected"],
            aligned[:3],
        )
    document.table(
        header,
        table,
        "Fit and prediction. "
        + (
            "With one recording, none can be predicted from others."
            if result.gain.before.held_out is None
            else "The held-out log score of a recording is the logarithm of the density that the model, trained on the "
            "other recordings, gives to it."
        ),
        aligned,
    )
    shifts = rows.shift_rows(result)
    if shifts and named:
        document.table(
            ["parameter", "unit", "before ± sd", "after ± sd", "shift [sd before]", "sd after / before"],
            shifts,
            "Inertial parameters. A shift of many standard deviations is the error that would have been believed; a "
            "ratio above one is the honest price of the added unknowns. Widths before suppose that the present model "
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
    document.section("What to fly next")
    verdict = result.verdict
    improbable = adequate_too(result)
    if rivals := (*verdict.rivals, *improbable):
        leader = " + ".join(verdict.best.labels or rivals[0].labels)
        document.table(
            ["rival", "log Bayes factor", "p of what it leaves", "it has", "cosine"],
            rows.rival_rows(result, rivals),
            f"Other causes that leave nothing but noise. Log Bayes factor: of {leader} over it. Cosine: how much of "
            f"the signal of {leader} the rival can make, once the model's unknowns had their share; at one, these "
            "manoeuvres cannot tell them apart, whatever the noise.",
            ["left", "right", "right", "left", "right"],
        )
        if improbable:
            names = "; ".join(" + ".join(other.labels) for other in improbable)
            document.paragraph(
                f"By their fit alone {names} would do. What speaks against {'it' if len(improbable) == 1 else 'them'} "
                "is the Bayes factor, which counts the size and the number of the parameters needed against their "
                "priors. Where the priors are in doubt, fly this:"
            )
        document.items(list(text.advice_sentences(result, rivals)))
    if verdict.status is Status.UNKNOWN:
        document.paragraph(
            "Nothing in the catalogue explains the residual. Repeat a manoeuvre unchanged: what the clock drives comes "
            "back at another place, what the motion drives comes back at the same. Then repeat it with the base turned "
            "to another attitude, and record with the arm at rest."
        )
    if verdict.status is Status.UNRESOLVED:
        document.paragraph("Record longer, or repeat the manoeuvres: the signal grows with the root of their number.")
    if verdict.status is Status.EXPLAINED and not improbable:
        document.paragraph(
            "No other causes that were tried leave nothing but noise"
            + (", but for the other names given under 'Verdict'." if verdict.equivalents else ".")
        )
    if hidden := unseen(result.candidates):
        document.paragraph(
            "The following could not have been seen: had they been there in the size that their priors expect, these "
            "manoeuvres would have raised no alarm in more than half of all cases. That nothing was found says little "
            "about them."
        )
        document.table(
            ["candidate", "power", "95 % limits on its magnitude"],
            rows.unseen_rows(hidden),
            "Candidates out of reach of these manoeuvres.",
            ["left", "right", "left"],
        )
    elif not rivals and verdict.status in (Status.ADEQUATE, Status.EXPLAINED):
        document.paragraph(
            "Every candidate, drawn from its prior, would have raised the alarm in at least half of all cases: "
            "these manoeuvres are enough."
        )


def _add_assumptions(document: Document, result: Diagnosis, identification: Identification | None) -> None:
    document.section("What was assumed" if identification is None else "How the diagnosis was made")
    sentences = list(text.made_sentences(result))
    if identification is None:
        posterior = result.posterior
        sentences += model_sentences(posterior, integration_error_at(posterior, result.start))
    document.items(sentences)
    if identification is None and (joints := joint_rows(result.posterior)):
        document.table(
            ["joint", "noise per sample", "order", "chi-square per sample"],
            joints,
            "Smoothing of the joints: noise of the samples, the derivative of the position that is taken for white "
            "noise, and the misfit of the samples to the spline. Orders and misfits are by recording.",
        )
