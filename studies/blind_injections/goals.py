"""Goals of the campaign with their intervals, and the counts of right verdicts that the package ships."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from itertools import pairwise

import numpy as np
from scipy import stats

from bayesid._io.words import counted
from bayesid.diagnosis import Status
from bayesid.report.numbers import NO_VALUE, format_number, format_p_value
from bayesid.report.verdict_record import Share
from studies.blind_injections.trials import CASES, EXPLAINING, Trial
from studies.common.study import Goal, Severity, Verdict
from studies.truth.basilisk.cases import BasiliskCase

CLEAR = 7.0  # signal-to-noise ratio from which the hidden causes should be named
LEFT = 10.0  # signal-to-noise ratio left by the best known causes from which an outside effect should be called unknown
SURE = 0.9  # stated probability from which a named cause should be right as often as 93 % say

# outside torques whose reconstruction is compared with the true one, and the least median correlation
TORQUES, LIKE = ("swinging-torque", "growing-torque", "aligning-torque"), 0.9

# ends of the decades of stated probability, in each of which named causes should be wrong as often as stated
DECADES = (0.9, 0.99, 0.999, 1.0)

CHANCE = 0.05  # probability with which one decade of several may seem overconfident by chance

FEW_OUTSIDE, OF_ONE_KIND = 0.02, 0.1  # largest shares of outside effects named at `SURE`: of all, and of one kind

# half-width of a 95 % interval in standard deviations, and the goal on how often such intervals hold the truth
COVERED, COVERAGE = 1.96, (0.93, 0.97)

SCATTER = (0.95, 1.05)  # goal on the root mean square of errors in stated standard deviations

LEAST_NULLS = 1000  # trials without anything hidden below which a rate of 1 % is not decided


def share_text(count: int, total: int) -> str:
    """Return a share with its interval, to a tenth of one per cent, since one per cent is the goal of some."""
    if not total:
        return "none"
    low, high = (100.0 * end for end in Share(count, total).interval)
    digits = 1 if count == total or high < 99.95 else 2  # an interval ends at 100 % only if nothing failed
    return f"{count:,} of {total:,} ({low:.{digits}f} to {high:.{digits}f} %)"


def wrongly_explained(trial: Trial) -> bool:
    """Return whether causes are said to explain the data that are not what is hidden."""
    return trial.status in EXPLAINING and not trial.holds


def goals_of(trials: Sequence[Trial]) -> list[Goal]:
    """Return each goal, what was reached, and PASS, FAIL, or that too few trials were made.

    Trials with a cause of the catalogue, or none, and trials with an effect from outside it are judged apart.
    """
    nulls = [trial for trial in trials if trial.kind == "adequate"]
    inside = [trial for trial in trials if trial.kind != "unknown"]
    outside = [trial for trial in trials if trial.kind == "unknown"]
    clear = [t for t in inside if t.kind == "effect" and (t.signal_to_noise or 0.0) >= CLEAR]
    halves = [t for t in inside if len(t.hidden) > 1 and len(t.causes) == 1 and t.holds]
    left = [t for t in outside if (t.signal_to_noise or 0.0) >= LEFT]
    limited = [t for t in clear if t.detection is not None and t.naming is not None]
    amplitudes = [t.amplitude_errors for t in trials if t.named_rightly]
    bodies = [t.body_errors for t in trials if t.named_rightly or t.kind == "adequate"]
    flown = in_basilisk(trials)
    return [
        _rate("Nothing hidden: false alarms", 0.01, sum(t.alarmed for t in nulls), len(nulls)),
        _reliable(inside),
        _relative(f"Inside, named alone at {CLEAR:g} sigma or more, relative to the simulated limit", 0.97, limited),
        _least(f"Inside, in the reported set at {CLEAR:g} sigma", 0.97, sum(t.in_set for t in clear), len(clear)),
        _remainders(halves),
        _misnamed_outside(outside),
        _least(
            f"Outside, reported as unknown or as partly explained at {LEFT:g} sigma or more",
            0.95,
            sum(map(_said_unknown, left)),
            len(left),
        ),
        _correlation("smooth outside torques", LIKE, TORQUES, trials),
        _coverage([t.amplitude_errors for t in trials if t.named_rightly and t.amplitude_errors]),
        _scatter("amplitudes", amplitudes),
        _scatter("base parameters", bodies),
        _most("Basilisk as truth: false alarms and wrong names", 0.03, _wrong(flown), len(flown)),
    ]


def _remainders(halves: Sequence[Trial]) -> Goal:
    """Return the goal on the remainder where one of two hidden causes is named; early trials did not state any."""
    stated = [trial for trial in halves if trial.remainder is not None]
    text = "Inside, only one of two hidden causes named: the verdict states a remainder or is undecided about it"
    goal = _least(text, 0.95, sum(trial.remainder != "none" for trial in stated), len(stated))
    if stated or not halves:
        return goal
    return replace(goal, reached=f"{counted(len(halves), 'trial')}, by a version that stated no remainder")


def surely_misnamed(trial: Trial) -> bool:
    """Return whether causes that are not hidden are named with a probability of `SURE` and more."""
    return trial.status in EXPLAINING and (trial.probability or 0.0) >= SURE and not trial.holds


def _said_unknown(trial: Trial) -> bool:
    """Return whether a verdict says that something outside the catalogue acts, by itself or beside what is hidden."""
    return trial.status == "unknown" or (trial.remainder == "present" and (trial.holds or not trial.causes))


def _reliable(trials: Sequence[Trial]) -> Goal:
    """Return the goal that causes named with 0.9 and more are wrong no more often than stated, decade by decade.

    The number of wrong verdicts of a decade is a sum of independent events with the stated probabilities of error. It
    scatters a little less than the Poisson variable of the same mean that it is compared with.
    """
    text = f"Inside, named at {SURE:g} or more: false names no more frequent than stated in any range of probability"
    named = [(trial.probability, trial.holds) for trial in trials if (trial.probability or 0.0) >= SURE]
    if not named:
        return Goal(text, "none", Verdict.NOT_TESTED, Severity.HIGH)
    parts, chances = [], []
    for low, high in pairwise(DECADES):
        within = [(p, holds) for p, holds in named if p is not None and low <= p and (p < high or high == 1.0)]
        stated, wrong = sum(1.0 - p for p, _ in within), sum(not holds for _, holds in within)
        parts.append(f"{low:g} to {high:g}: {wrong} of {len(within)}, {format_number(stated, 2)} expected")
        chances.append(float(stats.poisson.sf(wrong - 1, stated)))
    verdict = Verdict.FAIL if min(chances) < CHANCE / len(chances) else Verdict.PASS
    least = f"smallest one-sided p {format_p_value(min(chances))}, FAIL below {CHANCE / len(chances):.2g}"
    return Goal(text, f"{'; '.join(parts)}; {least}", verdict, Severity.HIGH)


def _misnamed_outside(trials: Sequence[Trial]) -> Goal:
    """Return the goal that outside effects are seldom named: all by their interval, each kind by its observed share."""
    goal = _most(f"Outside: a wrong cause named at {SURE:g} or more", FEW_OUTSIDE, *_count(trials))
    text = f"{goal.text}, and at most {100.0 * OF_ONE_KIND:g} % of any kind"
    kinds: dict[str, list[Trial]] = {}
    for trial in trials:
        kinds.setdefault(trial.case, []).append(trial)
    if not kinds:
        return replace(goal, text=text)
    shares = {name: _count(alike) for name, alike in kinds.items()}
    name, (named, total) = max(shares.items(), key=lambda item: (item[1][0] / item[1][1], item[0]))
    reached = f"{goal.reached}; worst of {len(kinds)} kinds: {name}, {named} of {total}"
    return Goal(text, reached, Verdict.all_of([goal.verdict, Verdict.of(named <= OF_ONE_KIND * total)]), Severity.HIGH)


def _count(trials: Sequence[Trial]) -> tuple[int, int]:
    """Return in how many trials a wrong cause is surely named, and of how many."""
    return sum(map(surely_misnamed, trials)), len(trials)


def in_basilisk(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials whose data Basilisk made."""
    return [trial for trial in trials if isinstance(CASES.get(trial.case), BasiliskCase)]


