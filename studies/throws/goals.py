"""Goals of the study: what was reached, and whether that passes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from studies.blind_injections.goals import interval
from studies.throws.smooth_widths import LARGEST

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["goal_rows", "held_in_all"]

QUICK_FIT = {"Empty": 1.9, "A": 1.0}
"""Mean errors of a quick least-squares fit by those who prepared the data [%]."""

LOW, HIGH = 0.90, 0.98
"""Share of 95 % intervals that should hold the truth."""

SECONDS = 600.0
"""Longest time of a full run [s]."""

NONE = "NOT DECIDED"


def held_in_all(result: Result, *, with_truth: bool = False) -> tuple[int, int]:
    """Return how many 95 % intervals of single throws hold the truth over all bodies, and of how many."""
    counts = [body.held(0.95, with_truth=with_truth) for body in result.extended.bodies.values()]
    return sum(held for held, _ in counts), sum(total for _, total in counts)


def goal_rows(result: Result) -> list[list[str]]:
    """Return each goal, what was reached, and PASS, FAIL or NOT DECIDED."""
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
    wheel = result.wheel
    rows.append(
        [
            "recorded wheel dropped: a wheel is named",
            "not run"
            if wheel is None
            else (", ".join(wheel.verdict.causes) or f"nothing ({wheel.verdict.status.value})"),
            NONE if wheel is None else _verdict(any(c.startswith("wheel-history") for c in wheel.verdict.causes)),
        ]
    )
    minutes = f"{result.seconds / 60.0:.1f} minutes"
    rows.append(["whole run within 10 minutes", minutes, _decided(result.studies, result.seconds <= SECONDS)])
    return rows


def _coverage(result: Result) -> list[str]:
    count, total = held_in_all(result)
    low, high = interval(count, total)
    inside = low >= LOW and high <= HIGH
    outside = high < LOW or low > HIGH
    text = f"95 % intervals of single throws hold the truth in {100 * LOW:.0f} to {100 * HIGH:.0f} % of cases"
    reached = f"{100.0 * count / total:.0f} %: {count} of {total} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
    return [text, reached, "PASS" if inside else "FAIL" if outside else NONE]


def _verdict(passed: bool | np.bool_) -> str:
    return "PASS" if passed else "FAIL"


def _decided(studies: tuple[object, ...], passed: bool) -> str:
    return _verdict(passed) if studies else NONE
