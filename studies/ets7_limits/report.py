"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_number, format_percent, format_vector
from studies.common import mission
from studies.common.ets7 import (
    ACCEL,
    ACCELEROMETER,
    BIAS,
    CORNER,
    ENCODER,
    EXCURSION,
    INTERVAL,
    RAMPS,
    RATE,
    START,
    ets7,
)
from studies.common.figures import manoeuvre_figure, robot_outline
from studies.common.provenance import MODELS
from studies.common.quantities import HEADINGS, ROWS
from studies.common.report_parts import add_number_table
from studies.common.study import CsvTable, Finding, Goal, Picture, Report, Setup, Severity, Statement, Study, Verdict
from studies.ets7_limits.analysis import LONGEST, Answer, Result, run

YEAR = 3.156e7  # length of a year [s]

WANTED = 0.01  # largest relative sd that is wanted

USUAL = ("10⁻⁵ rad/s", "10⁻⁵")  # labels of the mission's sensors


def time_needed(answer: Answer, duration: float) -> str:
    """Return the time to 1 % in words."""
    if np.isinf(answer.repetitions):
        years = format_number(LONGEST * duration / YEAR, 2)
        return f"never ({format_percent(answer.floor, 2)})" if answer.floored else f"over {years} years"
    if answer.repetitions == 1.0:
        return f"at most {duration:g} s"
    hours = answer.repetitions * duration / 3600.0
    if hours < 1.0:
        return f"{format_number(60.0 * hours, 2)} min"
    return f"{format_number(hours, 2)} h" if hours < 48.0 else f"{format_number(hours / 24.0, 2)} days"


def goals(result: Result) -> tuple[Goal, ...]:
    """Return the goal of the study with what was reached; the uncertain arm sets a floor that no manoeuvre lowers."""
    once = result.after["designed"].worst(True)
    needed = time_needed(result.answers[USUAL][True, False], mission.DURATION)
    text = f"Base's mass and moments determined to {format_percent(WANTED)} in one manoeuvre, arm known exactly"
    reached = f"{format_percent(once, 2)} after one; time until {format_percent(WANTED)}: {needed}"
    return (Goal(text, reached, Verdict.of(once <= WANTED), Severity.MEDIUM),)


def _report(result: Result) -> Report[Result]:
    (begin, end), (again, _) = RAMPS
    return Report(
        title="What ETS-VII could have identified",
        subtitle="Within 50 mm/s and 5 degrees per second at the tip",
        question="How long must the arm move within the flight rule until mass and moments of inertia of the base "
        "are determined to 1 %, and with which sensors?",
        answer="With an uncertain arm, no duration and no sensor of motion determines the base to better than "
        f"{format_percent(_least(result), 2)}. This is the largest of the relative standard deviations of its mass and "
        "moments of inertia, with each link's mass uncertain by 5 % (1 sigma). Motion determines masses only relative "
        "to the arm's; an absolute scale needs joint torques or a known thrust. With the arm known exactly one "
        f"manoeuvre of {mission.DURATION:g} s gives {format_percent(result.after['designed'].worst(True), 2)}, with "
        "sensors of 10⁻⁵ rad/s and 10⁻⁵ m/s².",
        goals=goals(result),
        valid="wheels, fuel, paddles and thrusters do not act, attitude control is off, the initial attitude is known "
        "and noise is white. Every repetition starts at a new unknown rate; bias and arm stay the same.",
        full=True,
        figure=Picture(
            _repetition_figure(result.repetitions, result.curves),
            "Largest of the relative standard deviations of mass and moments of inertia against the time spent moving, "
            "with 10⁻⁵ rad/s, 10⁻⁵ m/s² and an unknown bias. The grey line is 1 %.",
        ),
        setup=Setup(
            robot="ETS-VII with the published base and nominal links. The accelerometer is at "
            f"{format_vector(ACCELEROMETER)} m, which is not published.",
            manoeuvre=f"Two of {mission.DURATION:g} s from the posture with the wrist extended: the d-optimal one of "
            "the report on excitation, at the speed that the rule allows, and that of the flight, which turns joints 2 "
            f"to 4 by {', '.join(format_number(turn) for turn in EXCURSION[1:4])} rad out and back within "
            f"{end - begin:g} s each, {again - end:g} s apart, with corners rounded over {CORNER:g} s.",
            sensors=f"Every {INTERVAL:g} s rates and accelerations with the noise in the table, encoders with "
            f"{format_number(ENCODER)} rad. Those of the mission have {format_number(RATE)} rad/s and "
            f"{format_number(ACCEL)} m/s². The star tracker's attitude (2 seconds of arc) is differentiated and its "
            "noise treated as white.",
            known="Gravity gradient, attitude at the start, and the arm: each link's mass uncertain by 5 % (1 sigma), "
            "or exact.",
            unknown=f"The base, the rate at the start, and the accelerometer's bias ({format_number(BIAS)} m/s², 1 "
            "sigma).",
            replicates="Standard deviations to first order; those above some 30 % are rough.",
        ),
        outline=robot_outline(ets7(), START),
        picture=Picture(
            manoeuvre_figure(
                {"d-optimal manoeuvre": result.motion, "manoeuvre of the flight": mission.flight_manoeuvre()}
            ),
            "The two manoeuvres in MuJoCo: joints, speed of the tip (the rule dotted), and rotation of the base.",
        ),
        sections=[_failures, _evidence],
        statements=_statements(result),
        tables=_tables(result),
    )


