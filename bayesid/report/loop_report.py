"""The report of a loop, and its sentences for the terminal: its end, its steps, and how close limits came."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from bayesid._io.words import counted, joined
from bayesid.design.loop_history import History
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_quantity, format_unit
from bayesid.simulation.effects import known_effects

__all__ = ["ending_sentence", "goal_words", "loop_report", "loop_sentences", "next_sentence", "review_words"]

TITLES = {
    "reached": "All goals are reached",
    "at-most": "Not all goals are reached",
    "no-go": "No go",
    "wrong-model": "The model is wrong",
    "waiting": "Waiting for a recording",
    "running": "Interrupted",
}
"""Title of the box on the first page, by the status of the loop."""

Steps = Sequence[dict[str, Any]]
"""Steps of a loop as in loop.json."""


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
        [
            "step:",
            "designs:",
            "tightest limit",
            "used:",
            "chi-square per sample:",
            "recordings so far",
            "goals reached:",
        ],
        step_rows(history.steps),
        "For each step: the number of designs until all limits were satisfied with 99 % probability; the limit that "
        "the planned manoeuvre approaches most closely, and the share of it that the 99 % quantile uses; the misfit of "
        "its identification.",
    )
    document.figure(
        figures.loop_progress(done),
        "Left: ratio of standard deviation to mean of each body's mass and moments after each step. Right: ratio of "
        "the 99 % quantile to the limit, for each limited quantity of the flown manoeuvre that depends on the inertial "
        "parameters.",
    )
    document.section("Conditions")
    document.items(
        [
            "The prior of each step is the posterior of the previous step, as a normal distribution of log-Cholesky "
            "coordinates; uncertain links that are not to be identified are included.",
            "A manoeuvre is flown only if every limit is satisfied with 99 % probability under the knowledge at that "
            "time.",
            "After each step, all recordings so far are diagnosed together; the loop stops if its model is excluded."
            if "diagnosis" in last
            else "The recordings were not diagnosed: a wrong model would not have been noticed.",
        ]
    )
    document.section("Bodies and limits after every step")
    document.table(
        ["body", "quantity", *(f"after step {step['step']}:" for step in done), "unit"],
        body_rows(done),
        "Identified bodies, mean ± standard deviation; the inertia is about the centre of mass, link axes.",
    )
    document.table(
        ["step:", "limit", "allowed:", "planned:", "99 % quantile:", "unit"],
        limit_rows(done),
        "Limits of the flown manoeuvres: the largest planned value at the centre of the step's prior and, if it "
        "depends on the prior, the value below which it lies with 99 % probability.",
    )
    document.write(file)


def _sentence(words: str) -> str:
    """Return words as a sentence."""
    return f"{words[0].upper()}{words[1:]}."


def loop_sentences(history: History) -> Iterator[str]:
    """Return what every step told, how the loop ended, and what to do next."""
    for step in history.steps:
        number, attempts = step["step"], step["plan"]["attempts"]
        if len(attempts) > 1:
            yield (
                f"Step {number}: designed {counted(len(attempts), 'time')} until all limits were satisfied with 99 % "
                "probability."
            )
        for name, body in step.get("identification", {}).get("bodies", {}).items():
            yield f"Step {number}: {name}: mass {format_quantity(body['mass']['mean'], body['mass']['sd'])} kg."
        yield from step.get("identification", {}).get("disagreements", ())
        if "diagnosis" in step:
            yield f"Step {number}: {review_words(step['diagnosis'])}."
        for goal in step.get("goals", ()):
            yield f"Step {number}: {goal_words(goal)}."
    yield ending_sentence(history)
    advice = next_sentence(history)
    if advice:
        yield advice


def review_words(review: dict[str, Any]) -> str:
    """Return the verdict on the recordings up to a step."""
    words = f"the verdict on the recordings so far is {review['status']}"
    if review["causes"]:
        likely = (f"{name} ({format_percent(review['probabilities'].get(name, 0.0))})" for name in review["causes"])
        words += f": {joined(likely)}"
    return words


def goal_words(goal: dict[str, Any]) -> str:
    """Return the value of a goal beside what is wanted."""
    unit = "" if goal["unit"] == "1" else f" {format_unit(goal['unit'])}"
    value, wanted = (f"{format_number(goal[key], 3)}{unit}" for key in ("value", "wanted"))
    return f"{goal['goal']} {value}, required {wanted}: {'reached' if goal['reached'] else 'not reached'}"


def ending_sentence(history: History) -> str:
    """Return how the loop ended."""
    number = len(history.steps)
    flown = counted(number, "manoeuvre")
    if history.status == "waiting":
        return f"Fly {history.path(number, 'plan')}: positions, velocities and accelerations of the joints."
    if history.status == "no-go":
        broken = joined(history.steps[-1]["plan"]["attempts"][-1]["broken"])
        return f"No go: even the smallest manoeuvre would not satisfy {broken} with 99 % probability."
    if history.status == "wrong-model":
        review = history.steps[-1]["diagnosis"]
        cause = joined(review["causes"]) if review["causes"] else "something that no cause of the catalogue explains"
        if review["causes"] and review.get("remainder") == "present":
            cause += " and an unnamed cause"
        return f"The model is wrong: after {flown}, the recordings indicate {cause}. The loop stops."
    if history.status == "reached":
        return f"All goals are reached after {flown}."
    return f"Not all goals are reached after {flown}; --at-most allows more."


def next_sentence(history: History) -> str:
    """Return what to do next, empty where nothing is to be done."""
    number = len(history.steps)
    if history.status == "waiting":
        recording = history.path(number, "recording")
        return f"Write the readings of the sensors and encoders to {recording}, then run this command again."
    if history.status == "wrong-model":
        causes = history.steps[-1]["diagnosis"]["causes"]
        known = [name for name in causes if name.partition(":")[0] in known_effects()]
        if causes:
            step = f"add {joined(known)} to [model] effects" if known else "declare the actual noise of the sensors"
            return (
                f"Correct the model or {step}, then start again in another folder; `bayesid diagnose` on the "
                "recordings gives details."
            )
        return "Run `bayesid diagnose` on the recordings to reconstruct the wrench that is missing from the model."
    return ""


def step_rows(steps: Steps) -> list[list[str]]:
    """Return a row for every step: designs, tightest limit, misfit, verdict, goals."""
    rows = []
    for step in steps:
        used = {name: share for name, share in _used(step["plan"]).items() if share is not None}
        tightest = max(used, key=lambda name: used[name]) if used else ""
        fit, goals = step.get("identification"), step.get("goals", [])
        rows.append(
            [
                str(step["step"]),
                str(len(step["plan"]["attempts"])),
                tightest.replace("_", " "),
                format_percent(used[tightest], 3) if used else "",
                "" if fit is None else format_fixed(fit["chi2"] / fit["samples"], 3),
                _verdict(step),
                f"{sum(goal['reached'] for goal in goals)} of {len(goals)}" if goals else "",
            ]
        )
    return rows


def body_rows(steps: Steps) -> list[list[str]]:
    """Return a row for every quantity of every body, with its mean and standard deviation after each step."""
    bodies = steps[0]["identification"]["bodies"]
    return [
        [
            body,
            key,
            *(
                format_quantity(item["mean"], item["sd"])
                for item in (step["identification"]["bodies"][body][key] for step in steps)
            ),
            format_unit(first["unit"]),
        ]
        for body, quantities in bodies.items()
        for key, first in quantities.items()
    ]


def limit_rows(steps: Steps) -> list[list[str]]:
    """Return a row for every limit of every step."""
    rows = []
    for step in steps:
        risks = step["plan"]["attempts"][-1]["limits"]
        for name, item in step["plan"].get("limits", {}).items():
            risk = risks.get(name)
            rows.append(
                [
                    str(step["step"]),
                    name.replace("_", " "),
                    format_number(item["limit"]),
                    format_number(item["largest"]),
                    "" if risk is None else format_number(risk["quantile_99"]),
                    "" if item["unit"] == "1" else format_unit(item["unit"]),
                ]
            )
    return rows


def _used(plan: dict[str, Any]) -> dict[str, float | None]:
    """Return the share of each limit that a plan uses, by its 99 % quantile where that is known."""
    risks = plan["attempts"][-1]["limits"]
    shares: dict[str, float | None] = {}
    for name, item in plan.get("limits", {}).items():
        value = risks[name]["quantile_99"] if name in risks else item["largest"]
        shares[name] = value / item["limit"] if item["limit"] else None
    return shares


def _verdict(step: dict[str, Any]) -> str:
    review = step.get("diagnosis")
    if review is None:
        return "not diagnosed"
    return review["status"] + (f": {', '.join(review['causes'])}" if review["causes"] else "")
