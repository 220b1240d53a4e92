"""Goals of the study: what was reached, and whether that passes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.evidence.verdict import NAMED
from bayesid.report.verdict_record import Share
from studies.common.study import Goal, Verdict
from studies.throws.body_result import BodyResult
from studies.throws.smooth_widths import LARGEST

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["goals_of", "held_in_all", "wheel_probability"]

QUICK_FIT = {"Empty": 1.9, "A": 1.0}
"""Mean errors of a quick least-squares fit by those who prepared the data [%]."""

LOW, HIGH = 0.90, 0.98
"""Share of 95 % intervals that should hold the truth."""

SECONDS = 600.0
"""Longest time of a full run [s]."""


def held_in_all(result: Result, *, with_truth: bool = False) -> tuple[int, int]:
    """Return how many 95 % intervals of single throws hold the truth over all bodies, and of how many."""
    counts = [body.held(0.95, with_truth=with_truth) for body in result.extended.bodies.values()]
    return sum(held for held, _ in counts), sum(total for _, total in counts)


def goals_of(result: Result) -> list[Goal]:
    """Return each goal, what was reached, and whether that passes; what only a full run tests is not tested before."""
    bodies, studies = result.extended.bodies.values(), result.studies
    ratios = [ratio for body in bodies for ratio in body.joint_formal / body.joint_jackknife]
    torques = [widths["smooth-torque"].ratio for widths in result.extended.widths.values()]
    named = [study.body for study in studies if study.diagnosis.verdict.causes]
    better = [study.body for study in studies if study.held_out.gain.sum() > 0.0]
    return [
        *(_quick_fit(body) for body in bodies if body.name in QUICK_FIT),
        _coverage(result),
        Goal(
            "joint answer: formal over jackknife sd between 0.67 and 1.5 for every moment",
            f"{min(ratios):.2f} to {max(ratios):.2f}",
            Verdict.of(min(ratios) >= 0.67 and max(ratios) <= 1.5),
        ),
        Goal(
            f"unexplained torque at most {LARGEST:g} prior sd on every body",
            f"{max(torques):.2f}",
            Verdict.of(max(torques) <= LARGEST),
        ),
        Goal("a cause named on every body", *_full(result, f"{len(named)} of {len(studies)}", len(named))),
        Goal(
            "extension predicts throws left out better",
            *_full(result, f"{len(better)} of {len(studies)} bodies", len(better)),
        ),
        *_reverse(result),
        Goal(
            "whole run within 10 minutes, the search for the dropped wheel aside",
            f"{result.seconds / 60.0:.1f} minutes",
            Verdict.of(result.seconds <= SECONDS if studies else None),
        ),
    ]


def _quick_fit(body: BodyResult) -> Goal:
    """Return the goal on the mean size of the differences, which is uncertain by what throws differ."""
    goal, mean, error = QUICK_FIT[body.name], body.mean_error, body.mean_error_sd
    text = f"{body.name}: single throws differ from the stated moments by at most {goal:g} % in the mean, as a quick "
    low, high = mean - 2.0 * error, mean + 2.0 * error
    verdict = Verdict.PASS if high <= goal else Verdict.FAIL if low > goal else Verdict.OPEN
    return Goal(f"{text}least-squares fit does", f"{mean:.2f} ± {error:.2f} %", verdict)


def _full(result: Result, reached: str, count: int) -> tuple[str, Verdict]:
    """Return what was reached on all diagnosed bodies, which only a full run has."""
    if not result.studies:
        return "not run", Verdict.NOT_TESTED
    return reached, Verdict.of(count == len(result.studies))


def _coverage(result: Result) -> Goal:
    count, total = held_in_all(result)
    low, high = Share(count, total).interval
    inside = low >= LOW and high <= HIGH
    outside = high < LOW or low > HIGH
    text = f"95 % intervals of single throws hold the truth in {100 * LOW:.0f} to {100 * HIGH:.0f} % of cases"
    reached = f"{100.0 * count / total:.0f} %: {count} of {total} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
    return Goal(text, reached, Verdict.of(inside) if inside or outside else Verdict.OPEN)


def _reverse(result: Result) -> list[Goal]:
    """Goals on the recorded wheel dropped: whether its probability says that it is there, and whether it is named."""
    titles = (
        f"recorded wheel dropped: a wheel about z has a probability of {NAMED:g} or more on every body",
        "recorded wheel dropped: the verdict names a wheel on every body",
    )
    if not result.wheels:
        return [Goal(title, "not run", Verdict.NOT_TESTED) for title in titles]
    found = list(result.wheels.values())
    held = [wheel_probability(item) for item in found]
    named = [any(cause.startswith("wheel-history") for cause in item.verdict.causes) for item in found]
    return [
        Goal(titles[0], f"at least {min(held):.3f}", Verdict.of(min(held) >= NAMED)),
        Goal(titles[1], f"{sum(named)} of {len(named)}", Verdict.of(all(named))),
    ]


def wheel_probability(found: Diagnosis) -> float:
    """Return the probability that a wheel of unknown course about the recorded wheel's axis is at work."""
    return found.probabilities.of_any(["wheel-history:z"])
