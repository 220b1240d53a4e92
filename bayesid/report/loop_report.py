"""The report of a loop: how it ended, what every step told, and how close each limit came."""

from __future__ import annotations

from pathlib import Path

from bayesid.design.loop_history import History
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.sentences.loop_sentences import ending_sentence, goal_words, next_sentence, review_words
from bayesid.report.tables.loop_tables import body_rows, limit_rows, step_rows

__all__ = ["loop_report"]

TITLES = {
    "reached": "All that is wanted is reached",
    "at-most": "Not reached",
    "no-go": "No go",
    "wrong-model": "The model is wrong",
    "waiting": "Waiting for a recording",
    "running": "Interrupted",
}
"""Title of the box on the first page, by the status of the loop."""


def loop_report(history: History, title: str, file: Path, *, origin: str = "") -> None:
    """Write the report of a loop as PDF, whole or not at all.

    Parameters
    ----------
    history : History
        Loop with at least one step that was identified.
    title : str
        Title of the study.
    file : Path
    origin : str
        Files with their hashes, version, seed and command, for the foot of the first page.
    """
    done = [step for step in history.steps if "identification" in step]
    last = done[-1]
    document = Document(title, "Plan, fly, identify, plan again")
    if origin:
        document.foot(origin)
    entries = [("Ending", ending_sentence(history))]
    entries += [("Goal", _sentence(goal_words(goal))) for goal in last.get("goals", ())]
    if "diagnosis" in last:
        entries.append(("Model", _sentence(review_words(last["diagnosis"]))))
    if advice := next_sentence(history):
        entries.append(("Next", advice))
    document.decision(TITLES[history.status], entries)
    document.section("Steps")
    document.table(
        ["step", "designs", "tightest limit", "used", "chi-square per sample", "recordings so far", "goals reached"],
        step_rows(history.steps),
        "Every step: how many designs it took until all limits held with 99 %; the limit that the planned manoeuvre "
        "comes closest to, and the share of it that the 99 % quantile uses; the misfit of its identification.",
        ["right", "right", "left", "right", "right", "left", "right"],
    )
    document.figure(
        figures.loop_progress(done),
        "Left: standard deviation over mean of each body's mass and moments after each step. Right: 99 % quantile of "
        "each limited quantity that depends on the inertial parameters, over its limit, of the manoeuvre that was "
        "flown.",
    )
    document.section("Conditions")
    document.items(
        [
            "Each step's prior is the posterior of the step before, as a normal distribution of log-Cholesky "
            "coordinates; uncertain links that are not to be identified are carried along.",
            "A manoeuvre is flown only if every limit holds with 99 % under what is known then.",
            "All recordings so far are diagnosed together after each step; a loop whose model is excluded stops."
            if "diagnosis" in last
            else "The recordings were not diagnosed: a wrong model would not have been noticed.",
        ]
    )
    document.section("Bodies and limits after every step")
    document.table(
        ["body", "quantity", *(f"after step {step['step']}" for step in done), "unit"],
        body_rows(done),
        "Identified bodies, mean ± standard deviation; the inertia is about the centre of mass, link axes.",
        ["left", "left", *["right"] * len(done), "left"],
    )
    document.table(
        ["step", "limit", "allowed", "planned", "99 % quantile", "unit"],
        limit_rows(done),
        "Limits of the manoeuvres that were flown: the largest planned value at the centre of what was known, and "
        "where it depends on that, the value it stays below with 99 %.",
        ["right", "left", "right", "right", "right", "left"],
    )
    document.write(file)


def _sentence(words: str) -> str:
    """Return words as a sentence."""
    return f"{words[0].upper()}{words[1:]}."
