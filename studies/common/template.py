"""Parts that make all studies' reports alike: first page, setup, the paper's statements, and what is written beside.

A report is a `bayesid.report.Document` of two to four pages: `add_first_page`, `add_setup`, at most two figures and two
tables of evidence, calibration and failures, `add_statements`; `write_study` adds the meanings of its terms and where
it comes from, and writes it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from matplotlib.figure import Figure

from bayesid._io.files import write_json
from bayesid.report import Document
from studies.common.report_parts import glossary
from studies.common.study import CsvTable, Finding, Goal, Setup, Statement

__all__ = ["Finding", "Setup", "Statement", "Summary", "add_first_page", "add_setup", "add_statements"]
__all__ += ["write_study", "write_table"]


@dataclass(frozen=True)
class Summary:
    """What a reader of the first page alone should know."""

    # one sentence each
    question: str
    answer: str
    goals: tuple[Goal, ...]
    valid: str  # conditions under which the answer holds
    full: bool  # whether the study was run in full


def add_first_page(document: Document, summary: Summary, figure: Figure | None = None, caption: str = "") -> None:
    """Add the answer in a box, the figure that decides if there is one, and the table of goals."""
    run = "full run" if summary.full else "not run in full: read it as an example, not as the result"
    document.decision(summary.answer, [("Question", summary.question), ("Valid when", summary.valid), ("Effort", run)])
    if figure is not None:
        document.figure(figure, caption)
    rows = [[goal.text, goal.reached, goal.verdict.value] for goal in summary.goals]
    document.table(["goal", "reached", "verdict"], rows, "Goals.", ["left"] * 3)


def add_setup(
    document: Document, setup: Setup, picture: Figure | None = None, caption: str = "", *, outline: Figure | None = None
) -> None:
    """Add the conditions in a box, with an outline of the robot in it or a picture of its motion below."""
    document.section("Setup")
    entries = [(name.capitalize(), text) for name, text in asdict(setup).items()]
    document.decision("Conditions", entries, outline)
    if picture is not None:
        document.figure(picture, caption)


def add_statements(document: Document, statements: Sequence[Statement]) -> None:
    """Add the table of the paper's statements."""
    document.section("What the paper states, and what is found here")
    rows = [[item.text, item.finding.value, item.reason] for item in statements]
    document.table(["the paper", "finding", "why"], rows, "Statements of the paper.", ["left"] * 3)


def write_study(document: Document, summary: Summary, output: Path, origin: str | None = None) -> None:
    """Write the report as PDF, with where it comes from at its foot, and beside it question, answer and goals as JSON.

    The meanings of the terms that it uses stand at the foot of its last page, which is filled to one half where the
    figures' heights permit.

    Parameters
    ----------
    document : Document
    summary : Summary
    output : Path
        File of the PDF; that of the JSON has the same name but for its suffix.
    origin : str, optional
        Result of `studies.common.provenance.study_origin`.
    """
    document.foot(origin or "", glossary(document))
    document.write(output, filled=True)
    write_json(output.with_suffix(".json"), {**asdict(summary), "origin": origin})


def write_table(output: Path, name: str, header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write a table as CSV beside a report, ``REPORT-NAME.csv``, and return the name of the file."""
    return CsvTable(name, header, rows).write(output)
