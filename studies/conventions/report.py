"""Report on wrong conventions: how often they are named, and how often correct studies are reported as wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import beta

from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, styled, wide_figure
from studies.common.monte_carlo import Workers
from studies.common.study import TRIALS, CsvTable, Goal, Picture, Report, Setup, Severity, Study, Verdict
from studies.conventions.trials import DRAWN, NOISES, ROBOTS, VISIBLE, Outcome
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
            f"{alarms} of {looks} checks of {len(right)} studies; with 95 % confidence at most "
            f"{1e3 * _most(alarms, looks):.2g} in 1,000 if all checks were independent, and "
            f"{1e3 * _most(falsely, len(right)):.2g} in 1,000 counted by study",
            Verdict.between(*_interval(alarms, looks), most=ALARMS),
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
            f"slowest {slowest:.1f} s; of a correct study the median of its checks counts",
            Verdict.of(slowest <= LONGEST),
            Severity.LOW,
        ),
    ]


@styled
def _figure(outcomes: Sequence[Outcome]) -> Figure:
    names = list(dict.fromkeys(row.subject for row in outcomes if row.wrong))[::-1]
    shares = [np.mean([row.right for row in outcomes if row.wrong and row.subject == name]) for name in names]
    figure = wide_figure(0.22 * len(names) + 0.6)
    axes = figure.subplots()
    axes.barh(range(len(names)), shares, color=AFTER)
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
        ["amplitude [rad]:", *(f"noise {noise:g}:" for noise in noises)],
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
        [row.subject, row.robot, f"{row.amplitude:g}", f"{row.noise:g}", ", ".join(row.said) or "nothing"]
        for row in outcomes
        if (row.wrong and row.visible and not row.right) or (not row.wrong and row.said)
    ]
    if not rows:
        document.paragraph("None.")
        return
    document.table(["mistake", "robot", "amplitude [rad]:", "noise:", "reported"], rows, "Trials with wrong results.")


def _report(outcomes: Sequence[Outcome]) -> Report[Sequence[Outcome]]:
    right, wrong = ([row for row in outcomes if row.wrong == side] for side in (False, True))
    full = len(wrong) > 100
    return Report(
        title="Wrong conventions",
        subtitle="Detection of undeclared axes, signs, orders and units of telemetry",
        question="Are common mistakes in telemetry named, without false reports on correct studies?",
        answer=f"{sum(row.right for row in wrong)} of {len(wrong)} studies with a mistake are corrected by the "
        f"reported remedy. {sum(row.alarms for row in right)} of {sum(row.looks for row in right)} checks of correct "
        "studies report a mistake.",
        valid="base and arm exchange momentum: no mistake is detectable if nothing moves. For motions that hardly move "
        "the base, or about an axis of symmetry, the noise limits whether a mistake can be detected and distinguished "
        "from others.",
        goals=_goals(outcomes),
        full=full,
        figure=Picture(_figure(outcomes), "Mistakes, and the share that was named exactly and corrected."),
        setup=Setup(
            robot=f"{', '.join(ROBOTS)} with three and four joints, and in the full run {len(DRAWN)} drawn at random "
            "with two to seven.",
            manoeuvre="Smooth motions of 60 s, in the full run of three sizes; 150 s with a hidden cause.",
            sensors=f"Rate, acceleration, attitude and encoders; in the full run with noise of "
            f"{', '.join(f'{noise:g}' for noise in NOISES)} (rad/s, m/s², rad).",
            known="All links except the base.",
            unknown="The base, with a guess that is wrong by about 10 %.",
            replicates="Different motions, starts and noise; causes in and outside the catalogue at five strengths; "
            "each correct study with up to ten times the noise, mountings of up to 30 degrees, guesses of the base "
            "wrong by a factor of up to three, and only some of its sensors.",
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
