"""Third page of a diagnosis report: why these causes, with what else could be at work and whether it is plausible."""

from __future__ import annotations

from bayesid.diagnosis import Diagnosis
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.tables import diagnosis_tables, probability_tables

__all__ = ["add_causes"]

SETS = 6
"""Sets in the table of the most probable."""

BARS = 20
"""Largest number of bars of the figure of candidates."""


def add_causes(document: Document, result: Diagnosis) -> None:
    """Add the most probable sets, the sizes of the named causes, and the strengths of the candidates."""
    named = bool(result.verdict.causes)
    document.section(
        "Why this cause"
        if len(result.verdict.causes) == 1
        else "Why these causes"
        if named
        else "What could be at work"
    )
    document.table(
        ["causes", "probability", "log evidence", "size", "bound", "share of the bound"],
        probability_tables.set_rows(result, SETS),
        f"The {min(SETS, len(result.probabilities.sets))} most probable sets of causes, of "
        f"{len(result.probabilities.sets)} considered. The log evidence is relative to that of nothing. Sizes are root "
        "mean squares of the amplitudes that share a unit, by the linear model at the most probable scale; a size "
        "beyond its bound is not plausible. Of a body that is missing or sloshes the mass stands for all its moments.",
        ["left", "right", "right", "left", "right", "right"],
    )
    if named:
        _add_sizes(document, result)
    drawn = sorted(result.candidates, key=lambda row: (-row.signal_to_noise, row.name))[:BARS]
    document.figure(
        figures.candidate_strengths(drawn, result.verdict.causes, result.alarm.level),
        f"Signal-to-noise ratio of the {len(drawn)} strongest of {len(result.candidates)} candidates, each alone "
        "beside the present model. Several can stand out for one cause, since they explain parts of the same residual.",
        floating=True,
    )


def _add_sizes(document: Document, result: Diagnosis) -> None:
    if rows := diagnosis_tables.cause_rows(result):
        document.table(
            ["quantity", "unit", "value ± sd", "from zero", "bound"],
            rows,
            "Size of the named causes, fitted together with all unknowns. Changes of a link are in the link's axes, "
            "with its inertia about its centre of mass; all other vectors are in base or sensor axes.",
            ["left", "left", "right", "right", "right"],
        )
    else:
        document.paragraph("The named causes have no free parameter: physics fixes their size.")