def _wrong(trials: Sequence[Trial]) -> int:
    """Return how many trials raise a false alarm or name something that is not hidden."""
    return sum(t.misnamed or (t.kind == "adequate" and t.alarmed) for t in trials)


def _least(text: str, goal: float, count: int, total: int) -> Goal:
    verdict = Verdict.between(*Share(count, total).interval, least=goal) if total else Verdict.NOT_TESTED
    return Goal(f"{text}: at least {100.0 * goal:g} %", share_text(count, total), verdict, Severity.HIGH)


def _most(text: str, goal: float, count: int, total: int) -> Goal:
    verdict = Verdict.between(*Share(count, total).interval, most=goal) if total else Verdict.NOT_TESTED
    return Goal(f"{text}: at most {100.0 * goal:g} %", share_text(count, total), verdict, Severity.HIGH)


def _rate(text: str, goal: float, count: int, total: int) -> Goal:
    verdict = Verdict.NOT_TESTED
    if total:
        low, high = Share(count, total).interval
        verdict = Verdict.FAIL if not low <= goal <= high else Verdict.PASS if total >= LEAST_NULLS else Verdict.OPEN
    text = f"{text}: consistent with {100.0 * goal:g} % in {LEAST_NULLS} trials"
    return Goal(text, share_text(count, total), verdict, Severity.HIGH)


