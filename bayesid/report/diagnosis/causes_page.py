"""Causes in a diagnosis report: why these, with what else could be at work and whether it is plausible."""

from __future__ import annotations

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of, instants_of
from bayesid.diagnosis.outcome.cause_sizes import GroupSize
from bayesid.report import figures
from bayesid.report.diagnosis.cause_words import NOTHING
from bayesid.report.document import Document, Rows
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_percent,
    format_probability,
    format_quantity,
    format_signed,
    format_unit,
)

__all__ = ["SETS", "add_causes", "cause_rows", "set_rows"]

SETS = 6
"""Number of sets in the table of the most probable."""

BARS = 12  # largest number of bars of the figure of candidates


def add_causes(document: Document, result: Diagnosis) -> None:
    """Add the most probable sets, the sizes of the named causes, and the strengths of the candidates."""
    titles = ("Possible causes", "Why this cause", "Why these causes")
    document.section(titles[min(len(result.verdict.causes), 2)])
    document.table(
        ["causes", "probability:", "log evidence:", "size", "bound:", "share of the bound:"],
        set_rows(result, SETS),
        f"The {min(SETS, len(result.probabilities.sets))} most probable sets of causes, of "
        f"{len(result.probabilities.sets)} weighed: single causes, and sets of up to three that extend a probable one. "
        "The log evidence is relative to that of no cause. Sizes are "
        "root mean squares of the amplitudes that share a unit, from the linear model at the most probable scale; a "
        "size beyond its bound is implausible. Of a missing or sloshing body, only the mass is shown.",
    )
    if rows := cause_rows(result) if result.named else []:
        document.table(
            ["quantity", "unit", "value ± sd:", "from zero:", "bound:"],
            rows,
            "Size of the named causes, fitted together with all unknowns. Changes of a link are in the link's axes, "
            "with its inertia about its centre of mass; sensor errors are in sensor axes, other vectors in base axes.",
        )
    elif result.named:
        document.paragraph("The named causes have no free parameter: physics determines their size.")
    drawn = sorted(result.candidates, key=lambda row: (-row.signal_to_noise, row.name))[:BARS]
    document.figure(
        figures.candidate_strengths(drawn, result.verdict.causes, result.alarm.level),
        f"Signal-to-noise ratio of the {len(drawn)} strongest of {len(result.candidates)} candidates, each added alone "
        "to the present model. One cause can make several candidates stand out, because they explain parts of the same "
        "residual.",
        floating=True,
    )


def cause_rows(result: Diagnosis) -> Rows:
    """Return quantity, unit, value, distance from zero and bound for every quantity of every named cause.

    The instants of a jump come last, without a distance.
    """
    best = result.after
    sizes = [
        [
            f"{label}.{item.quantity.name}",
            format_unit(item.quantity.unit),
            format_quantity(item.mean, item.sd),
            f"{format_fixed(item.distance, 1)} sd" if item.sd > 0.0 else "",
            _bound_text(result, label, item.quantity.unit),
        ]
        for label in best.labels
        for item in amplitudes_of(best, label)
    ]
    instants = [
        [f"{label}.{quantity.name}", format_unit(quantity.unit), format_quantity(mean, sd), "", ""]
        for label in best.labels
        for quantity, mean, sd in instants_of(best, label)
    ]
    return sizes + instants


def _bound_text(result: Diagnosis, label: str, unit: str) -> str:
    found = [bound.largest for bound in result.bounds.get(label, ()) if bound.unit == unit]
    return format_number(found[0]) if found else ""


def set_rows(result: Diagnosis, most: int) -> Rows:
    """Return cause, probability and log evidence of the set, size, bound and share of it, of the most probable sets.

    A set of several causes, or of causes in several units, has several rows, of which only the first has numbers of the
    whole set; a plus sign stands before each further cause.
    """
    rows = []
    for item in result.probabilities.sets[:most]:
        whole = [format_probability(item.probability), format_signed(item.log_evidence) if item.names else "0"]
        before = None
        for size in result.sizes_of(item) or [GroupSize(NOTHING)]:
            name = size.cause if before is None else f"+ {size.cause}" if size.cause != before else ""
            rows.append([name, *(whole if before is None else ["", ""]), *_size_cells(size, item.generic)])
            before = size.cause
    return rows


def _size_cells(size: GroupSize, generic: str | None) -> list[str]:
    if size.cause == NOTHING or (size.cause == generic and size.size is None):
        return ["", "", ""]
    if size.size is None:
        return ["fixed by physics", "", ""]
    share = "" if size.share is None else f"{format_percent(size.share)}{'' if size.plausible else ', beyond it'}"
    if size.unit is None:
        return ["", "", share]
    unit = format_unit(size.unit)
    bound = "" if size.largest is None else f"{format_number(size.largest, 2)} {unit}".rstrip()
    return [f"{format_number(size.size, 2)} {unit}".rstrip(), bound, share]
