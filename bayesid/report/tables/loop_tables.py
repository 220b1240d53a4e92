"""Tables of a loop's steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bayesid.report.numbers import format_fixed, format_number, format_percent, format_quantity, format_unit

__all__ = ["body_rows", "limit_rows", "step_rows"]

Steps = Sequence[dict[str, Any]]
"""Steps of a loop as in loop.json."""


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