def _relative(text: str, goal: float, trials: Sequence[Trial]) -> Goal:
    """Return the goal on how many are named alone, relative to how many the simulated decisions name."""
    text = f"{text}: at least {goal:g}"
    limit = sum((t.detection or 0.0) * (t.naming or 0.0) for t in trials)
    if not limit:
        return Goal(text, "none", Verdict.NOT_TESTED, Severity.MEDIUM)
    named = Share(sum(t.named_rightly for t in trials), len(trials))
    low, high = (end * len(trials) / limit for end in named.interval)
    reached = f"{named.count / limit:.2f} ({low:.2f} to {high:.2f}): {named.count} where the limit is {limit:.1f}"
    return Goal(text, f"{reached} of {len(trials)}", Verdict.between(low, high, least=goal), Severity.MEDIUM)


def _scatter(text: str, trials: Sequence[Sequence[float]]) -> Goal:
    """Return the goal on the rms of errors in stated sd; errors of one trial are not taken as independent."""
    text = f"Errors of {text} in stated sd: rms {SCATTER[0]:g} to {SCATTER[1]:g}"
    squares = [np.square(errors) for errors in trials if len(errors)]
    if len(squares) < 2:
        return Goal(text, NO_VALUE, Verdict.NOT_TESTED, Severity.HIGH)
    numbers = sum(map(len, squares))
    rms = float(np.sqrt(sum(map(np.sum, squares)) / numbers))
    deviations = [np.sum(square - rms**2) for square in squares]  # of the sum of each trial
    error = float(np.linalg.norm(deviations) / (2.0 * rms * numbers))
    reached = f"{rms:.3f} ± {error:.3f} ({numbers:,} numbers of {len(squares):,} trials)"
    return Goal(text, reached, Verdict.between(rms - 2.0 * error, rms + 2.0 * error, *SCATTER), Severity.HIGH)