def _least(result: Result) -> float:
    """Return the smallest of all lower limits with the arm known to 5 %."""
    return min(answer.floor for row in result.answers.values() for (known, _), answer in row.items() if not known)


def _failures(document: Document, result: Result) -> None:
    document.section("Calibration and failures")
    flight, designed = result.after["flight"], result.after["designed"]
    document.items(
        [
            "Motion alone gives no absolute scale (report on the whole system): the prior of the arm sets a floor. "
            "With each link's mass uncertain by 5 % (1 sigma), one designed manoeuvre gives "
            f"{format_percent(designed.worst(False), 2)}, and no time, rate sensor or accelerometer gives less than "
            f"{format_percent(_least(result), 2)}; {format_percent(WANTED)} takes measured joint torques or a known "
            "thrust.",
            "After the manoeuvre of the flight the worst of mass and moments is uncertain by "
            f"{format_percent(flight.worst(False), 2)} (arm uncertain by 5 %) and "
            f"{format_percent(flight.worst(True), 2)} (arm exact), after the designed one by "
            f"{format_percent(designed.worst(False), 2)} and {format_percent(designed.worst(True), 2)}.",
            "The manoeuvre was designed for the mission sensors only; a design for other sensors would need less time "
            "with them. The smoothing of the joints was assessed on the planned motion.",
            f"The standard deviations differ by at most {format_percent(result.difference, 2)} from those "
            "in the report on excitation, which also compares them with errors realised in MuJoCo.",
            "The encoders' noise propagates to the accelerometer, so an accelerometer of 10⁻⁹ m/s² is not a hundred "
            "times better than one of 10⁻⁷. Collisions and true joint ranges, which are not published, are not "
            "considered.",
        ]
    )


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    rows = []
    for (rate, accel), row in result.answers.items():
        cells = [
            cell
            for known in (False, True)
            for cell in (format_percent(row[known, False].once, 2), time_needed(row[known, False], mission.DURATION))
        ]
        rows.append([rate, accel, *cells])
    add_number_table(
        document,
        ["rate sensor", "accelerometer [m/s²]", "once, arm 5 %", "1 % after", "once, arm exact", "1 % after"],
        rows,
        "Largest relative sd of mass and moments after one designed manoeuvre, and time until 1 %, bias unknown. "
        "“Never” is followed in brackets by the sd that remains after "
        f"{format_number(LONGEST * mission.DURATION / YEAR, 2)} years. The shortest time considered is "
        f"{mission.DURATION:g} s. Arm 5 %: each link's mass uncertain by 5 % (1 sigma).",
        words=2,
    )
    designed, flight = result.after["designed"], result.after["flight"]
    columns = (designed.prior, flight.uncertain, flight.exact, designed.uncertain, designed.exact)
    add_number_table(
        document,
        [
            "base",
            "true",
            "prior",
            *(f"{name}, arm {arm}" for name in ("flight", "designed") for arm in ("5 %", "exact")),
        ],
        [
            [heading, format_number(designed.truth[k], 4), *(format_number(float(sd[k]), 3) for sd in columns)]
            for k, heading in enumerate(ROWS)
        ],
        "Standard deviations after one manoeuvre with the mission sensors and unknown bias.",
    )


