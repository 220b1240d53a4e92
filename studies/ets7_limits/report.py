"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report import Document
from bayesid.report.numbers import format_number
from studies.common.ets7 import ACCEL, ACCELEROMETER, BIAS, CORNER, ENCODER, RATE, START
from studies.ets7_limits.analysis import Answer, Designed, Telling
from studies.ets7_limits.check import RATE_AT_START, Check
from studies.ets7_limits.figures import manoeuvre_figure, repetition_figure
from studies.ets7_limits.information import LONGEST
from studies.ets7_limits.setting import INTERVAL

__all__ = ["Result", "time_needed", "write_report"]

UNITS = ("kg", "m", "m", "m", *("kg m²",) * 6)


@dataclass(frozen=True)
class Result:
    """All that the report tells; ``curves`` by manoeuvre and whether the arm is known, against ``repetitions``."""

    designed: Designed
    answers: Mapping[tuple[str, str], Mapping[tuple[bool, bool], Answer]]
    told: Telling
    flight: Telling
    repetitions: Sequence[float]
    curves: Mapping[tuple[str, bool], Sequence[float]]
    check: Check
    duration: float


def time_needed(answer: Answer, duration: float) -> str:
    """Return the time to 1 % in words."""
    if np.isinf(answer.repetitions):
        floor = format_number(100.0 * answer.floor, 2)
        years = format_number(LONGEST * duration / 3.156e7, 2)
        return f"never ({floor} %)" if answer.floored else f"over {years} years"
    if answer.repetitions == 1.0:
        return f"{duration:g} s"
    hours = answer.repetitions * duration / 3600.0
    if hours < 1.0:
        return f"{format_number(60.0 * hours, 2)} min"
    return f"{format_number(hours, 2)} h" if hours < 48.0 else f"{format_number(hours / 24.0, 2)} days"


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("What ETS-VII could have identified", "Within 50 mm/s and 5 degrees per second at the tip")
    document.section("What was asked, and what came out")
    document.paragraph(
        "How long must the arm move, within the rules of the flight, until mass and moments of inertia of the base are "
        "known to 1 % (the largest of the four relative standard deviations), and what must the sensors be? A "
        "manoeuvre "
        f"of all six joints of {result.duration:g} s was designed by d-optimality. Other sensors are answered by the "
        "information of that one manoeuvre, computed anew with their noise; longer times by repeating it. Information "
        "adds; the initial rate is new and unknown in every repetition; accelerometer bias and arm are the same in all."
    )
    for text in _findings(result):
        document.paragraph(text)
    _times(document, result)
    _manoeuvre(document, result)
    _alone(document, result)
    _checked(document, result)
    _assumed(document, result)
    document.write(output)


def _findings(result: Result) -> list[str]:
    own, flown = result.told, result.flight
    texts = [
        f"With {format_number(RATE)} rad/s and {format_number(ACCEL)} m/s² per sample and the arm known exactly, one "
        f"designed manoeuvre leaves {format_number(_worst(own, own.exact), 2)} %, the flight's own "
        f"{format_number(_worst(flown, flown.exact), 2)} %."
    ]
    floors = [
        answer.floor
        for row in result.answers.values()
        for (known, _), answer in row.items()
        if not known and answer.floored
    ]
    if floors:
        texts.append(
            "With the arm's masses known to 5 % no time is enough: nothing but the arm's own mass sets the "
            "scale of the "
            "base's, since no external force of known size acts. The floor is "
            f"{format_number(100.0 * min(floors), 2)} % or more, whatever the sensors."
        )
    return texts


def _worst(telling: Telling, sd: np.ndarray) -> float:
    judged = [0, 4, 5, 6]
    return float(100.0 * (sd[judged] / telling.truth[judged]).max())


def _times(document: Document, result: Result) -> None:
    document.section("Time needed for 1 %")
    for known, title in ((True, "Arm known exactly"), (False, "Arm known to 5 % (log-Cholesky width 0.025)")):
        document.table(
            ["rate sensor", "accelerometer [m/s²]", "after one [%]", "time, bias unknown", "time, bias known"],
            [
                [
                    rate,
                    accel,
                    format_number(100.0 * row[known, False].once, 2),
                    time_needed(row[known, False], result.duration),
                    "same" if accel == "none" else time_needed(row[known, True], result.duration),
                ]
                for (rate, accel), row in result.answers.items()
            ],
            f"{title}: largest relative standard deviation after one manoeuvre (bias unknown), and time until 1 %. "
            f"'Never': more time no longer helps, the floor is in brackets. One manoeuvre of {result.duration:g} s is "
            "the shortest time that was looked at."
            + (
                ""
                if known
                else " Where rates alone need years, it is never too: no less is left without the accelerometer."
            ),
            ["left", "left", "right", "right", "right"],
        )
    document.figure(
        repetition_figure(result.repetitions, result.curves, result.duration),
        f"Largest of the relative standard deviations of mass and moments of inertia, sensors of {format_number(RATE)} "
        f"rad/s and {format_number(ACCEL)} m/s², bias unknown. The grey line is 1 %.",
    )