def _correlation(name: str, least: float, cases: Sequence[str], trials: Sequence[Trial]) -> Goal:
    """Return the goal on the median correlation of torques, with the exact 95 % interval that order statistics give."""
    text = f"Correlation of reconstructed {name} with the true ones: median at least {least:g}"
    correlations = np.sort([t.correlation for t in trials if t.case in cases and t.correlation is not None])
    if not len(correlations):
        return Goal(text, "none", Verdict.NOT_TESTED, Severity.MEDIUM)
    median, rank = float(np.median(correlations)), int(stats.binom.ppf(0.025, len(correlations), 0.5))
    if not rank:  # too few for an interval
        return Goal(text, f"{median:.2f} ({len(correlations)} trials)", Verdict.OPEN, Severity.MEDIUM)
    low, high = float(correlations[rank - 1]), float(correlations[-rank])
    reached = f"{median:.2f} ({low:.2f} to {high:.2f}, {len(correlations)} trials)"
    return Goal(text, reached, Verdict.between(low, high, least), Severity.MEDIUM)


def _coverage(trials: Sequence[Sequence[float]]) -> Goal:
    """Return the goal on 95 % intervals of amplitudes; errors of one trial are not taken as independent."""
    least, most = COVERAGE
    text = f"95 % intervals of amplitudes contain the truth: {100.0 * least:g} to {100.0 * most:g} %"
    if len(trials) < 2:
        return Goal(text, NO_VALUE, Verdict.NOT_TESTED, Severity.HIGH)
    covered = np.array([np.sum(np.abs(errors) <= COVERED) for errors in trials])
    counts = np.array([len(errors) for errors in trials])
    share = float(covered.sum() / counts.sum())
    error = float(np.sqrt(((covered - share * counts) ** 2).sum()) / counts.sum())
    reached = f"{100.0 * share:.1f} ± {100.0 * error:.1f} % ({counts.sum():,} numbers of {len(counts):,} trials)"
    return Goal(text, reached, Verdict.between(share - 2.0 * error, share + 2.0 * error, least, most), Severity.HIGH)


# when a verdict of each status counts as right
RIGHT: dict[Status, Callable[[Trial], bool]] = {
    Status.EXPLAINED: lambda trial: trial.holds,
    Status.PARTLY_EXPLAINED: lambda trial: trial.holds,
    Status.AMBIGUOUS: lambda trial: trial.in_set,
    Status.UNKNOWN: lambda trial: trial.kind == "unknown",
    Status.UNRESOLVED: lambda trial: trial.kind != "adequate",
    Status.ADEQUATE: lambda trial: trial.kind == "adequate",
}


def record_of(trials: Sequence[Trial]) -> dict[str, dict[str, dict[str, int]]]:
    """Return the counts that the package ships, apart for trials inside and outside the catalogue (`Record`)."""
    outside = [trial for trial in trials if trial.kind == "unknown"]
    inside = [trial for trial in trials if trial.kind != "unknown"]
    return {"inside": _counts(inside), "outside": _counts(outside)}


def _counts(trials: Sequence[Trial]) -> dict[str, dict[str, int]]:
    """Return the counts by status, of nulls without alarm, of clear effects with one, and of wrong explanations."""
    shares = {}
    for status, right in RIGHT.items():
        said = [trial for trial in trials if trial.status == status.value]
        shares[status.value] = Share(sum(map(right, said)), len(said))
    nulls = [trial for trial in trials if trial.kind == "adequate"]
    hidden = [trial for trial in trials if trial.kind != "adequate"]
    clear = [trial for trial in hidden if (trial.signal_to_noise or 0.0) >= CLEAR]
    shares["quiet"] = Share(sum(not trial.alarmed for trial in nulls), len(nulls))
    shares["loud"] = Share(sum(trial.alarmed for trial in clear), len(clear))
    shares["misnamed"] = Share(sum(map(wrongly_explained, hidden)), len(hidden))
    return {name: asdict(share) for name, share in shares.items()}
