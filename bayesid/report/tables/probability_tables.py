"""Rows of the tables of probabilities: causes, sets, choices that were made, bounds, and pairs of causes."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.diagnosis import Diagnosis, TorqueReading
from bayesid.diagnosis.outcome.cause_sizes import GroupSize
from bayesid.diagnosis.outcome.inseparable_causes import CausePair
from bayesid.report.document import Rows
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_percent,
    format_probability,
    format_signed,
    format_text,
    format_unit,
)
from bayesid.report.sentences.set_words import NOTHING, SOMETHING, verdict_text
from bayesid.report.sentences.torque_sentences import torque_size
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["bound_rows", "pair_rows", "probability_rows", "sensitivity_rows", "set_rows", "torque_rows"]


def probability_rows(result: Diagnosis, most: int) -> Rows:
    """Return name and probability of nothing, of something unknown, and of the most probable classes of causes.

    Parameters
    ----------
    result : Diagnosis
    most : int
        Number of classes.
    """
    probabilities = result.probabilities
    classes = dict.fromkeys(result.class_of(cause) for cause in probabilities.causes)
    ranked = sorted(classes, key=lambda members: (-probabilities.of_any(members), members))[:most]
    rows = [[" or ".join(members), format_probability(probabilities.of_any(members))] for members in ranked]
    return [
        *rows,
        [SOMETHING, format_probability(probabilities.unknown)],
        [NOTHING, format_probability(probabilities.nothing)],
    ]


def torque_rows(found: TorqueReading) -> Rows:
    """Return name, probability and size of each candidate that acts on the joint torques, nothing and unknown last."""
    rows = [[row.name, format_probability(row.probability), torque_size(found, row.name)] for row in found.causes]
    return [
        *rows,
        [SOMETHING, format_probability(found.probabilities.unknown), ""],
        [NOTHING, format_probability(found.probabilities.nothing), ""],
    ]


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
            rows.append([name, *(whole if before is None else ["", ""]), *_size_cells(size)])
            before = size.cause
    return rows


def _size_cells(size: GroupSize) -> list[str]:
    if size.cause == NOTHING:
        return ["", "", ""]
    if size.size is None:
        return ["fixed by physics", "", ""]
    share = "" if size.share is None else f"{format_percent(size.share)}{'' if size.plausible else ', beyond it'}"
    if size.unit is None:
        return ["", "", share]
    unit = format_unit(size.unit)
    bound = "" if size.largest is None else f"{format_number(size.largest, 2)} {unit}".rstrip()
    return [f"{format_number(size.size, 2)} {unit}".rstrip(), bound, share]


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


def pair_rows(pairs: Sequence[CausePair]) -> Rows:
    """Return two causes, their largest and smallest cosine, and what that means."""
    return [
        [
            pair.first,
            pair.second,
            format_fixed(pair.largest, 3),
            format_fixed(pair.smallest, 3),
            "equivalent" if pair.equivalent else "",
        ]
        for pair in pairs
    ]
