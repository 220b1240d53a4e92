"""Sentences about a loop: how it ended, what each step told, and what to do next."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from bayesid._io.words import counted, joined
from bayesid.design.loop_history import History
from bayesid.report.numbers import format_number, format_percent, format_quantity, format_unit
from bayesid.simulation.effects import known_effects

__all__ = ["ending_sentence", "goal_words", "loop_sentences", "next_sentence", "review_words"]


def loop_sentences(history: History) -> Iterator[str]:
    """Return what every step told, how the loop ended, and what to do next."""
    for step in history.steps:
        number, attempts = step["step"], step["plan"]["attempts"]
        if len(attempts) > 1:
            yield f"Step {number}: designed {counted(len(attempts), 'time')} until all limits held with 99 %."
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
    words = f"the recordings so far are {review['status']}"
    if review["causes"]:
        likely = (f"{name} ({format_percent(review['probabilities'].get(name, 0.0))})" for name in review["causes"])
        words += f": {joined(likely)}"
    return words


def goal_words(goal: dict[str, Any]) -> str:
    """Return the value of a goal beside what is wanted."""
    unit = "" if goal["unit"] == "1" else f" {format_unit(goal['unit'])}"
    value, wanted = (f"{format_number(goal[key], 3)}{unit}" for key in ("value", "wanted"))
    return f"{goal['goal']} {value}, wanted {wanted}: {'reached' if goal['reached'] else 'not reached'}"


def ending_sentence(history: History) -> str:
    """Return how the loop ended."""
    number = len(history.steps)
    flown = counted(number, "manoeuvre")
    if history.status == "waiting":
        return f"Fly {history.path(number, 'plan')}: positions, velocities and accelerations of the joints."
    if history.status == "no-go":
        broken = joined(history.steps[-1]["plan"]["attempts"][-1]["broken"])
        return f"No go: {broken} would not hold with 99 %, however small the manoeuvre was made."
    if history.status == "wrong-model":
        review = history.steps[-1]["diagnosis"]
        cause = joined(review["causes"]) if review["causes"] else "something that no cause of the catalogue explains"
        return f"The model is wrong: after {flown} the recordings show {cause}. The loop stops."
    if history.status == "reached":
        return f"All that is wanted is reached after {flown}."
    return f"What is wanted is not reached after {flown}; --at-most allows more."


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
            step = f"add {joined(known)} to [model] effects" if known else "declare the sensors' noise as it is"
            return (
                f"Correct the model or {step}, then start again in another folder; `bayesid diagnose` of the "
                "recordings says more."
            )
        return "`bayesid diagnose` of the recordings reconstructs the wrench that the model lacks."
    return ""
