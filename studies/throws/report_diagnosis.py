"""Sections of the report on the diagnosis from the data alone, and on the reverse."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesid.diagnosis import Diagnosis
from bayesid.report import Document
from bayesid.report.numbers import format_number, format_p_value, relation
from bayesid.report.tables.probability_tables import set_rows
from studies.throws.diagnosis import Lacking
from studies.throws.goals import wheel_probability

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["add_diagnosis", "add_reverse", "said"]

Floats = NDArray[np.floating]

SHOWN = 3
"""Sets of causes in each table."""


def said(found: Diagnosis) -> str:
    """Return the verdict of a diagnosis in words."""
    causes = ", ".join(found.verdict.causes) or "nothing named"
    return (
        f"{found.verdict.status.value} ({causes}; probability of something unknown {found.probabilities.unknown:.2f})"
    )


def add_diagnosis(document: Document, result: Result) -> None:
    """Add the diagnosis of every body and what its extension gains."""
    document.section("Diagnosis from the data alone")
    for study in result.studies:
        _study(document, study)
    rows = [
        [body, *(_signed(result.errors[name][body]) for name in ("rigid", "extended"))]
        for body in result.errors["rigid"]
    ]
    document.table(
        ("body", "rigid [%]", "extended [%]"),
        rows,
        "Errors of the smallest, middle and largest principal moment, from the diagnosed throws alone.",
        ["left", "right", "right"],
    )


def add_reverse(document: Document, wheels: Mapping[str, Diagnosis], seconds: float) -> None:
    """Add what is said of bodies whose recorded wheel was dropped."""
    document.section("The reverse: the recorded wheel dropped")
    document.paragraph(
        "The first throw of each body is diagnosed without its recorded wheel. Every fit of such a model diverges; "
        "the body is held at its prior, and causes are weighed along the motion that the data show. The verdict counts "
        "as unknown where the named causes leave more than noise, which they do here with the recorded wheel as well. "
        f"This took {seconds / 60.0:.1f} minutes."
    )
    rows = [
        [
            body,
            "yes" if found.held else "no",
            format_number(found.gain.before.chi2_per_sample, 2),
            f"{wheel_probability(found):.3f}",
            " + ".join(found.probabilities.sets[0].names),
            found.verdict.status.value,
        ]
        for body, found in wheels.items()
    ]
    document.table(
        ("body", "held", "chi-square per sample", "wheel about z", "most probable set", "verdict"),
        rows,
        "Bodies without their recorded wheel: whether the body was held at its prior, chi-square per sample of the "
        "model without a wheel, and the probability of a wheel of unknown course about the right axis.",
        ["left", "left", "right", "right", "left", "left"],
    )


def _study(document: Document, study: Lacking) -> None:
    found, held = study.diagnosis, study.held_out
    gain = held.gain
    labels = ", ".join(effect.label for effect in study.taken.fit.effects) or "nothing"
    document.paragraph(
        f"{study.body}, throw {', '.join(name[-3:] for name in study.training)}: {said(found)}. The rigid model "
        "leaves "
        f"chi-square per sample {found.gain.before.chi2_per_sample:.0f}, p "
        f"{relation(format_p_value(found.alarm.p_value))}. "
        f"Extension by {labels}: over {len(gain)} throws left out it "
        f"{'gains' if gain.sum() > 0 else 'loses'} {abs(gain.sum()):.0f} in log score with the same noise and is "
        "better "
        f"on {int((gain > 0).sum())} of them."
    )
    _sets(document, found, study.body)


def _sets(document: Document, found: Diagnosis, of: str) -> None:
    document.table(
        ["causes", "probability", "log evidence", "size", "bound", "share of the bound"],
        set_rows(found, SHOWN),
        f"The most probable sets of causes of {of}. The log evidence is relative to nothing.",
        ["left", "right", "right", "left", "right", "right"],
    )


def _signed(values: Floats) -> str:
    return " / ".join(f"{value:+.2f}" for value in values)
