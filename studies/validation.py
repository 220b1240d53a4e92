"""The validation report: what was promised, what was measured, and where it falls short, from all studies' summaries.

``python -m studies.validation`` writes ``reports/validation.pdf`` from the summaries beside the reports, so that it
cannot disagree with them. It is written anew whenever a report is.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from bayesid.report import Document
from bayesid.report.document import LinkedText
from bayesid.report.figures.figure_style import AFTER, BEFORE, shared_legend, styled, wide_figure
from studies.common.code_version import UNRECORDED
from studies.common.study import NOT_FULL, Goal, Verdict


@dataclass(frozen=True)
class Subject:
    """A question that a reader asks first, and the studies that answer it."""

    question: str
    studies: tuple[str, ...]  # names of the studies


# subjects in the order in which they are reported
SUBJECTS = (
    Subject("Is the identification calibrated and precise?", ("calibration", "base_body", "sensors", "whole_system")),
    Subject("Are causes named?", ("blind_injections", "ets7_drift", "separating", "throws")),
    Subject("Are the manoeuvres good?", ("excitation", "ets7_limits", "load", "planning")),
    Subject("Is it better than its peers, and fast?", ("peers", "base_parameters", "benchmark", "cost")),
    Subject("Does it withstand faults?", ("faults",)),
)

# section of each verdict, misses first
SECTIONS = {
    Verdict.FAIL: "Missed goals",
    Verdict.OPEN: "Undecided goals",
    Verdict.NOT_TESTED: "Goals that were not tested",
    Verdict.PASS: "Goals that were met",
}
ORDER = tuple(SECTIONS)

# colours of the verdicts in the figure
COLOURS = {Verdict.PASS: AFTER, Verdict.FAIL: BEFORE, Verdict.OPEN: "#b0b0b0", Verdict.NOT_TESTED: "#e4e4e4"}


class Severity(StrEnum):
    """What a missed goal means to a user."""

    HIGH = "high"
    MEDIUM = "medium"
    LOW = "low"


MEANING = {
    Severity.HIGH: "an answer or its stated uncertainty may be wrong",
    Severity.MEDIUM: "an answer is missing or less precise than required, and is stated as such",
    Severity.LOW: "an answer takes more time or memory than required",
}

# goals on time, memory and cost, and goals on the truth of what is stated, by their texts
COSTLY = re.compile(
    r"times faster|\b[Tt]ime (?:of|with)|minutes|at most [\d.]+ (?:s|ms|GB)\b|within (?:a further )?\d+ s\b"
    r"|evaluations per"
)
TRUTH = re.compile(
    r"stated|wrongly|wrong (?:unit|name)|misnamed|false|contain|truth|band|uniform|chi-square|too narrow|[Rr]ealised"
    r"|standard errors of|region|unclear|reference"
)


def severity(text: str) -> Severity:
    """Return what it means that the goal with this text is missed."""
    return Severity.LOW if COSTLY.search(text) else Severity.HIGH if TRUTH.search(text) else Severity.MEDIUM


BESIDE = ("manual", "validation")  # files among the reports that are no studies


class Judged(NamedTuple):
    """A goal with its subject and the study that judges it."""

    subject: str
    study: str
    goal: Goal


def judged(folder: Path) -> list[Judged]:
    """Return every goal of every summary in a folder of reports, by subject."""
    summaries = _summaries(folder)
    goals_by_subject = []
    for subject in _subjects(summaries):
        for study in subject.studies:
            goals = summaries.get(study, {"goals": []})["goals"]
            goals_by_subject += [Judged(subject.question, study, _goal(goal)) for goal in goals]
    return goals_by_subject


def write_validation(folder: Path, output: Path) -> None:
    """Write the report from the summaries in a folder of reports."""
    summaries, goals = _summaries(folder), judged(folder)
    document = Document("Validation", "Goals, measured results and shortfalls of all studies")
    document.decision(
        f"{_count(goals, Verdict.PASS)} of {len(goals)} goals are met, and {_count(goals, Verdict.FAIL)} are missed.",
        [
            ("Verdicts", ", ".join(f"{_count(goals, verdict)} {verdict.value}" for verdict in ORDER)),
            ("Where", _where(goals)),
            *_caution(summaries),
            *_without(folder, summaries),
            ("Versions", _versions(summaries)),
            ("See also", "manual.pdf: the manual. README.md: goals by study. Study names link to their reports."),
        ],
    )
    for file in ("manual.pdf", "README.md"):
        document.link(file, file)
    if goals:
        document.figure(
            verdict_figure(goals), "Number of goals of each study by verdict, studies in the order of their subjects."
        )
    for verdict in ORDER:
        if verdict is Verdict.PASS:
            _answers(document, summaries)
        chosen = [goal for goal in goals if goal.goal.verdict is verdict]
        if chosen:
            document.section(SECTIONS[verdict])
            _goals(document, chosen, verdict)
    document.foot(
        "Generated by python -m studies.validation from the summaries that studies write with their reports; each "
        "report states its commit, seed and conditions."
    )
    document.write(output, filled=True)


def _goals(document: Document, goals: Sequence[Judged], verdict: Verdict) -> None:
    """Add the table of goals with one verdict; missed ones have their severity and begin with the most severe."""
    header, caption = ["study", "goal", "measured"], f"Goals with the verdict {verdict.value}."
    rows = [[_named(goal.study), goal.goal.text, goal.goal.reached] for goal in goals]
    if verdict is Verdict.FAIL:
        header.append("severity")
        caption += " Severity: " + "; ".join(f"{name}: {meaning}" for name, meaning in MEANING.items()) + "."
        severities = [severity(goal.goal.text) for goal in goals]
        rows = [
            [*row, one.value] for name in Severity for row, one in zip(rows, severities, strict=True) if one is name
        ]
    document.table(header, rows, caption, ["left"] * len(header))


def _named(study: str) -> LinkedText:
    """Return the name of a study, which leads to its report."""
    return LinkedText(study, f"{study}.pdf")


@styled
def verdict_figure(goals: Sequence[Judged]) -> Figure:
    """Draw the number of goals of each study by verdict."""
    studies = list(dict.fromkeys(goal.study for goal in goals))
    figure = wide_figure(0.75 + 0.16 * len(studies))
    axes = figure.subplots()
    place, left = np.arange(len(studies)), np.zeros(len(studies))
    for verdict in ORDER[::-1]:
        chosen = [goal.study for goal in goals if goal.goal.verdict is verdict]
        counts = np.array([chosen.count(study) for study in studies])
        if counts.any():
            axes.barh(place, counts, 0.7, left=left, color=COLOURS[verdict], label=verdict.value)
            left = left + counts
    axes.set(xlabel="number of goals", ylim=(len(studies) - 0.5, -0.5))
    axes.set_yticks(place, studies)
    shared_legend(figure, axes, len(ORDER))
    return figure


def _versions(summaries: Mapping[str, dict[str, Any]]) -> str:
    """Return which studies' figures are of which release, as far as they state it."""
    studies: dict[str, list[str]] = {}
    for name, summary in summaries.items():
        for release in sorted({version["release"] for version in summary.get("versions", [])} or {UNRECORDED.release}):
            studies.setdefault(release, []).append(name)
    if len(studies) == 1:
        return f"All figures are of bayesid {next(iter(studies))}."
    return "Figures are of bayesid " + "; ".join(f"{key} ({', '.join(names)})" for key, names in studies.items()) + "."


