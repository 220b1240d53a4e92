"""Report of the blind injections."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from bayesid._io.files import write_json
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from studies.blind_injections.goals import goals_of, share_text
from studies.blind_injections.record import record_of
from studies.blind_injections.trials import Trial, plan, read, run
from studies.common.command import WORKERS, Command
from studies.common.goals import add_goals

__all__ = ["confusion", "main", "rates", "reliability", "scores", "statements", "write_report"]

BINS = (0.0, 3.0, 5.0, 7.0, 10.0, 20.0, np.inf)
"""Limits of the ranges of signal-to-noise ratio in the table."""

STATED = (0.0, 0.5, 0.7, 0.9, 0.95, 0.99, 0.999, 1.0)
"""Limits of the ranges of stated probability in the table."""

TICKS = (3, 5, 7, 10, 20, 50)
"""Ticks of the signal-to-noise ratio in the figure."""

LEAST = 1e-6
"""Probability below which a statement that comes true is not counted as worse."""

COMMAND = Command(
    "blind_injections",
    "How often a hidden cause is named rightly or wrongly, and how often nothing raises alarm.",
    full="hundreds of injections and a thousand nulls (many hours)",
    extra={
        "--trials": {"type": Path, "default": Path("out/blind_injections.jsonl"), "help": "kept between runs"},
        "--made": {"action": "store_true", "help": "report the trials made so far, make no more"},
        "--record": {"type": Path, "help": "file for the counts that the package ships"},
        **WORKERS,
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the campaign and write its report."""
    options = COMMAND.parse(arguments)

    def show(text: str) -> None:
        print(text, file=sys.stderr)

    plans = plan(options.full)
    trials = read(options.trials) if options.made else run(plans, options.trials, show, options.workers)
    write_report(trials, options.output, planned=len(plans))
    if options.record is not None:
        write_json(options.record, record_of(trials))
    print(f"Wrote {options.output}.")


def rates(trials: Sequence[Trial]) -> list[list[str]]:
    """Return the numbers of trials by signal-to-noise ratio and outcome, beside the limits of theory."""
    rows = []
    injected = [trial for trial in trials if trial.kind == "effect"]
    for low, high in pairwise(BINS):
        within = [t for t in injected if t.signal_to_noise is not None and low <= t.signal_to_noise < high]
        if within:
            rows.append([f"{low:g} to {high:g}" if np.isfinite(high) else f"above {low:g}", *_row(within)])
    spoilt = [trial for trial in injected if trial.signal_to_noise is None]
    return [*rows, ["faults of the noise", *_row(spoilt)]] if spoilt else rows


def _row(trials: Sequence[Trial]) -> list[str]:
    count = {
        key: str(sum(getattr(trial, key) for trial in trials))
        for key in ("alarmed", "in_set", "named_rightly", "misnamed")
    }
    limits = [(t.detection, t.detection * t.naming) for t in trials if t.detection is not None and t.naming is not None]
    detection, naming = (f"{sum(column):.1f}" for column in zip(*limits, strict=True)) if limits else ("-", "-")
    return [
        str(len(trials)),
        count["alarmed"],
        detection,
        count["in_set"],
        count["named_rightly"],
        naming,
        count["misnamed"],
    ]


def reliability(trials: Iterable[Trial]) -> list[list[str]]:
    """Return how often the named causes were hidden, by their stated probability, with 95 % Wilson intervals."""
    named = [(trial.probability, trial.holds) for trial in trials if trial.probability is not None]
    rows = []
    for low, high in pairwise(STATED):
        within = [pair for pair in named if low <= pair[0] < high or pair[0] == high == STATED[-1]]
        if within:
            rows.append([f"{low:g} to {high:g}", *_reliable(within)])
    return [*rows, ["all", *_reliable(named)]] if named else rows


def statements(trials: Iterable[Trial]) -> dict[str, list[tuple[float, bool]]]:
    """Return the stated probabilities with whether they came true: of causes, of the unknown, and of nothing.

    A cause counts where it is stated with more than one per cent, under any name that is accepted for what is hidden;
    the names of one class of equivalents count each by itself.
    """
    found: dict[str, list[tuple[float, bool]]] = {"causes": [], "unknown": [], "nothing": []}
    for trial in trials:
        true = set(trial.hidden) | set(trial.accept)
        found["causes"] += [(value, name in true) for name, value in trial.probabilities.items()]
        found["unknown"].append((trial.unknown, trial.kind == "unknown"))
        found["nothing"].append((trial.nothing, trial.kind == "adequate"))
    return found


def scores(trials: Iterable[Trial]) -> list[list[str]]:
    """Return number, Brier score and mean logarithmic score of the stated probabilities, with standard errors."""
    rows = []
    for name, pairs in statements(trials).items():
        if pairs:
            p, true = np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])
            brier = (p - true) ** 2
            logs = np.log(np.clip(np.where(true, p, 1.0 - p), LEAST, None))
            error = np.sqrt(len(p))
            rows.append(
                [
                    name,
                    str(len(p)),
                    f"{brier.mean():.4f} ± {brier.std() / error:.4f}",
                    f"{logs.mean():.3f} ± {logs.std() / error:.3f}",
                    f"{p.mean():.3f}",
                    f"{true.mean():.3f}",
                ]
            )
    return rows


