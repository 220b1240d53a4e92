"""Goals of the study: what was reached, and whether that passes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.probable_verdict import NAMED
from studies.blind_injections.goals import interval
from studies.throws.smooth_widths import LARGEST

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["NONE", "goal_rows", "held_in_all", "wheel_probability"]

QUICK_FIT = {"Empty": 1.9, "A": 1.0}
"""Mean errors of a quick least-squares fit by those who prepared the data [%]."""

LOW, HIGH = 0.90, 0.98
"""Share of 95 % intervals that should hold the truth."""

SECONDS = 600.0
"""Longest time of a full run [s]."""

NONE = "NOT TESTED"


def held_in_all(result: Result, *, with_truth: bool = False) -> tuple[int, int]:
    """Return how many 95 % intervals of single throws hold the truth over all bodies, and of how many."""
    counts = [body.held(0.95, with_truth=with_truth) for body in result.extended.bodies.values()]
    return sum(held for held, _ in counts), sum(total for _, total in counts)


def goal_rows(result: Result) -> list[list[str]]:
    """Return each goal, what was reached, and PASS, FAIL or NOT TESTED."""
    rows = []
    for body in result.extended.bodies.values():
        if body.name in QUICK_FIT:
            goal = QUICK_FIT[body.name]
            text = f"{body.name}: mean error of single throws at most {goal:g} %, that of a quick least-squares fit"
            rows.append([text, f"{body.mean_error:.2f} %", _verdict(body.mean_error <= goal)])
    rows.append(_coverage(result))
    ratios = [ratio for body in result.extended.bodies.values() for ratio in body.joint_formal / body.joint_jackknife]
    rows.append(
        [
            "joint answer: formal over jackknife sd between 0.67 and 1.5 for every moment",
            f"{min(ratios):.2f} to {max(ratios):.2f}",
            _verdict(min(ratios) >= 0.67 and max(ratios) <= 1.5),
        ]
    )
    torques = [widths["smooth-torque"].ratio for widths in result.extended.widths.values()]
    rows.append(
        [
            f"unexplained torque at most {LARGEST:g} prior sd on every body",
            f"{max(torques):.2f}",
            _verdict(max(torques) <= LARGEST),
        ]
    )
    named = [study.body for study in result.studies if study.diagnosis.verdict.causes]
    known = f"{len(named)} of {len(result.studies)}" if result.studies else "not run"
    rows.append(["a cause named on every body", known, _decided(result.studies, len(named) == len(result.studies))])
    better = [study.body for study in result.studies if study.held_out.gain.sum() > 0.0]
    gain = f"{len(better)} of {len(result.studies)} bodies" if result.studies else "not run"
    rows.append(
        [
            "extension predicts throws left out better",
            gain,
            _decided(result.studies, len(better) == len(result.studies)),
        ]
    )
    rows += _reverse(result)
    minutes = f"{result.seconds / 60.0:.1f} minutes"
    rows.append(
        [
            "whole run without the reverse within 10 minutes",
            minutes,
            _decided(result.studies, result.seconds <= SECONDS),
        ]
    )
    return rows


def _coverage(result: Result) -> list[str]:
    count, total = held_in_all(result)
    low, high = interval(count, total)
    inside = low >= LOW and high <= HIGH
    outside = high < LOW or low > HIGH
    text = f"95 % intervals of single throws hold the truth in {100 * LOW:.0f} to {100 * HIGH:.0f} % of cases"
    reached = f"{100.0 * count / total:.0f} %: {count} of {total} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
    return [text, reached, "PASS" if inside else "FAIL" if outside else "NOT DECIDED"]


def _reverse(result: Result) -> list[list[str]]:
    """Rows on the recorded wheel dropped: whether its probability says that it is there, and whether it is named."""
    titles = (
        f"recorded wheel dropped: a wheel about z has a probability of {NAMED:g} or more on every body",
        "recorded wheel dropped: the verdict names a wheel on every body",
    )
    if not result.wheels:
        return [[title, "not run", NONE] for title in titles]
    found = list(result.wheels.values())
    held = [wheel_probability(item) for item in found]
    named = [any(cause.startswith("wheel-history") for cause in item.verdict.causes) for item in found]
    return [
        [titles[0], f"at least {min(held):.3f}", _verdict(min(held) >= NAMED)],
        [titles[1], f"{sum(named)} of {len(named)}", _verdict(all(named))],
    ]


def wheel_probability(found: Diagnosis) -> float:
    """Return the probability that a wheel of unknown course about the recorded wheel's axis is at work."""
    return found.probabilities.of_any(["wheel-history:z"])


def _verdict(passed: bool | np.bool_) -> str:
    return "PASS" if passed else "FAIL"


def _decided(studies: tuple[object, ...], passed: bool) -> str:
    return _verdict(passed) if studies else NONE
