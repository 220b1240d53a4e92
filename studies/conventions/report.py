"""Report on wrong conventions: how often they are named, and how often right studies are taken for wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import beta

from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, styled, wide_figure
from studies.common.monte_carlo import Workers
from studies.common.study import TRIALS, CsvTable, Goal, Picture, Report, Setup, Study, Verdict
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
    wrong = [row for row in wrong if row.visible]
    named = sum(row.right for row in wrong)
    slowest = max(row.seconds for row in outcomes)
    return [
        Goal(
            "Right studies with anything hidden: at most 1 in 1,000 said to have a wrong convention",
            f"{alarms} of {looks}; with 95 % at most {1e3 * _most(alarms, looks):.2g} in 1,000",
            Verdict.between(*_interval(alarms, looks), most=ALARMS),
        ),
        Goal(
            "Mistakes in readings that stand out of their noise: 99 % named exactly, and put right by their remedy",
            f"{named} of {len(wrong)}",
            Verdict.between(*_interval(named, len(wrong)), least=NAMED),
        ),
        Goal(
            "A look takes at most 5 s of a processor, with compiled code kept",
            f"{slowest:.1f} s at most",
            Verdict.of(slowest <= LONGEST),
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
    axes.set_xlabel("share named exactly and put right")
    return figure


def _kind(outcome: Outcome) -> list[str | float]:
    return [outcome.subject, outcome.wrong, outcome.robot, outcome.amplitude, outcome.noise]


def _by_size(document: Document, outcomes: Sequence[Outcome]) -> None:
    document.section("Where a mistake can be seen")
    wrong = [row for row in outcomes if row.wrong]
    sizes, noises = (sorted({key(row) for row in wrong}) for key in (_amplitude, _noise))
    rows = []
    for size in sizes:
        cells = [[row for row in wrong if (row.amplitude, row.noise) == (size, noise)] for noise in noises]
        rows.append([f"{size:g}", *(f"{sum(row.right for row in cell)} of {len(cell)}" for cell in cells)])
    document.table(
        ["amplitude [rad]:", *(f"noise {noise:g}:" for noise in noises)],
        rows,
        "Mistakes named exactly and put right, by the amplitude of the joints and the noise of all sensors (rad/s, "
        f"m/s2, rad). Of all {len(wrong)}, {sum(not row.visible for row in wrong)} are in readings whose signal is "
        f"smaller than {VISIBLE:g} times their noise, of which {sum(row.right for row in wrong if not row.visible)} "
        "are named all the same.",
    )


def _amplitude(row: Outcome) -> float:
    return row.amplitude


def _noise(row: Outcome) -> float:
    return row.noise


def _missed(document: Document, outcomes: Sequence[Outcome]) -> None:
    document.section("What was missed, and what was said in vain")
    rows = [
        [row.subject, row.robot, f"{row.amplitude:g}", f"{row.noise:g}", ", ".join(row.said) or "nothing"]
        for row in outcomes
        if (row.wrong and row.visible and not row.right) or (not row.wrong and row.said)
    ]
    if not rows:
        document.paragraph("Nothing.")
        return
    document.table(["study", "robot", "amplitude [rad]:", "noise:", "said"], rows, "Trials that went wrong.")


def _report(outcomes: Sequence[Outcome]) -> Report[Sequence[Outcome]]:
    right, wrong = ([row for row in outcomes if row.wrong == side] for side in (False, True))
    full = len(wrong) > 100
    return Report(
        title="Wrong conventions",
        subtitle="Axes, signs, orders and units that telemetry does not state are named",
        question="Are the mistakes that people make with telemetry named, and right studies left in peace?",
        answer=f"Of {len(wrong)} studies with a mistake {sum(row.right for row in wrong)} are put right by what is "
        f"said; of {sum(row.looks for row in right)} looks at right studies {sum(row.alarms for row in right)} say "
        "that they are wrong.",
        valid="Base and arm exchange momentum: no mistake shows where nothing moves, and one in what hardly moves the "
        "base, or about an axis of symmetry, is told from none or from others only as far as the noise permits.",
        goals=_goals(outcomes),
        full=full,
        figure=Picture(_figure(outcomes), "Mistakes, and the share that was named exactly and put right."),
        setup=Setup(
            robot=f"{', '.join(ROBOTS)} with three and four joints, and in the full run {len(DRAWN)} drawn at random "
            "with two to seven.",
            manoeuvre="Smooth motions of 60 s, in the full run of three sizes; 150 s where a cause is hidden.",
            sensors=f"Rate, acceleration, attitude and encoders; in the full run with noise of {NOISES}.",
            known="All links but the base.",
            unknown="The base, about a guess that is some 10 % wrong.",
            replicates="Other motions, starts and noise; causes of and outside the catalogue at five strengths; each "
            "right study with up to ten times the noise, mountings of up to 30 degrees, guesses of the base wrong by "
            "up to three, and some of its sensors.",
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
    description="Hide mistakes of telemetry and causes of any kind, and count what is said of conventions.",
    full="ten robots, three sizes and noises, and causes of five strengths",
    extra=TRIALS,
    run=run,
    report=_report,
    inputs=lambda options: list(ROBOTS.values()),
)
