"""Evidence in a diagnosis report: residuals before and after, and the prediction of recordings left out."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.outcome.gain import folds_of
from bayesid.report import figures
from bayesid.report.diagnosis.diagnosis_sentences import alarm_sentence
from bayesid.report.document import Document, Rows
from bayesid.report.numbers import format_fixed

__all__ = ["add_evidence", "add_other_residuals", "gain_rows"]

RECORDINGS = 2  # largest number of further recordings whose residuals are drawn over time


def add_evidence(document: Document, result: Diagnosis) -> None:
    """Add the residuals of the strongest recording, the spectra of all, and what the causes gain."""
    document.section("Evidence")
    strongest = result.strongest_recording
    document.paragraph(
        f"{alarm_sentence(result)} Residuals are in units of their noise σ and decorrelated, "
        "so that a correct model gives independent values with a standard deviation of one. "
        + (
            "Before refers to the present model, after to the one with the named causes and all unknowns fitted again."
            if result.named
            else ""
        )
    )
    document.figure(
        figures.plot_residuals(result, strongest),
        f"Residuals of {result.recordings[strongest]}"
        + (", the recording that changes most" if len(result.recordings) > 1 else "")
        + ", sensor axes. The grey band is ± 2 σ; the line is a running mean over one fortieth of the recording.",
    )
    document.figure(
        figures.plot_spectrum(result),
        "Spectra of the residuals, with all recordings pooled and frequencies grouped into bins of equal width: white "
        "noise has a level of one. The effect of a disturbance or of a wrong body appears in the lowest bins.",
    )
    _add_gain(document, result)


def add_other_residuals(document: Document, result: Diagnosis) -> None:
    """Add the residuals of the other recordings over time."""
    strongest = result.strongest_recording
    others = [index for index in range(len(result.recordings)) if index != strongest]
    for index in others[:RECORDINGS]:
        document.figure(
            figures.plot_residuals(result, index),
            f"Residuals of {result.recordings[index]}, sensor axes.",
        )
    if len(others) > RECORDINGS:
        document.paragraph(f"The first {RECORDINGS} of {len(others)} further recordings are plotted.")


def _add_gain(document: Document, result: Diagnosis) -> None:
    rows, header = gain_rows(result), ["measure", "before:", "after:", "expected:"]
    if not result.named:
        header = ["measure", "value:", "expected:"]
        rows = [[name, value, expected] for name, value, _, expected in rows]
    document.table(
        header,
        rows,
        "Fit and prediction. "
        + (
            "A single recording cannot be predicted from others."
            if result.gain.before.held_out is None
            else "The left-out log score of a recording is the logarithm of its density under the model fitted to the "
            "other recordings."
        ),
    )


def gain_rows(result: Diagnosis) -> Rows:
    """Return each measure of fit and prediction with its value before and after, and what noise alone would give."""
    before, after = result.gain.before, result.gain.after
    rows = [
        _measure("chi-square per sample", before.chi2_per_sample, after.chi2_per_sample, 3),
        _measure("share of residuals within 1 σ", before.inside, after.inside, 3),
        *(_measure(f"rms residual of {name} [σ]", value, after.rms.get(name), 3) for name, value in before.rms.items()),
    ]
    spread = math.sqrt(2.0 / result.before.fit.posterior.samples)
    expected = [f"1 ± {format_fixed(spread, 3)}", "0.683", *["1"] * len(before.rms)]
    if before.held_out is not None and after.held_out is not None:
        rows += [
            _measure(f"left-out log score of {name}", float(one), float(two), 1)
            for name, one, two in zip(_left_out(result.recordings), before.held_out, after.held_out, strict=True)
        ]
        rows.append(_measure("left-out log score, sum", float(before.held_out.sum()), float(after.held_out.sum()), 1))
    expected += ["higher is better"] * (len(rows) - len(expected))
    return [[*row, text] for row, text in zip(rows, expected, strict=True)]


def _left_out(recordings: Sequence[str]) -> list[str]:
    """Return what is left out at a time: a recording, or where there are many a group of them."""
    folds = folds_of(len(recordings))
    return [recordings[fold[0]] if len(fold) == 1 else f"every tenth from {recordings[fold[0]]}" for fold in folds]


def _measure(name: str, before: float, after: float | None, decimals: int) -> list[str]:
    return [name, format_fixed(before, decimals), "" if after is None else format_fixed(after, decimals)]