def _statements(result: Result) -> list[Statement]:
    star, good = ("star tracker 2″", "10⁻⁵"), ("star tracker 2″", "10⁻⁹")
    cells = result.answers
    reasons = [
        f"{label} m/s²: {format_percent(cells[key][True, False].once, 2)} after one manoeuvre, "
        f"{time_needed(cells[key][True, False], mission.DURATION)} until 1 %"
        for label, key in (("10⁻⁵", star), ("10⁻⁹", good))
        if key in cells
    ]
    once = cells[star][True, False].once if star in cells else float("nan")
    return [
        Statement(
            "Attitudes to 2 seconds of arc and accelerations to 10⁻⁵ to 10⁻⁹ m/s² can be measured (4.3).",
            Finding.REFUTED if once > 0.02 else Finding.CONFIRMED,
            "Whether they can be bought was not tested. With the arm known exactly they suffice for the 2 % that the "
            f"paper names. {'; '.join(reasons)}.",
        ),
        Statement(
            "The base's mass is identified to 0.01 % with a given arm, whose masses are known from CAD data to 5 % (1 "
            "and 4.1).",
            Finding.REFUTED,
            f"With each link's mass uncertain by 5 %, the base's is uncertain by {format_percent(_least(result), 2)}, "
            "whatever the rate sensor and the accelerometer.",
        ),
    ]


def _tables(result: Result) -> list[CsvTable]:
    times = [
        [
            *labels,
            "exactly" if known else "5 %",
            "known" if bias else "unknown",
            answer.once,
            answer.repetitions,
            answer.floor,
        ]
        for labels, row in result.answers.items()
        for (known, bias), answer in row.items()
    ]
    header = ["rate sensor", "accelerometer [m/s2]", "arm", "bias", "once", "repetitions until 1 %", "lower limit"]
    sds = [
        [name, arm, *map(float, values)]
        for name, widths in result.after.items()
        for arm, values in zip(mission.ROWS, (widths.uncertain, widths.exact), strict=True)
    ]
    return [
        CsvTable("times", header, times),
        CsvTable("predicted", ["manoeuvre", "arm", *(f"sd {text}" for text in HEADINGS)], sds),
    ]


@styled
def _repetition_figure(repetitions: Sequence[float], curves: Mapping[tuple[str, bool], Sequence[float]]) -> Figure:
    figure = wide_figure(2.7)
    axes = figure.subplots()
    hours = np.array(repetitions) * mission.DURATION / 3600.0
    for index, ((name, known), values) in enumerate(curves.items()):
        label = f"{name} manoeuvre, arm {'exact' if known else '5 %'}"
        line = "--" if known else "-"
        axes.plot(hours, 100.0 * np.array(values), color=COLOURS[index // 2], linestyle=line, label=label)
    axes.axhline(1.0, color="#888888", linewidth=0.8)
    axes.set(xscale="log", yscale="log", xlabel="time spent moving [h]", ylabel="largest relative sd [%]")
    axes.set_yticks(*_ticks(axes.get_ylim()))
    shared_legend(figure, axes, 2, place="outside lower center")
    return figure


def _ticks(limits: tuple[float, float]) -> tuple[list[float], list[str]]:
    values = [value for value in (0.001, 0.01, 0.1, 1.0, 10.0, 100.0) if limits[0] <= value <= limits[1]]
    return values, [f"{value:g}" for value in values]


STUDY = Study(
    "ets7_limits",
    "Determine what ETS-VII could have identified within its flight rules.",
    run=run,
    report=_report,
    extra={
        "--tables": {"type": Path, "default": Path("reports"), "help": "folder with the tables of the study excitation"}
    },
    inputs=lambda options: [MODELS / "ets7.urdf", options.tables / "excitation-manoeuvres.csv"],
)
