"""The result and report of a diagnosis that ends with wrong conventions: nothing else can be said of the simulation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bayesid.diagnosis.evidence.verdict import Rest, Status
from bayesid.recording.convention import Convention, in_one_line
from bayesid.report.document import Document
from bayesid.report.numbers import format_probability

__all__ = ["add_conventions", "convention_report", "convention_verdict"]

CERTAIN = 0.9  # probability from which a convention is named without alternatives


def convention_verdict(conventions: Sequence[Convention]) -> dict[str, Any]:
    """Return the content of diagnosis.json: explained by them, or ambiguous where some exclude one another.

    Parameters
    ----------
    conventions : sequence of Convention
    """
    certain = [convention.name for convention in conventions if convention.probability >= CERTAIN]
    others = [convention.name for convention in conventions if convention.probability < CERTAIN]
    best = [*certain, *others[:1]]
    status = Status.AMBIGUOUS if len(others) > 1 else Status.EXPLAINED
    probability: dict[str, float] = {}
    for convention in conventions:
        probability[convention.name] = min(1.0, probability.get(convention.name, 0.0) + convention.probability)
    return {
        "status": status.value,
        "causes": list(dict.fromkeys(best)),
        "equivalent_to": {},
        "ambiguous_with": [list(dict.fromkeys([*certain, other])) for other in others[1:]],
        "conventions": [convention.to_dict() for convention in conventions],
        "probability": {"nothing": 0.0, "unknown": 0.0, "causes": probability},
        "candidates": [],
        "sets": [],
        "remainder": {"probability": 0.0, "verdict": Rest.NONE.value},
    }


def convention_report(conventions: Sequence[Convention], title: str, file: Path, *, origin: str = "") -> None:
    """Write the report of one page.

    Parameters
    ----------
    conventions : sequence of Convention
    title : str
        Title of the study.
    file : path
    origin : str, optional
        Where the report comes from.
    """
    document = Document(title, "Diagnosis")
    document.foot(origin)
    add_conventions(document, conventions)
    document.paragraph("Causes in the simulation are searched for only after the conventions are correct.")
    document.write(file)


def add_conventions(document: Document, conventions: Sequence[Convention]) -> None:
    """Add a section on wrong conventions and their remedies.

    Parameters
    ----------
    document : Document
    conventions : sequence of Convention
    """
    document.section("Wrong conventions")
    document.paragraph(
        "The recordings contradict their description in the study, and agree with the simulation once it is "
        "corrected. The lines in the table correct the study; bayesid init --fix writes them."
    )
    # with a minus sign in place of the hyphen, after which a line may end
    document.items([convention.text.replace(" -", " \N{MINUS SIGN}") for convention in conventions])
    document.table(
        ["convention", "probability:", "remedy in the study"],
        [
            [convention.name, format_probability(convention.probability), in_one_line(convention.remedy)]
            for convention in conventions
        ],
        "Wrong conventions and their remedies. The probabilities compare them, by the balance of momentum, with each "
        "other and with a generic alternative that explains nothing in particular.",
    )
