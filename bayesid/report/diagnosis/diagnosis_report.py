"""The report of a diagnosis: from the decision to the next experiment, and an appendix."""

from __future__ import annotations

from pathlib import Path

from bayesid._io.errors import InputError
from bayesid._io.words import joined
from bayesid.diagnosis import Diagnosis
from bayesid.inference.conventions import convention_families
from bayesid.inference.predicted_readings import integration_error_at, sensor_fits
from bayesid.report.diagnosis.appendix import add_appendix
from bayesid.report.diagnosis.causes_page import add_causes
from bayesid.report.diagnosis.consequences_page import add_consequences
from bayesid.report.diagnosis.decision_page import add_decision
from bayesid.report.diagnosis.evidence_page import add_evidence
from bayesid.report.diagnosis.limits_page import add_assumptions, add_limits
from bayesid.report.diagnosis.sampled_page import add_measured, add_sampled
from bayesid.report.document import Document
from bayesid.report.numbers import format_number

__all__ = ["diagnosis_report"]

CONTRADICTED = 10.0
"""Chi-square per sample of the extended model above which nothing physical is read from it: residuals three times the
noise, where the linear evidence about the fit has no meaning."""


def diagnosis_report(
    result: Diagnosis, title: str, file: Path, *, record: str | None = None, origin: str | None = None
) -> None:
    """Write the report of a diagnosis as PDF, whole or not at all.

    Parameters
    ----------
    result : Diagnosis
    title : str
        Title of the study.
    file : path
    record : str, optional
        How often such a verdict was right where the truth was known, as a sentence.
    origin : str, optional
        Where the report comes from: files with their hashes, version, seed and command.
    """
    document = Document(title, "Diagnosis")
    add_decision(document, result, record)
    if origin:
        document.foot(origin)
    document.page()
    if result.gain.after.chi2_per_sample > CONTRADICTED:
        _add_contradiction(document, result)
    else:
        add_evidence(document, result)
        add_causes(document, result)
    add_consequences(document, result)
    add_limits(document, result, result.advice)
    _add_model(document, result)
    add_appendix(document, result)
    document.write(file, filled=True)


def _add_model(document: Document, result: Diagnosis) -> None:
    """Add readings, samples and assumptions of the extended model, or why it cannot be simulated."""
    identification = result.identification
    if identification is not None:
        add_measured(document, result, identification.sensor_fits)
        add_sampled(document, result, identification)
        add_assumptions(document, identification.posterior, identification.integration_error)
    elif result.bounded is not None:  # of many recordings the extended model is simulated in full only to be sampled
        present = result.before.fit
        add_assumptions(document, present.posterior, integration_error_at(present.posterior, present.z))
    elif (refusal := _refusal(result)) is not None:
        document.section("Assumptions")
        document.paragraph(f"The extended model was neither simulated in full nor sampled: {refusal}.")
    else:
        add_measured(document, result, sensor_fits(result.posterior, result.start))
        add_assumptions(document, result.posterior, integration_error_at(result.posterior, result.start))


def _add_contradiction(document: Document, result: Diagnosis) -> None:
    document.section("The simulation contradicts the recordings")
    families = joined([family.title for family in convention_families()])
    document.paragraph(
        f"After the fit with all named causes, chi-square per sample is "
        f"{format_number(result.gain.after.chi2_per_sample, 3)}; noise alone gives 1. From such a large misfit no "
        "physical cause can be inferred: the probabilities only compare the causes with each other. The following "
        f"convention errors of the recordings were tested: {families}. None of them explains several times more than "
        "the study as it stands. Check that the robot file describes the robot that was recorded, then check where "
        "sensors are mounted, and whether anything that was not recorded moved or acted on the robot."
    )


def _refusal(result: Diagnosis) -> InputError | None:
    """Return why the extended model cannot be simulated, as where its prior's centre permits no motion, else None."""
    try:
        _ = result.posterior
    except InputError as error:
        return error
    return None