def _summaries(folder: Path) -> dict[str, dict[str, Any]]:
    return {file.stem: json.loads(file.read_text()) for file in sorted(folder.glob("*.json"))}


def _subjects(summaries: Mapping[str, Any]) -> list[Subject]:
    """Return the subjects, with one more for studies that belong to none of them."""
    placed = {name for subject in SUBJECTS for name in subject.studies}
    others = tuple(name for name in summaries if name not in placed)
    return [*SUBJECTS, *([Subject("Other studies", others)] if others else [])]


def _goal(entry: Mapping[str, str]) -> Goal:
    return Goal(entry["text"], entry["reached"], Verdict(entry["verdict"]))


def _count(goals: Sequence[Judged], verdict: Verdict) -> int:
    return sum(goal.goal.verdict is verdict for goal in goals)


def _caution(summaries: Mapping[str, dict[str, Any]]) -> Iterator[tuple[str, str]]:
    """Yield the caution on studies that were not run in full, if there are any."""
    short = [name for name, summary in summaries.items() if not summary["full"]]
    if short:
        yield "Caution", f"Not run in full: {', '.join(short)}. Read their results as examples."


def _where(goals: Sequence[Judged]) -> str:
    missed: dict[str, int] = {}
    for goal in goals:
        if goal.goal.verdict is Verdict.FAIL:
            missed[goal.study] = missed.get(goal.study, 0) + 1
    return (
        "missed by " + ", ".join(f"{name} ({number})" for name, number in missed.items()) if missed else "none missed"
    )


def _without(folder: Path, summaries: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield the names of reports whose goals are not counted, if there are any."""
    names = [file.stem for file in sorted(folder.glob("*.pdf")) if file.stem not in (*summaries, *BESIDE)]
    if names:
        reason = "reports without a summary; their goals are on their first pages and are not counted here"
        yield "No summary", f"{', '.join(names)}: {reason}"


def _answers(document: Document, summaries: Mapping[str, dict[str, Any]]) -> None:
    """Add the answer of every study, by subject."""
    rows = [
        [_named(name), f"{summaries[name]['answer']}{'' if summaries[name]['full'] else f' {NOT_FULL}'}"]
        for subject in _subjects(summaries)
        for name in subject.studies
        if name in summaries
    ]
    if rows:
        document.section("Answers of the studies")
        document.table(["study", "answer"], rows, "Answers of the studies to their questions.")


if __name__ == "__main__":
    write_validation(Path("reports"), Path("reports/validation.pdf"))
