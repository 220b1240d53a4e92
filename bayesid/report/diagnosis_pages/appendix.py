"""Appendix of a diagnosis report: all candidates, bounds, sensitivity of the verdict, other recordings, glossary."""

from __future__ import annotations

from bayesid.diagnosis import Diagnosis, TorqueReading
from bayesid.inference.sensor_fit import sensor_fits
from bayesid.report import figures
from bayesid.report.diagnosis_pages.evidence_page import add_other_residuals
from bayesid.report.document import Document
from bayesid.report.sentences.diagnosis_method import GLOSSARY
from bayesid.report.tables import diagnosis_tables, probability_tables

__all__ = ["add_appendix", "add_measured"]


def add_appendix(document: Document, result: Diagnosis) -> None:
    """Add sensitivity, candidates, bounds, the residuals of the other recordings, and the glossary."""
    document.section("Appendix: how firm the verdict is")
    changed = result.sensitivity.changes
    document.paragraph(
        f"The verdict would be another under {len(changed)} of {len(result.sensitivity.others)} other choices"
        + (f": {', '.join(changed)}." if changed else ".")
    )
    document.table(
        ["choice", "verdict", "another"],
        probability_tables.sensitivity_rows(result),
        "Sensitivity of the verdict to the two numbers of the prior and to the range of the causes' scales.",
        ["left", "left", "left"],
    )
    _add_candidates(document, result)
    _add_torques(document, result)
    document.table(
        ["cause", "largest size", "why no more is plausible"],
        probability_tables.bound_rows(dict(result.bounds)),
        "Physical bounds on the scales of the causes.",
        ["left", "right", "left"],
    )
    add_other_residuals(document, result)
    document.table(["term", "meaning"], [list(entry) for entry in GLOSSARY], "Glossary.", ["left", "left"])


def _add_candidates(document: Document, result: Diagnosis) -> None:
    document.table(
        [
            "candidate",
            "probability",
            "signal to noise",
            "p, adjusted",
            "log Bayes factor",
            "size, or 95 % limit",
            "power",
        ],
        diagnosis_tables.candidate_rows(result.candidates, result.alarm.level),
        f"All {len(result.candidates)} candidates, each alone beside the present model, from the linear response; the "
        "probability is that of being at work, whatever accompanies it. The p-value counts all tests. Sizes are given "
        "of candidates that are seen; of the others, the magnitudes that they stay below with 95 %. A cell is empty "
        "where nothing was evaluated.",
        ["left", "right", "right", "right", "right", "left", "right"],
    )


def _add_torques(document: Document, result: Diagnosis) -> None:
    if isinstance(result.torques, TorqueReading):
        document.table(
            ["candidate", "probability", "size ± sd"],
            probability_tables.torque_rows(result.torques),
            "What could act on the joint torques alone, read beside the verdict on the motion: the probability of "
            "being at work, and the size where it is. Something unknown is a torque of any smooth course at one joint.",
            ["left", "right", "left"],
        )


def add_measured(document: Document, result: Diagnosis) -> None:
    """Add measured and simulated readings of every recording, with the named causes in the model."""
    document.section("Measured and simulated")
    posterior = result.posterior
    for manoeuvre, sensors in zip(posterior.manoeuvres, sensor_fits(posterior, result.start), strict=True):
        document.figure(
            figures.measured_against_simulated(sensors),
            f"Measured and simulated in {manoeuvre.recording.name}, sensor axes; beneath, the residual in σ.",
        )
