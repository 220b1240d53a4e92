"""Report on wrong conventions: how often they are named, and how often correct studies are reported as wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import beta

from bayesid._io.words import joined
from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.common.monte_carlo import Workers
from studies.common.study import TRIALS, CsvTable, Goal, Picture, Report, Setup, Severity, Study, Verdict
from studies.conventions.trials import DRAWN, ROBOTS, VISIBLE, Outcome
from studies.conventions.trials import run as run_all

ALARMS, NAMED, LONGEST = 1e-3, 0.99, 5.0  # most false alarms, least share named, longest time of a look [s]


def run(
    full: bool = False,
    trials: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> list[Outcome]:
    """Make all trials, see `studies.conventions.trials.run`."""
    return run_all(full, trials, workers, progress)


def _interval(count: int, total: int) -> tuple[float, float]:
    """Return the central 95 % interval of a share (Clopper and Pearson 1934)."""
    low = float(beta.ppf(0.025, count, total - count + 1)) if count else 0.0
    high = float(beta.ppf(0.975, count + 1, total - count)) if count < total else 1.0
    return low, high


def _most(count: int, total: int) -> float:
    """Return the one-sided upper limit of a share at 95 % (Clopper and Pearson 1934)."""
    return float(beta.ppf(0.95, count + 1, total - count)) if count < total else 1.0


def _goals(outcomes: Sequence[Outcome]) -> list[Goal]:
    right, wrong = ([row for row in outcomes if row.wrong == side] for side in (False, True))
    alarms, looks = sum(row.alarms for row in right), sum(row.looks for row in right)
    falsely = sum(row.alarms > 0 for row in right)
    wrong = [row for row in wrong if row.visible]
    named = sum(row.right for row in wrong)
    slowest = max(row.seconds for row in outcomes)
    return [
        Goal(
            "Correct studies with any hidden cause: at most 1 in 1,000 reported to have a wrong convention",
            f"{falsely} of {len(right)} studies, in {alarms} of {looks:,} checks; with 95 % confidence at most "
            f"{1e3 * _most(falsely, len(right)):.2g} in 1,000 studies, and {1e3 * _most(alarms, looks):.2g} in 1,000 "
            "checks if these were independent",
            Verdict.between(*_interval(falsely, len(right)), most=ALARMS),
            Severity.HIGH,
        ),
        Goal(
            f"Mistakes in readings whose signal is at least {VISIBLE:g} times the noise: 99 % identified exactly and "
            "corrected by the reported remedy",
            f"{named} of {len(wrong)}",
            Verdict.between(*_interval(named, len(wrong)), least=NAMED),
            Severity.HIGH,
        ),
        Goal(
            "A check takes at most 5 s of processor time, with cached compiled code",
            f"slowest {slowest:.1f} s; for a correct study, the median over its checks is used",
            Verdict.of(slowest <= LONGEST),
            Severity.LOW,
        ),
    ]


@styled
def _figure(outcomes: Sequence[Outcome]) -> Figure:
    names = list(dict.fromkeys(row.subject for row in outcomes if row.wrong))[::-1]
    trials = [[row.right for row in outcomes if row.wrong and row.subject == name] for name in names]
    shares = [np.mean(right) for right in trials]
    figure = wide_figure(0.22 * len(names) + 0.6)
    axes = figure.subplots()
    axes.barh(range(len(names)), shares, color=AFTER)
    for row, right in enumerate(trials):
        axes.text(0.01, row, f"{sum(right)} of {len(right)}", va="center", color="white", fontsize="small")
    axes.set_yticks(range(len(names)), names)
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("share named exactly and corrected")
    return figure


def _kind(outcome: Outcome) -> list[str | float]:
    return [outcome.subject, outcome.wrong, outcome.robot, outcome.amplitude, outcome.noise]


def _by_size(document: Document, outcomes: Sequence[Outcome]) -> None:
    document.section("Which mistakes can be detected")
    wrong = [row for row in outcomes if row.wrong]
    sizes, noises = (sorted({key(row) for row in wrong}) for key in (_amplitude, _noise))
    rows = []
    for size in sizes:
        cells = [[row for row in wrong if (row.amplitude, row.noise) == (size, noise)] for noise in noises]
        rows.append([f"{size:g}", *(f"{sum(row.right for row in cell)} of {len(cell)}" for cell in cells)])
    document.table(
        ["amplitude [rad]:", *(f"noise {format_number(noise)}:" for noise in noises)],
        rows,
        "Mistakes named exactly and corrected, by the amplitude of the joints and the noise of all sensors (rad/s, "
        f"m/s², rad). Of all {len(wrong)}, {sum(not row.visible for row in wrong)} are in readings whose signal is "
        f"smaller than {VISIBLE:g} times their noise; {sum(row.right for row in wrong if not row.visible)} of these "
        "are still named.",
    )


def _amplitude(row: Outcome) -> float:
    return row.amplitude


def _noise(row: Outcome) -> float:
    return row.noise


def _missed(document: Document, outcomes: Sequence[Outcome]) -> None:
    document.section("Missed mistakes and false reports")
    rows = [
        [row.subject, row.robot, f"{row.amplitude:g}", format_number(row.noise), ", ".join(row.said) or "nothing"]
        for row in outcomes
        if (row.wrong and row.visible and not row.right) or (not row.wrong and row.said)
    ]
    if not rows:
        document.paragraph("None.")
        return
    false = sum(not row.wrong and row.alarms > 0 for row in outcomes)
    weak = sum(row.wrong and not row.visible and not row.right for row in outcomes)
    document.table(
        ["mistake", "robot", "amplitude [rad]:", "noise:", "reported"],
        rows,
        f"Mistakes with a signal of at least {VISIBLE:g} times the noise that were not corrected, and false reports "
        f"({false or 'none'}). Mistakes with a weaker signal that were not corrected, {weak}, are in the table with "
        "this report.",
    )


def _report(outcomes: Sequence[Outcome]) -> Report[Sequence[Outcome]]:
    right, wrong = ([row for row in outcomes if row.wrong == side] for side in (False, True))
    full = len(wrong) > 100
    amplitudes = sorted({row.amplitude for row in wrong})
    noises = [format_number(noise) for noise in sorted({row.noise for row in wrong})]
    return Report(
        title="Wrong conventions",
        subtitle="Detection of undeclared axes, signs, orders and units of telemetry",
        question="Are common mistakes in telemetry named, without false reports on correct studies?",
        answer=f"{sum(row.right for row in wrong)} of {len(wrong)} studies with a mistake are corrected by the "
        f"reported remedy. {sum(row.alarms for row in right)} of {sum(row.looks for row in right):,} checks of "
        f"{len(right)} correct studies report a mistake.",
        valid="base and arm exchange momentum: no mistake is detectable if nothing moves. For motions that hardly move "
        "the base, or about an axis of symmetry, the noise limits whether a mistake can be detected and distinguished "
        "from others.",
        goals=_goals(outcomes),
        full=full,
        figure=Picture(_figure(outcomes), "Mistakes, and the share that was named exactly and corrected."),
        setup=Setup(
            robot=f"{joined(list(ROBOTS))} with three and four joints"
            + (f", and {len(DRAWN)} robots drawn at random with two to seven." if full else "."),
            manoeuvre=f"Smooth motions of 60 s with amplitudes of {joined([f'{one:g}' for one in amplitudes])} rad; "
            "150 s with a hidden cause.",
            sensors=f"Rate, acceleration, attitude and encoders, with noise of {joined(noises)} (rad/s, m/s², rad).",
            known="All links except the base.",
            unknown="The base, with a guess that is wrong by about 10 %.",
            replicates="Different motions, starts and noise; causes in and outside the catalogue at several strengths. "
            f"Each correct study is checked {max(row.looks for row in right)} times, with up to ten times the noise, "
            "mountings of up to 30 degrees, guesses of the base wrong by a factor of up to three, and only some of its "
            "sensors; these checks are not independent.",
        ),
        sections=[_by_size, _missed],
        tables=[
            CsvTable(
                "trials",
                ["study", "mistake", "robot", "amplitude", "noise", "said", "right", "looks", "alarms", "seconds"],
                [[*_kind(r), " ".join(r.said), r.right, r.looks, r.alarms, f"{r.seconds:.2f}"] for r in outcomes],
            )
        ],
    )


STUDY = Study(
    name="conventions",
    description="Hide mistakes in telemetry and causes of any kind, and count the reports on conventions.",
    full="ten robots, three sizes and noises, and causes of five strengths",
    extra=TRIALS,
    run=run,
    report=_report,
    inputs=lambda options: list(ROBOTS.values()),
)
