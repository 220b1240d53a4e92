"""Report of the study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binomtest

from bayesid.design.pose_trajectory import CONTENT
from bayesid.report import Document, figures
from bayesid.report.figures.figure_style import AFTER, BEFORE, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_p_value, format_percent, format_vector
from bayesid.report.verdict_record import Share
from studies.common import mission
from studies.common.ets7 import BIAS, START, TIP_RATE, TIP_SPEED, ets7
from studies.common.figures import robot_outline
from studies.common.provenance import MODELS
from studies.common.report_parts import add_number_table
from studies.common.study import (
    TRIALS,
    CsvTable,
    Finding,
    Goal,
    Picture,
    Report,
    Setup,
    Severity,
    Statement,
    Study,
    Verdict,
)
from studies.ets7_limits.analysis import designed_motion
from studies.planning.analysis import BODIES, DRAWS, EXCURSION, KINDS, SHIPS, SPREAD, STAGES, Result, Row, run

MANOEUVRES = "excitation-manoeuvres.csv"  # table of the study of excitation
HEADLINE = next(iter(mission.ROWS))  # what is known of the arm in the headline

# words for what is known of the arm
ARMS = dict(zip(mission.ROWS, ("arm uncertain by 5 % (1 sigma)", "arm known exactly"), strict=True))

# regions that are counted, by indices of body and kind; base and end-effector turn alike
REGIONS = {(0, 0): "base position", (1, 0): "end-effector position", (1, 1): "rotation"}

RISK = 0.05  # probability with which the counts of one stage are called wrong although all of its regions are right
NARROW = 0.05  # half width of an interval above which a count decides nothing


def _p_value(share: Share) -> float:
    """Return the probability of a count at least as unlikely as this one, where the region is right."""
    return float(binomtest(share.count, share.total, CONTENT).pvalue)


def _verdict(shares: list[Share]) -> Verdict:
    """Judge the counts of one stage together: each is tested with its part of `RISK`."""
    if min(map(_p_value, shares)) < RISK / len(shares):
        return Verdict.FAIL
    widths = [high - low for low, high in (share.interval for share in shares)]
    return Verdict.PASS if max(widths) <= 2.0 * NARROW else Verdict.OPEN


def goals(result: Result) -> tuple[Goal, ...]:
    """Return the goals of the study with what was reached."""
    rows, arms = result.rows, " and ".join(ARMS[row] for row in result.rows)
    counted = {
        f"{title}, {ARMS[row]}": {text: flown.share(stage, *index) for index, text in REGIONS.items()}
        for row, flown in rows.items()
        for stage, title in enumerate(STAGES)
    }
    least = {name: min(map(_p_value, shares.values())) for name, shares in counted.items()}
    worst = min(least, key=lambda name: least[name])
    others = ", ".join(format_p_value(p) for name, p in least.items() if name != worst)
    smaller = {
        ARMS[row]: Share(int((flown.miss[:, 1] < flown.miss[:, 0]).all(axis=1).sum()), len(flown.miss))
        for row, flown in rows.items()
    }
    speed, rate = result.course.largest("tip_speed"), result.course.largest("tip_rate")
    return (
        Goal(
            f"The predicted {format_percent(CONTENT)} regions contain the flown pose in {format_percent(CONTENT)} of "
            f"flights in all {len(counted)} cases (exact binomial test of each region: p at least "
            f"{format_number(RISK / len(REGIONS), 2)})",
            f"smallest p {format_p_value(least[worst])} ({worst}: "
            f"{'; '.join(f'{text} {share}' for text, share in counted[worst].items())}); others {others}",
            Verdict.all_of(_verdict(list(shares.values())) for shares in counted.values()),
            Severity.HIGH,
        ),
        Goal(
            f"The plan with the identified spacecraft has the smaller miss, position and rotation, {arms}",
            "; ".join(f"{share} ({arm})" for arm, share in smaller.items()),
            Verdict.of(all(share.interval[0] > 0.5 for share in smaller.values())),
            Severity.MEDIUM,
        ),
        Goal(
            "The planned path satisfies the flight rule in MuJoCo",
            f"{format_number(1e3 * speed)} mm/s and {format_number(float(np.degrees(rate)), 2)} degrees per second",
            Verdict.of(speed <= TIP_SPEED and rate <= TIP_RATE),
            Severity.HIGH,
        ),
    )


def _median(row: Row, stage: int, kind: int) -> str:
    return format_number(float(np.median(row.miss[:, stage, kind])), 2)


def _report(result: Result) -> Report[Result]:
    row = result.rows[HEADLINE]
    before, after = (row.share(stage, 1, 0) for stage in range(len(STAGES)))
    counts = ", ".join(f"{len(drawn.miss)} with the {ARMS[known]}" for known, drawn in result.rows.items())
    return Report(
        title="What path planning gains from identification",
        subtitle="ETS-VII in MuJoCo; section 1.1.1 of the paper",
        question="How far from its target does a path planned in joint space end, before and after identification?",
        answer=f"The median miss of the end-effector is {_median(row, 1, 0)} mm after one identification manoeuvre and "
        f"{_median(row, 0, 0)} mm before. The median angular misses are {_median(row, 1, 1)} and {_median(row, 0, 1)} "
        f"degrees ({ARMS[HEADLINE]}); the predicted 95 % region of the position contains the end-effector in {after} "
        f"and {before} of the flights.",
        goals=goals(result),
        valid="the joints follow the plan exactly, only the gravity gradient acts, and every path starts at rest.",
        full=result.full,
        figure=Picture(
            _miss_figure(result),
            "Miss of the end-effector, distance from its target and angle, over the drawn spacecraft: share of "
            f"spacecraft below a value. Solid: {ARMS[HEADLINE]}; dashed: arm known exactly.",
        ),
        setup=Setup(
            robot=f"ETS-VII with drawn bodies, 1 sigma {format_percent(2.0 * SPREAD)} of the base mass and 5 % of each "
            f"link mass; joints within ±{mission.REACH:g} rad, wrist extended at the start.",
            manoeuvre="Identification: the d-optimal manoeuvre of the report on excitation, "
            f"{mission.DURATION:g} s within 50 mm/s and 5 degrees per second. Planned path: quintics from rest to rest "
            f"in the same time, in the first plan with joint excursions of {format_vector(EXCURSION, 2)} rad and at "
            f"most {format_number(1e3 * result.course.largest('tip_speed'))} mm/s.",
            sensors=f"{mission.SENSORS}; a constant bias of the accelerometer.",
            known="The orbit and its gravity gradient, the initial attitude, and the published spacecraft.",
            unknown="The base and the links with these uncertainties, the initial rate, the bias "
            f"({format_number(BIAS)} m/s², 1 sigma).",
            replicates=f"Drawn spacecraft: {counts}, each with separate noise and bias. Each prediction has {DRAWS} "
            "draws; posteriors are normal in log-Cholesky coordinates about the mode.",
        ),
        outline=robot_outline(ets7(), START),
        sections=[_failures, _evidence],
        statements=_statements(result),
        tables=[_table(result)],
    )


def _failures(document: Document, result: Result) -> None:
    document.section("Calibration and failures")
    texts = []
    for row, flown in result.rows.items():
        mean, error = flown.distance.mean(), flown.distance.std(ddof=1) / np.sqrt(len(flown.distance))
        missed = {text: int((~flown.inside[:, 1, body, kind]).sum()) for (body, kind), text in REGIONS.items()}
        worst = max(missed, key=lambda text: missed[text])
        texts.append(
            f"{ARMS[row].capitalize()}: the mean squared distance of the true base from the identified one is "
            f"{format_fixed(float(mean), 1)} ± {format_fixed(float(error), 1)} (expected: 10). After identification "
            f"the {worst} regions have the lowest coverage: {missed[worst]} of {len(flown.inside)} do not contain the "
            f"flown value (expected: {format_fixed((1.0 - CONTENT) * len(flown.inside), 1)})."
        )
    texts.append(
        "The regions have the proportions of the draws' covariance and the size that contains 95 % of such draws. "
        "The truth is a draw from the planner's prior; a prior that is too narrow was not tested."
    )
    document.items(texts)


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    cells = []
    for row, flown in result.rows.items():
        for stage, title in enumerate(STAGES):
            misses = [
                format_number(float(np.quantile(flown.miss[:, stage, kind], part)), 2)
                for kind in range(len(KINDS))
                for part in (0.5, 0.95)
            ]
            sizes = [format_number(float(np.median(flown.size[:, stage, 1, kind])), 2) for kind in range(len(KINDS))]
            counts = [f"{flown.inside[:, stage, body, kind].sum()} of {len(flown.inside)}" for body, kind in REGIONS]
            cells.append([ARMS[row].removeprefix("arm "), title, *misses, *sizes, *counts])
    add_number_table(
        document,
        [
            "arm",
            "planned with",
            "median miss [mm]",
            "95 % quantile [mm]",
            "median angle [°]",
            "95 % quantile [°]",
            "semi-axis [mm]",
            "semi-axis [°]",
            *(f"{text} inside" for text in ("base", "end-effector", "rotation")),
        ],
        cells,
        "Miss of the end-effector, median and 95 % quantile over the spacecraft; longest semi-axis of the predicted "
        "95 % regions of its pose, median; number of regions that contain the flown pose: position of the base, "
        "position of the end-effector, rotation.",
        words=2,
    )
    first, again = result.example
    for trip, title, colour in ((first, STAGES[0], BEFORE), (again, STAGES[1], AFTER)):
        document.figure(
            figures.final_positions({title: trip.predicted["tip"]}, trip.flown["tip"][0], (colour,)),
            f"One example, planned with the {title}: draws of the end-effector's final position and the outline of "
            "their 95 % ellipsoid, relative to the true final position.",
        )


def _statements(result: Result) -> list[Statement]:
    headline = result.rows[HEADLINE]
    gain = float(np.median(headline.miss[:, 0, 0] / headline.miss[:, 1, 0]))
    return [
        Statement(
            "A path planned in joint space for a final state in inertial space misses it if the parameters are wrong "
            "(1.1.1).",
            Finding.CONFIRMED if np.median(headline.miss[:, 0, 0]) > 1.0 else Finding.REFUTED,
            f"With the base mass uncertain by {format_percent(2.0 * SPREAD)} (1 sigma), the median miss is "
            f"{_median(headline, 0, 0)} mm.",
        ),
        Statement(
            "Identification has to be performed before any operational phase (1.1.1).",
            Finding.NOT_TESTABLE,
            f"One manoeuvre reduces the miss by a factor of {format_number(gain, 2)} in the median. Whether that is "
            "necessary depends on the permitted miss, which the paper does not state.",
        ),
    ]


def _table(result: Result) -> CsvTable:
    header = ["arm", "ship", "planned with", "miss [mm]", "miss [degrees]"]
    header += [f"{body} {kind} inside" for body in BODIES for kind in KINDS]
    lines = [
        [row, number, title, *map(float, flown.miss[number, stage]), *map(int, flown.inside[number, stage].ravel())]
        for row, flown in result.rows.items()
        for number in range(len(flown.miss))
        for stage, title in enumerate(STAGES)
    ]
    return CsvTable("ships", header, lines)


@styled
def _miss_figure(result: Result) -> Figure:
    figure = wide_figure(2.3)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, kind, unit in zip(panels, range(2), ("mm", "degrees"), strict=True):
        for (row, flown), line in zip(result.rows.items(), ("-", "--"), strict=True):
            for stage, title in enumerate(STAGES):
                values = np.sort(flown.miss[:, stage, kind])
                share = np.arange(1, len(values) + 1) / len(values)
                label = title if row == HEADLINE else None
                axes.plot(values, share, line, color=(BEFORE, AFTER)[stage], label=label)
        axes.set(xscale="log", xlabel=f"miss [{unit}]")
    panels[0].set_ylabel("share of spacecraft")
    shared_legend(figure, panels[0], len(STAGES))
    return figure


def _run(tables: Path, **options: Any) -> Result:
    """Run the study with the manoeuvre in a table of the study of excitation."""
    return run(np.asarray(designed_motion(tables / MANOEUVRES).parameters), **options)


STUDY = Study(
    "planning",
    "Quantify what path planning gains from identification.",
    run=_run,
    report=_report,
    full=f"{SHIPS} drawn spacecraft for each uncertainty of the arm",
    seed=1,
    extra={
        "--tables": {
            "type": Path,
            "default": Path("reports"),
            "help": "folder with the tables of the study excitation",
        },
        "--ships": {"type": int, "help": "number of drawn spacecraft for each uncertainty of the arm"},
        **TRIALS,
    },
    inputs=lambda options: [MODELS / "ets7.urdf", options.tables / MANOEUVRES],
)