def _reliable(named: Sequence[tuple[float, bool]]) -> list[str]:
    right, total = sum(held for _, held in named), len(named)
    interval = stats.binomtest(right, total).proportion_ci(method="wilson")
    stated = float(np.mean([probability for probability, _ in named]))
    return [
        str(total),
        f"{stated:.3f}",
        str(right),
        f"{right / total:.3f}",
        f"{interval.low:.3f} to {interval.high:.3f}",
    ]


def confusion(trials: Iterable[Trial]) -> list[list[str]]:
    """Return each hidden case with its answers and their numbers, all strengths and seeds together."""
    said: dict[str, Counter[str]] = {}
    for trial in trials:
        answer = " + ".join(sorted(trial.causes)) or trial.status
        if trial.status == "ambiguous":
            answer += f" or {max(len(trial.sets) - 1, 1)} more"
        said.setdefault(trial.case, Counter())[answer] += 1
    return [
        [case, ", ".join(f"{answer} ({count})" if count > 1 else answer for answer, count in answers.most_common())]
        for case, answers in said.items()
    ]


def write_report(trials: Sequence[Trial], file: Path, planned: int | None = None) -> None:
    """Write the report as PDF; ``planned`` is the number of trials of the whole campaign."""
    document = Document("Blind injections", "What the diagnosis says of hidden causes")
    nulls = [trial for trial in trials if trial.kind == "adequate"]
    outside = [trial for trial in trials if trial.kind == "unknown"]
    injected = [trial for trial in trials if trial.kind == "effect"]
    document.section("Summary")
    document.paragraph(
        f"{len(trials)} trials, each on files written by MuJoCo (bodies, springs, fields and sensor faults; no code "
        f"shared with the package) and diagnosed from the files alone: {len(injected)} with causes of the catalogue "
        f"hidden, {len(outside)} with something outside it, {len(nulls)} with nothing. Three robots, three recordings "
        f"of 120 to 170 s each. Intervals are 95 % Clopper-Pearson."
    )
    if planned is not None and planned > len(trials):
        document.paragraph(
            f"Incomplete: {planned} trials are planned, and these were made first, in random order. Read the rates "
            "with their intervals."
        )
    add_goals(
        document,
        goals_of(trials),
        "Goals, with 95 % intervals. PASS where the interval lies within the goal, FAIL where it lies outside; NOT "
        "DECIDED where it holds both, because too few trials were made.",
    )
    document.items(_findings(trials, outside))
    seconds = np.array([trial.seconds["total"] for trial in trials])
    if len(seconds):
        document.paragraph(
            "Valid for a base body with an arm of three to five joints, links exact or known to 2 %, white noise of "
            "1e-5 rad/s and 1e-5 m/s² at 0.5 s, encoders of 1e-6 rad; seeds "
            f"{min(t.seed for t in trials)} to {max(t.seed for t in trials)}, of which none was used in development. "
            f"bayesid {version('bayesid')}. Time per trial, flight and diagnosis on one loaded core: median "
            f"{np.median(seconds):.0f} s, longest {seconds.max():.0f} s."
        )
    document.section("By signal-to-noise ratio")
    document.table(
        ["signal-to-noise", "trials", "alarm", "limit", "in the set", "named alone", "limit", "misnamed"],
        rates(trials),
        "Trials by the signal-to-noise ratio of what was hidden: the root of its noncentrality after the model's "
        "unknowns have taken their share, from data with the same noise and a tenth of the strength. The limits are "
        "the numbers expected of a test that knows which effect to look for (family-wise 1 %), and of a comparison of "
        "likelihoods with the one other effect that comes closest. In the set: the hidden causes are among the sets "
        "reported. Misnamed: something was named and the hidden causes are in no set.",
    )
    document.figure(_figure(injected), "Injected causes by signal-to-noise ratio: what was said.")
    document.section("Stated probabilities")
    stated = reliability(trials)
    if stated:
        document.table(
            ["stated probability", "trials", "mean stated", "right", "share right", "95 % interval"],
            stated,
            "Trials whose verdict names causes, nothing and outside causes hidden included, by the probability stated "
            "for the named causes together, whatever accompanies them. Right: every named cause is hidden. Intervals "
            "are Wilson's. The trials hide causes as planned and not as often, nor as large, as the prior of the "
            "diagnosis says, so that both columns need not agree exactly.",
            ["left", *["right"] * 5],
        )
    else:
        document.paragraph("No trial has named a cause.")
    if trials:
        document.table(
            ["stated of", "statements", "Brier score", "log score", "mean stated", "share true"],
            scores(trials),
            "Scores of all stated probabilities, those of causes from one per cent up; zero would be perfect in both. "
            f"A statement counts as no worse than {LEAST:g} in the log score.",
            ["left", *["right"] * 5],
        )
    document.section("Amplitudes and bodies")
    errors = np.array([error for trial in injected if trial.named_rightly for error in trial.amplitude_errors])
    bodies = np.array([t.body_errors for t in injected if t.named_rightly and t.body_errors]).reshape(-1, 10)
    quiet = np.array([trial.body_errors for trial in nulls if trial.body_errors]).reshape(-1, 10)
    document.table(
        ["errors in stated sd", "numbers", "mean", "rms", "within 1 sd", "within 2 sd"],
        [
            _errors("amplitudes of causes named rightly", errors),
            _errors("base, after the extension", bodies.ravel()),
            _errors("base, nothing hidden", quiet.ravel()),
        ],
        "Errors of what is reported in the standard deviations stated, which are the Cramer-Rao bound of the "
        "linearised problem; ideal are mean 0, rms 1, 68 % and 95 %. Amplitudes: wheel, biases, drifts, scales, "
        "misalignments, latencies, encoder offsets. The ten parameters of a base are correlated.",
    )
    document.section("Outside the catalogue")
    document.table(
        ["hidden", "strength", "left, in sigma", "said", "axes said", "true axes", "correlation"],
        [
            [
                trial.case,
                f"{trial.strength:g}",
                _number(trial.signal_to_noise),
                " + ".join(trial.causes) or trial.status,
                trial.frame or "-",
                trial.true_frame or "-",
                _number(trial.correlation, 2),
            ]
            for trial in outside
        ],
        "What was said of causes that the catalogue does not have. Left: signal-to-noise ratio after the most probable "
        "set of known causes has taken its share. Correlation: of the torque reconstructed with the true one. "
        "'Orbit' torques are fixed in the orbit axes of each recording's start, from which orbit axes turn by ten "
        "degrees.",
    )
    document.section("Confusion")
    document.table(
        ["hidden", "said"],
        confusion(trials),
        "What was said of each thing hidden, all strengths and seeds together, with the number of trials.",
    )
    document.section("Every trial")
    document.table(
        ["hidden", "seed", "strength", "said", "named", "probability", "others", "signal-to-noise", "time [s]"],
        [
            [
                trial.case,
                str(trial.seed),
                f"{trial.strength:g}",
                trial.status,
                " + ".join(trial.causes) or "-",
                _number(trial.probability, 3),
                str(max(len(trial.sets) - 1, 0)),
                _number(trial.signal_to_noise),
                _number(trial.seconds["total"]),
            ]
            for trial in trials
        ],
        "Every trial; the seed and the strength repeat it. The probability is that of the named causes together. "
        "Others: number of other explanations that the verdict gives, and of other names of the same causes.",
    )
    document.write(file)