def _manoeuvre(document: Document, result: Result) -> None:
    document.section("The designed manoeuvre")
    costs = ", ".join(f"{cost:.2f}".replace("-", "−") for cost in result.designed.found.costs)
    limits = "; ".join(
        f"{item.name} reaches {format_number(item.largest)} of {format_number(item.limit)} {item.unit}"
        for item in result.designed.reached
        if item.name.startswith("tip")
    )
    document.paragraph(
        f"SLSQP from {len(result.designed.found.costs)} random starts ended at half log-determinants of {costs}: "
        f"better manoeuvres may exist. Limits: {limits}."
    )
    document.figure(
        manoeuvre_figure(result.designed.trajectory),
        "Joints, speed of the tip (limit dashed) and rotation of the base.",
    )


def _alone(document: Document, result: Result) -> None:
    document.section("One manoeuvre: designed, and as flown")
    own, flown = result.told, result.flight
    document.table(
        ["base", "unit", "true", "prior", "flight", "flight, arm 5 %", "designed", "designed, arm 5 %"],
        [
            [key, unit, f"{own.truth[k]:.4g}", *(format_number(float(sd[k]), 2) for sd in columns)]
            for columns in [(own.prior, flown.exact, flown.uncertain, own.exact, own.uncertain)]
            for k, (key, unit) in enumerate(zip(BODY_QUANTITIES, UNITS, strict=True))
        ],
        f"Standard deviations (to first order) from one manoeuvre, {format_number(RATE)} rad/s and "
        f"{format_number(ACCEL)} m/s² per sample, bias unknown.",
        ["left", "left", *["right"] * 6],
    )
    document.paragraph(
        "The flight's manoeuvre: joints 2 to 4 by 0.264, −0.321 and 0.057 rad out and back in 22.6 s each, "
        "39.4 s apart, "
        f"its corners rounded over {CORNER:g} s; the time around it is recorded too, so that both last "
        f"{result.duration:g} s."
    )


def _checked(document: Document, result: Result) -> None:
    document.section("Is the prediction right?")
    check = result.check
    document.paragraph(
        f"MuJoCo flew the designed manoeuvre with an initial rate of "
        f"({', '.join(f'{v:g}' for v in RATE_AT_START)}) rad/s "
        f"that the fits do not know; {len(check.estimates)} recordings with fresh noise of all sensors and joints were "
        "fitted. The root mean square error over the predicted standard deviation should be one within "
        f"{check.sampling_error:.2f}; the mean error, in its own standard deviations, a standard normal number. "
        f"Chi-square per sample: {check.chi2.mean():.3f} on average."
    )
    document.table(
        ["base", "unit", "predicted sd", "rms error / predicted", "mean error [sd of mean]"],
        [
            [
                key,
                unit,
                format_number(float(check.predicted[k]), 3),
                f"{check.ratio[k]:.2f}",
                f"{check.offset[k]:+.1f}".replace("-", "−"),
            ]
            for k, (key, unit) in enumerate(zip(BODY_QUANTITIES, UNITS, strict=True))
        ],
        "Estimates from flights of the independent simulator against the prediction.",
        ["left", "left", "right", "right", "right"],
    )


def _assumed(document: Document, result: Result) -> None:
    document.section("What was assumed")
    document.items(
        [
            "Base as published in the paper, under a prior of relative width one; arm with nominal inertias. Start of "
            f"every manoeuvre: joints at {', '.join(f'{value:g}' for value in START)} rad; accelerometer at "
            f"{', '.join(f'{value:g}' for value in ACCELEROMETER)} m. Neither is published.",
            f"Samples each {INTERVAL:g} s; noise is white. The star sensor's 2 seconds of arc, differenced, "
            "are taken as "
            f"white too (2.7 × 10⁻⁵ rad/s). Joints have {format_number(ENCODER)} rad of noise, "
            "smoothed; it reaches the accelerometer, so that one of 10⁻⁹ m/s² is not a hundred times better than one "
            "of 10⁻⁷. How well it is smoothed was judged on the planned motion; the check was made at 10⁻⁵ m/s² only.",
            f"Initial rate unknown; attitude at the start known exactly; accelerometer bias, where unknown, within "
            f"{format_number(BIAS)} m/s² and the same in all repetitions. Gravity gradient is modelled; wheels, fuel, "
            "paddles and thrusters are taken to be silent, and the attitude control off.",
            "The manoeuvre was designed once, for one grade of sensors and an arm that is known: designs made "
            "for another "
            "grade would need somewhat less time there. Collisions and true joint ranges, which are not published, are "
            "not looked at.",
            "Standard deviations are to first order; where they are large (beyond some 30 %) they are rough.",
        ]
    )
