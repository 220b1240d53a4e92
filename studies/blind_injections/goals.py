"""Goals of the campaign: what was reached, with its interval, and whether that decides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid.report.verdict_record import Share
from studies.blind_injections.trials import Trial
from studies.common.goals import Goal, Verdict

__all__ = ["CLEAR", "LEFT", "goals_of", "share_text"]

CLEAR = 7.0
"""Signal-to-noise ratio from which the hidden causes should be named."""

LEFT = 10.0
"""Signal-to-noise ratio left by the best known causes from which an outside effect should be called unknown."""

SURE = 0.9
"""Stated probability from which a named cause should be right as often as 93 % say."""

LEAST_NULLS = 1000
"""Trials without anything hidden below which a rate of 1 % is not decided."""


def share_text(count: int, total: int) -> str:
    """Return a share with its interval."""
    return str(Share(count, total)) if total else "none"


def goals_of(trials: Sequence[Trial]) -> list[Goal]:
    """Return each goal, what was reached, and PASS, FAIL, or that too few trials were made."""
    nulls = [trial for trial in trials if trial.kind == "adequate"]
    clear = [t for t in trials if t.kind == "effect" and t.signal_to_noise is not None and t.signal_to_noise >= CLEAR]
    left = [t for t in trials if t.kind == "unknown" and t.signal_to_noise is not None and t.signal_to_noise >= LEFT]
    sure = [t for t in trials if t.probability is not None and t.probability >= SURE]
    limited = [t for t in clear if t.detection is not None and t.naming is not None]
    amplitudes = np.array([e for t in trials if t.named_rightly for e in t.amplitude_errors])
    bodies = np.array([e for t in trials if t.named_rightly or t.kind == "adequate" for e in t.body_errors])
    return [
        _rate("false alarms where nothing is hidden", 0.01, sum(t.alarmed for t in nulls), len(nulls)),
        _least("named causes right where 0.9 and more is stated", 0.93, sum(t.holds for t in sure), len(sure)),
        _relative(f"named alone at {CLEAR:g} sigma and more, relative to the simulated limit", 0.97, limited),
        _least(f"hidden causes in the reported set at {CLEAR:g} sigma", 0.97, sum(t.in_set for t in clear), len(clear)),
        _least(
            f"outside effects with {LEFT:g} sigma left called unknown",
            0.95,
            sum(t.status == "unknown" for t in left),
            len(left),
        ),
        _most(f"outside effects with {LEFT:g} sigma left misnamed", 0.03, sum(t.misnamed for t in left), len(left)),
        _scatter("amplitudes", amplitudes),
        _scatter("base parameters", bodies),
    ]


def _verdict(low: float, high: float, goal: float) -> Verdict:
    """Return the verdict on a share that is to be at least a goal."""
    return Verdict.PASS if low >= goal else Verdict.FAIL if high < goal else Verdict.OPEN


def _least(text: str, goal: float, count: int, total: int) -> Goal:
    goal_text = f"{text}: at least {100.0 * goal:g} %"
    return Goal(
        goal_text,
        share_text(count, total),
        _verdict(*Share(count, total).interval, goal) if total else Verdict.NOT_TESTED,
    )


def _relative(text: str, goal: float, trials: Sequence[Trial]) -> Goal:
    """Return the goal on how many are named alone, relative to how many the simulated decisions name."""
    goal_text = f"{text}: at least {goal:g}"
    limit = sum((t.detection or 0.0) * (t.naming or 0.0) for t in trials)
    if not limit:
        return Goal(goal_text, "none", Verdict.NOT_TESTED)
    named = Share(sum(t.named_rightly for t in trials), len(trials))
    low, high = (end * len(trials) / limit for end in named.interval)
    reached = f"{named.count / limit:.2f} ({low:.2f} to {high:.2f}): {named.count} where the limit is {limit:.1f}"
    return Goal(goal_text, f"{reached} of {len(trials)}", _verdict(low, high, goal))


def _most(text: str, goal: float, count: int, total: int) -> Goal:
    goal_text = f"{text}: at most {100.0 * goal:g} %"
    if not total:
        return Goal(goal_text, share_text(count, total), Verdict.NOT_TESTED)
    low, high = Share(count, total).interval
    return Goal(goal_text, share_text(count, total), _verdict(1.0 - high, 1.0 - low, 1.0 - goal))


def _rate(text: str, goal: float, count: int, total: int) -> Goal:
    goal_text = f"{text}: consistent with {100.0 * goal:g} % in {LEAST_NULLS} trials"
    if not total:
        return Goal(goal_text, share_text(count, total), Verdict.NOT_TESTED)
    low, high = Share(count, total).interval
    verdict = Verdict.FAIL if not low <= goal <= high else Verdict.PASS if total >= LEAST_NULLS else Verdict.OPEN
    return Goal(goal_text, share_text(count, total), verdict)


def _scatter(text: str, errors: np.ndarray) -> Goal:
    """Return the goal on errors in stated standard deviations: their root mean square, within two standard errors."""
    goal_text = f"errors of {text} in stated sd: rms 0.9 to 1.1"
    if len(errors) < 2:
        return Goal(goal_text, "-", Verdict.NOT_TESTED)
    rms = float(np.sqrt((errors**2).mean()))
    error = float((errors**2).std() / (2.0 * rms * np.sqrt(len(errors))))
    low, high = rms - 2.0 * error, rms + 2.0 * error
    verdict = Verdict.PASS if low >= 0.9 and high <= 1.1 else Verdict.FAIL if high < 0.9 or low > 1.1 else Verdict.OPEN
    return Goal(goal_text, f"{rms:.2f} ± {error:.2f} ({len(errors)} numbers)", verdict)
