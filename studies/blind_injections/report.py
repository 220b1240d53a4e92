"""Report of the blind injections."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from bayesid.report import Document
from bayesid.report.figures.style import COLOURS, styled, wide_figure
from studies.blind_injections.trials import Trial, plan, run

__all__ = ["main", "rates", "write_report"]

BINS = (0.0, 3.0, 5.0, 7.0, 10.0, 20.0, np.inf)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the campaign and write its report."""
    parser = argparse.ArgumentParser(prog="python -m studies.blind_injections", description=__doc__)
    parser.add_argument("--full", action="store_true", help="hundreds of injections and a thousand nulls (many hours)")
    parser.add_argument("--output", type=Path, default=Path("reports/blind_injections.pdf"))
    parser.add_argument("--trials", type=Path, default=Path("out/blind_injections.jsonl"), help="kept between runs")
    given = parser.parse_args(arguments)

    def show(number: int, total: int, trial: Trial) -> None:
        print(f"{number}/{total} {trial.case}: {trial.status} {list(trial.causes)}", file=sys.stderr)

    trials = run(plan(given.full), given.trials, show)
    write_report(trials, given.output)
    print(f"Wrote {given.output}.")


def rates(trials: Sequence[Trial]) -> list[list[str]]:
    """Shares of the injected effects found, by signal-to-noise ratio."""
    rows = []
    injected = [trial for trial in trials if trial.kind == "effect"]
    for low, high in pairwise(BINS):
        own = [trial for trial in injected if low <= trial.signal_to_noise < high]
        if not own:
            continue
        counts = [
            sum(getattr(trial, key) for trial in own) for key in ("alarmed", "in_set", "named_rightly", "misnamed")
        ]
        label = f"{low:g} to {high:g}" if np.isfinite(high) else f"above {low:g}"
        rows.append([label, str(len(own)), *(_share(count, len(own)) for count in counts)])
    return rows


def write_report(trials: Sequence[Trial], file: Path) -> None:
    """Write the report as PDF."""
    document = Document("Blind injections", "What the diagnosis says of hidden causes")
    nulls = [trial for trial in trials if trial.kind == "adequate"]
    outside = [trial for trial in trials if trial.kind == "unknown"]
    injected = [trial for trial in trials if trial.kind == "effect"]
    alarms = sum(trial.alarmed for trial in nulls)
    document.section("Summary")
    document.paragraph(
        f"{len(trials)} trials, each on files written by MuJoCo (bodies, springs, fields and sensor faults; no code "
        f"shared with the package): {len(injected)} with causes of the catalogue hidden, {len(outside)} with something "
        f"outside it, {len(nulls)} with nothing. Intervals are 95 % Clopper-Pearson."
    )
    document.items(
        [
            f"Nothing hidden: {_share(alarms, len(nulls))} raised an alarm; declared is 1 %.",
            f"Catalogue: {_share(sum(t.in_set for t in injected), len(injected))} had the hidden "
            f"causes in the reported set, {_share(sum(t.named_rightly for t in injected), len(injected))} named them "
            f"alone, "
            f"{_share(sum(t.misnamed for t in injected), len(injected))} named something else.",
            f"Outside the catalogue: {_share(sum(t.status == 'unknown' for t in outside), len(outside))} called "
            f"unknown, {_share(sum(t.misnamed for t in outside), len(outside))} named as something of the catalogue.",
        ]
    )
    document.section("By signal-to-noise ratio")
    document.table(
        ["signal-to-noise", "trials", "alarm", "in the set", "named alone", "misnamed"],
        rates(trials),
        "Shares by the signal-to-noise ratio of the best hypothesis, the root of its chi-square improvement less its "
        "degrees of freedom.",
    )
    document.figure(_figure(injected), "Injected causes by signal-to-noise ratio: what was said.")
    document.section("Every trial")
    document.table(
        ["hidden", "seed", "strength", "said", "named", "rivals", "signal-to-noise"],
        [
            [
                trial.case,
                str(trial.seed),
                f"{trial.strength:g}",
                trial.status,
                " + ".join(trial.causes) or "-",
                str(max(len(trial.sets) - 1, 0)),
                f"{trial.signal_to_noise:.1f}",
            ]
            for trial in trials
        ],
        "What was hidden and what was said of it: the confusion matrix, trial by trial.",
    )
    document.write(file)


def _share(count: int, total: int) -> str:
    if total == 0:
        return "none"
    low = stats.beta.ppf(0.025, count, total - count + 1) if count else 0.0
    high = stats.beta.ppf(0.975, count + 1, total - count) if count < total else 1.0
    return f"{count} of {total} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"


@styled
def _figure(injected: Sequence[Trial]) -> Figure:
    figure = wide_figure(2.6)
    axes = figure.subplots()
    kinds = (("named alone", "named_rightly"), ("in the set", "in_set"), ("misnamed", "misnamed"))
    for row, (label, key) in enumerate(kinds):
        own = [trial.signal_to_noise for trial in injected if getattr(trial, key)]
        axes.scatter(np.maximum(own, 0.5), np.full(len(own), row), s=14, alpha=0.6, color=COLOURS[row], label=label)
    axes.set_yticks(range(len(kinds)), [label for label, _ in kinds])
    axes.set_ylim(-0.6, len(kinds) - 0.4)
    axes.set_xscale("log")
    axes.set_xlabel("signal-to-noise ratio of the best hypothesis")
    return figure
