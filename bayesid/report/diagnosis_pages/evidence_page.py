"""Second page of a diagnosis report: residuals before and after, and the prediction of recordings left out."""

from __future__ import annotations

from bayesid.diagnosis import Diagnosis, Hypothesis
from bayesid.inference.residual_view import ResidualView
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.sentences.diagnosis_sentences import alarm_sentence, gain_sentence
from bayesid.report.tables import diagnosis_tables as tables

__all__ = ["add_evidence", "add_other_residuals"]

RECORDINGS = 6
"""Largest number of further recordings whose residuals are drawn over time."""


def add_evidence(document: Document, result: Diagnosis) -> None:
    """Add the residuals of the strongest recording, the spectra of all, and what the causes gain."""
    document.section("Evidence")
    sides = _sides(result)
    strongest = result.strongest_recording
    document.paragraph(
        f"{alarm_sentence(result)} {gain_sentence(result)} Residuals are in units of their noise σ and freed of their "
        "correlation, so that a right model leaves independent values of standard deviation one. "
        + (
            "Before is the present model, after the one with the named causes, all unknowns fitted again."
            if sides[1:]
            else ""
        )
    )
    document.figure(
        figures.residual_histories(sides, strongest),
        f"Residuals in {_names(result)[strongest]}"
        + (", the recording that changes most" if len(_names(result)) > 1 else "")
        + ", sensor axes. The grey band is ± 2 σ; the line is a running mean over a fortieth of the recording.",
        floating=True,
    )
    document.figure(
        figures.residual_spectra(sides),
        "Spectra of the residuals, all recordings pooled, frequencies gathered in bins of equal width: white noise has "
        "level one. The lowest bins hold what a disturbance or a wrong body leaves.",
        floating=True,
    )
    _add_gain(document, result)


def add_other_residuals(document: Document, result: Diagnosis) -> None:
    """Add the residuals of the other recordings over time."""
    sides, strongest = _sides(result), result.strongest_recording
    others = [index for index in range(len(_names(result))) if index != strongest]
    for index in others[:RECORDINGS]:
        document.figure(figures.residual_histories(sides, index), f"Residuals in {_names(result)[index]}, sensor axes.")
    if len(others) > RECORDINGS:
        document.paragraph(f"Of {len(others)} further recordings the first {RECORDINGS} are drawn.")


def _add_gain(document: Document, result: Diagnosis) -> None:
    named = bool(result.verdict.causes)
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
            else "The held-out log score of a recording is the logarithm of the density that the model, fitted to the "
            "other recordings, gives to it."
        ),
        ["left", *["right"] * (len(header) - 1)],
    )


def _sides(result: Diagnosis) -> list[ResidualView]:
    sides = [_residuals(result.before)]
    return [*sides, _residuals(result.after)] if result.verdict.causes else sides


def _residuals(hypothesis: Hypothesis) -> ResidualView:
    """Return the residuals of a hypothesis at its mode."""
    return hypothesis.fit.view


def _names(result: Diagnosis) -> list[str]:
    return [manoeuvre.recording.name for manoeuvre in result.before.fit.posterior.manoeuvres]
