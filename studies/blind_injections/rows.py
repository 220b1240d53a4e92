"""Rows of the tables and the reliability diagram."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.report.figures.figure_style import AFTER, TRUTH, styled, wide_figure
from bayesid.report.numbers import NO_VALUE, format_signed
from studies.blind_injections.trials import ALIKE, Trial, family

BINS = (0.0, 3.0, 5.0, 7.0, 10.0, 20.0, np.inf)  # limits of the ranges of signal-to-noise ratio in the table
STATED = (0.0, 0.5, 0.7, 0.9, 0.95, 0.99, 0.999, 1.0)  # limits of the ranges of stated probability in the table
LEAST = 1e-6  # probability below which a statement that comes true is not counted as worse


def rates(trials: Sequence[Trial]) -> list[list[str]]:
    """Return the numbers of trials by signal-to-noise ratio and outcome, beside the limits of theory."""
    rows = []
    injected = [trial for trial in trials if trial.kind == "effect"]
    for low, high in pairwise(BINS):
        within = [t for t in injected if t.signal_to_noise is not None and low <= t.signal_to_noise < high]
        if within:
            rows.append([f"{low:g} to {high:g}" if np.isfinite(high) else f"above {low:g}", *_row(within)])
    spoilt = [trial for trial in injected if trial.signal_to_noise is None]
    return [*rows, ["noise faults", *_row(spoilt)]] if spoilt else rows


def _row(trials: Sequence[Trial]) -> list[str]:
    alarmed, in_set, named = (
        str(sum(getattr(trial, key) for trial in trials)) for key in ("alarmed", "in_set", "named_rightly")
    )
    partly = sum(trial.misnamed and trial.holds for trial in trials)
    falsely = sum(trial.misnamed for trial in trials) - partly
    limits = [(t.detection, t.detection * t.naming) for t in trials if t.detection is not None and t.naming is not None]
    sums = (f"{sum(column):.1f}" for column in zip(*limits, strict=True))
    detection, naming = sums if limits else (NO_VALUE, NO_VALUE)
    return [str(len(trials)), alarmed, detection, in_set, named, naming, str(falsely), str(partly)]


def parting(trials: Iterable[Trial]) -> list[list[str]]:
    """Return the median signal-to-noise ratios from which each hidden cause of `ALIKE` parts from the others."""
    ratios: dict[str, dict[str, list[float]]] = {}
    for trial in trials:
        for name, ratio in trial.parting.items():
            own = ratios.setdefault(family(trial.hidden[0]), {})
            own.setdefault(name, []).append(np.inf if ratio is None else ratio)
    return [
        [name, *(NO_VALUE if other not in ratios[name] else _ratio(ratios[name][other]) for other in ALIKE)]
        for name in ALIKE
        if name in ratios
    ]


def _ratio(values: Sequence[float]) -> str:
    middle = float(np.median(values))
    return f"{middle:.1f}" if np.isfinite(middle) else "never"


def reliability(trials: Iterable[Trial]) -> list[list[str]]:
    """Return how often the named causes were hidden, by their stated probability, with 95 % Wilson intervals."""
    groups = reliable_pairs(trials)
    named = [pair for pairs in groups.values() for pair in pairs]
    rows = [[f"{low:g} to {high:g}", *_reliable(pairs)] for (low, high), pairs in groups.items()]
    return [*rows, ["all", *_reliable(named)]] if named else rows


def reliable_pairs(trials: Iterable[Trial]) -> dict[tuple[float, float], list[tuple[float, bool]]]:
    """Return the stated probability of the named causes and whether they held, by the range of the probability."""
    named = [(trial.probability, trial.holds) for trial in trials if trial.probability is not None]
    ranges = {
        (low, high): [pair for pair in named if low <= pair[0] < high or pair[0] == high == STATED[-1]]
        for low, high in pairwise(STATED)
    }
    return {ends: pairs for ends, pairs in ranges.items() if pairs}


def statements(trials: Iterable[Trial]) -> dict[str, list[tuple[float, bool]]]:
    """Return the stated probabilities with whether they came true: of causes, of the unknown, and of nothing.

    A cause counts where it is stated with more than one per cent, under any name that is accepted for what is hidden;
    the names of one class of equivalents count each by itself.
    """
    stated: dict[str, list[tuple[float, bool]]] = {"causes": [], "unknown": [], "nothing": []}
    for trial in trials:
        true = set(trial.hidden) | set(trial.accept)
        stated["causes"] += [(value, name in true) for name, value in trial.probabilities.items()]
        stated["unknown"].append((trial.unknown, trial.kind == "unknown"))
        stated["nothing"].append((trial.nothing, trial.kind == "adequate"))
    return stated


def scores(trials: Iterable[Trial]) -> list[list[str]]:
    """Return number, Brier score and mean logarithmic score of the stated probabilities, with standard errors."""
    rows = []
    for name, pairs in statements(trials).items():
        if pairs:
            p, true = np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])
            brier = (p - true) ** 2
            logs = np.log(np.clip(np.where(true, p, 1.0 - p), LEAST, None))
            error = np.sqrt(len(p))
            brier_text = f"{brier.mean():.4f} ± {brier.std() / error:.4f}"
            log_text = f"{logs.mean():.3f} ± {logs.std() / error:.3f}"
            rows.append([name, f"{len(p):,}", brier_text, log_text, f"{p.mean():.3f}", f"{true.mean():.3f}"])
    return rows


def _reliable(named: Sequence[tuple[float, bool]]) -> list[str]:
    right, total = sum(correct for _, correct in named), len(named)
    interval = stats.binomtest(right, total).proportion_ci(method="wilson")
    stated = float(np.mean([probability for probability, _ in named]))
    ends = f"{interval.low:.3f} to {interval.high:.3f}"
    return [str(total), f"{stated:.3f}", str(right), f"{right / total:.3f}", ends]


def confusion(trials: Iterable[Trial]) -> list[list[str]]:
    """Return each hidden case with its answers and their numbers, all strengths and seeds together."""
    return [
        [
            case_words(case),
            ", ".join(f"{answer} ({count})" if count > 1 else answer for answer, count in answers.most_common()),
        ]
        for case, answers in _answers(trials).items()
    ]


def case_words(case: str) -> str:
    """Return the name of a case, in words where nothing is hidden."""
    name, comma, kind = case.partition(", ")
    return f"nothing hidden{comma}{kind}" if name == "null" else case


def confusion_matrix(trials: Iterable[Trial]) -> tuple[list[str], list[list[str]]]:
    """Return the header and the rows of the matrix of counts: a row for each hidden case, a column for each answer."""
    said = _answers(trials)
    columns = sorted({answer for answers in said.values() for answer in answers})
    rows = [[case, *(str(said[case][answer]) for answer in columns)] for case in sorted(said)]
    return ["hidden", *columns], rows


def _answers(trials: Iterable[Trial]) -> dict[str, Counter[str]]:
    said: dict[str, Counter[str]] = {}
    for trial in trials:
        answer = " + ".join(sorted(trial.causes)) or trial.status
        if trial.status == "ambiguous":
            answer += f" or {max(len(trial.sets) - 1, 1)} more"
        said.setdefault(trial.case, Counter())[answer] += 1
    return said


def errors(trials: Sequence[Trial]) -> list[list[str]]:
    """Return number, mean, root mean square and shares of the errors of what is reported, in stated deviations."""
    right = [trial for trial in trials if trial.kind == "effect" and trial.named_rightly]
    quiet = [trial for trial in trials if trial.kind == "adequate"]
    return [
        _scattered("amplitudes of correctly named causes", [error for t in right for error in t.amplitude_errors]),
        _scattered("base, with the named causes", [error for t in right for error in t.body_errors]),
        _scattered("base, nothing hidden", [error for t in quiet for error in t.body_errors]),
    ]


def _scattered(label: str, values: Sequence[float]) -> list[str]:
    errors: Floats = np.asarray(values, dtype=float)
    if len(errors) == 0:
        return [label, "0", *[NO_VALUE] * 4]
    inside = [f"{100.0 * (np.abs(errors) < limit).mean():.0f} %" for limit in (1.0, 2.0)]
    return [label, f"{len(errors):,}", format_signed(errors.mean(), 2), f"{np.sqrt((errors**2).mean()):.2f}", *inside]


@styled
def reliability_figure(trials: Iterable[Trial]) -> Figure:
    """Draw the share of verdicts that held, with its interval, over the mean stated probability of each range."""
    figure = wide_figure(1.9)
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [0.0, 1.0], color=TRUTH, linewidth=0.8)
    for pairs in reliable_pairs(trials).values():
        stated, right = float(np.mean([pair[0] for pair in pairs])), sum(correct for _, correct in pairs)
        interval = stats.binomtest(right, len(pairs)).proportion_ci(method="wilson")
        axes.plot([stated, stated], [interval.low, interval.high], color=AFTER, linewidth=1.0)
        axes.plot(stated, right / len(pairs), "o", color=AFTER, markersize=4)
    axes.set(xlim=(0.0, 1.02), ylim=(-0.03, 1.03), xlabel="stated probability", ylabel="share correct")
    return figure