def _findings(trials: Sequence[Trial], outside: Sequence[Trial]) -> list[str]:
    wrong = [trial for trial in trials if trial.misnamed or (trial.kind == "adequate" and trial.alarmed)]
    sentences = [
        "Wrong: "
        + "; ".join(f"{t.case} (seed {t.seed}) was called {' + '.join(t.causes) or t.status}" for t in wrong)
        + "."
        if wrong
        else "No trial was misnamed, and none without anything hidden raised an alarm."
    ]
    framed = [t for t in outside if t.true_frame is not None and t.status == "unknown"]
    if framed:
        sentences.append(
            f"Axes of an outside torque: {share_text(sum(t.frame == t.true_frame for t in framed), len(framed))} named "
            f"rightly, {sum(t.frame not in (None, t.true_frame) for t in framed)} wrongly, the others not at all; "
            f"median correlation with the true torque {np.median([t.correlation or 0.0 for t in framed]):.2f} (goal "
            f"0.9)."
        )
    return sentences


def _errors(label: str, errors: np.ndarray) -> list[str]:
    if len(errors) == 0:
        return [label, "0", "-", "-", "-", "-"]
    inside = [f"{100.0 * (np.abs(errors) < limit).mean():.0f} %" for limit in (1.0, 2.0)]
    return [label, str(len(errors)), f"{errors.mean():+.2f}", f"{np.sqrt((errors**2).mean()):.2f}", *inside]


def _number(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


@styled
def _figure(injected: Sequence[Trial]) -> Figure:
    figure = wide_figure(2.6)
    axes = figure.subplots()
    kinds = ("named alone", "in the set", "alarm, nothing named", "no alarm", "misnamed")
    for row, label in enumerate(kinds):
        ratios = [t.signal_to_noise for t in injected if t.signal_to_noise is not None and _outcome(t) == label]
        axes.scatter(
            np.maximum(ratios, 0.5), np.full(len(ratios), row), s=14, alpha=0.6, color=COLOURS[row % len(COLOURS)]
        )
    axes.set_yticks(range(len(kinds)), kinds)
    axes.set_ylim(-0.6, len(kinds) - 0.4)
    axes.set_xscale("log")
    axes.set_xticks(TICKS, [str(tick) for tick in TICKS])
    axes.minorticks_off()
    axes.set_xlabel("signal-to-noise ratio of what is hidden")
    return figure


def _outcome(trial: Trial) -> str:
    if trial.misnamed:
        return "misnamed"
    if trial.named_rightly:
        return "named alone"
    if trial.in_set:
        return "in the set"
    return "alarm, nothing named" if trial.alarmed else "no alarm"
