"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid._io.words import counted
from bayesid.report import Document
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_signed, format_vector
from studies.common.ets7 import ACCEL, ACCELEROMETER, BIAS, CORNER, ENCODER, EXCURSION, INTERVAL, RAMPS, RATE, START
from studies.common.quantities import HEADINGS
from studies.common.tables import add_number_table
from studies.ets7_limits.analysis import Answer, Designed, Widths
from studies.ets7_limits.check import RATE_AT_START, Check
from studies.ets7_limits.figures import manoeuvre_figure, repetition_figure
from studies.ets7_limits.information import LONGEST

__all__ = ["Result", "time_needed", "write_report"]

YEAR = 3.156e7
"""Length of a year [s]."""

SENSORS = f"{format_number(RATE)} rad/s and {format_number(ACCEL)} m/s² per sample"
"""Sensors that the manoeuvre is designed for."""


@dataclass(frozen=True)
class Result:
    """Content of the report.

    Attributes
    ----------
    designed : Designed
        The designed manoeuvre.
    answers : mapping
        Answers by labels of rate and accelerometer, then by whether the arm and the bias are known.
    after_designed, after_flight : Widths
        Standard deviations from the designed manoeuvre and from the flight's.
    repetitions : sequence of float
        Numbers of repetitions of the curves.
    curves : mapping
        Largest relative standard deviations by manoeuvre and whether the arm is known.
    check : Check
        Estimates from flights of the independent simulator.
    duration : float
        Length of both manoeuvres [s].
    """

    designed: Designed
    answers: Mapping[tuple[str, str], Mapping[tuple[bool, bool], Answer]]
    after_designed: Widths
    after_flight: Widths
    repetitions: Sequence[float]
    curves: Mapping[tuple[str, bool], Sequence[float]]
    check: Check
    duration: float


def time_needed(answer: Answer, duration: float) -> str:
    """Return the time to 1 % in words."""
    if np.isinf(answer.repetitions):
        years = format_number(LONGEST * duration / YEAR, 2)
        return f"never ({format_percent(answer.floor, 2)})" if answer.floored else f"over {years} years"
    if answer.repetitions == 1.0:
        return f"{duration:g} s"
    hours = answer.repetitions * duration / 3600.0
    if hours < 1.0:
        return f"{format_number(60.0 * hours, 2)} min"
    return f"{format_number(hours, 2)} h" if hours < 48.0 else f"{format_number(hours / 24.0, 2)} days"


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("What ETS-VII could have identified", "Within 50 mm/s and 5 degrees per second at the tip")
    document.section("Questions and answers")
    document.paragraph(
        "How long must the arm move, within the rules of the flight, until mass and moments of inertia of the base are "
        "known to 1 % (the largest of the four relative standard deviations), and what must the sensors be? To answer "
        f"this, a manoeuvre of all six joints of {result.duration:g} s was designed by d-optimality. The information "
        "of that one manoeuvre is computed anew with the noise of other sensors, and added up for longer times, in "
        "which the manoeuvre is repeated. The initial rate is new and unknown in every repetition; accelerometer bias "
        "and arm are the same in all."
    )
    for text in _findings(result):
        document.paragraph(text)
    _times(document, result)
    _manoeuvre(document, result)
    _after_one(document, result)
    _checked(document, result.check)
    document.section("Assumptions")
    document.items(_assumptions())
    document.write(output)


def _findings(result: Result) -> list[str]:
    texts = [
        f"With {SENSORS} and the arm known exactly, one designed manoeuvre leaves "
        f"{format_percent(result.after_designed.worst, 2)}, the flight's manoeuvre "
        f"{format_percent(result.after_flight.worst, 2)}."
    ]
    floors = [
        answer.floor
        for row in result.answers.values()
        for (known, _), answer in row.items()
        if not known and answer.floored
    ]
    if floors:
        texts.append(
            "With the arm's masses known to 5 % no time is enough. Nothing but the mass of the arm sets the scale of "
            f"the base's mass, since no external force of known size acts. {format_percent(min(floors), 2)} or more "
            "are left, whatever the sensors."
        )
    return texts


def _times(document: Document, result: Result) -> None:
    document.section("Time needed for 1 %")
    for known, title in ((True, "Arm known exactly"), (False, "Arm known to 5 % (log-Cholesky width 0.025)")):
        caption = (
            f"{title}: largest relative standard deviation after one manoeuvre with unknown bias, and time until 1 %. "
            "'Never' means that more time no longer helps, with the lower limit in brackets. One manoeuvre of "
            f"{result.duration:g} s is the shortest time that was considered."
        )
        if not known:
            caption += " Where rates alone need years, they never suffice: the lower limit is at least as high."
        rows = [
            [
                rate,
                accel,
                format_number(100.0 * row[known, False].once, 2),
                time_needed(row[known, False], result.duration),
                "same" if accel == "none" else time_needed(row[known, True], result.duration),
            ]
            for (rate, accel), row in result.answers.items()
        ]
        header = ["rate sensor", "accelerometer [m/s²]", "after one [%]", "time, bias unknown", "time, bias known"]
        add_number_table(document, header, rows, caption, words=2)
    document.figure(
        repetition_figure(result.repetitions, result.curves, result.duration),
        f"Largest of the relative standard deviations of mass and moments of inertia, with {SENSORS} and unknown bias. "
        "The grey line is 1 %.",
    )


def _manoeuvre(document: Document, result: Result) -> None:
    document.section("The designed manoeuvre")
    costs = result.designed.optimum.costs
    limits = "; ".join(
        f"the {item.name.replace('_', ' ')} reaches {format_number(item.largest)} of {format_number(item.limit)} "
        f"{item.unit}"
        for item in result.designed.reached
        if item.name.startswith("tip")
    )
    document.paragraph(
        f"SLSQP from {counted(len(costs), 'random start')} ended at half log-determinants of "
        f"{', '.join(format_fixed(cost, 2) for cost in costs)}, so better manoeuvres may exist. Limits: {limits}."
    )
    document.figure(
        manoeuvre_figure(result.designed.trajectory),
        "Joints, speed of the tip (limit dashed) and rotation of the base.",
    )


def _after_one(document: Document, result: Result) -> None:
    document.section("One manoeuvre: designed, and as flown")
    designed, flight = result.after_designed, result.after_flight
    columns = (designed.prior, flight.exact, flight.uncertain, designed.exact, designed.uncertain)
    add_number_table(
        document,
        ["base", "true", "prior", "flight", "flight, arm 5 %", "designed", "designed, arm 5 %"],
        [
            [heading, format_number(designed.truth[k], 4), *(format_number(float(sd[k]), 2) for sd in columns)]
            for k, heading in enumerate(HEADINGS)
        ],
        f"Standard deviations (to first order) from one manoeuvre, with {SENSORS} and unknown bias.",
    )
    (begin, end), (again, _) = RAMPS
    document.paragraph(
        f"The flight's manoeuvre turns joints 2 to 4 by {', '.join(format_number(turn) for turn in EXCURSION[1:4])} "
        f"rad out and back, in {end - begin:g} s each and {again - end:g} s apart, with corners rounded over "
        f"{CORNER:g} s. The time around it is recorded too, so that both manoeuvres last {result.duration:g} s."
    )


def _checked(document: Document, check: Check) -> None:
    document.section("Accuracy of the prediction")
    document.paragraph(
        f"MuJoCo flew the designed manoeuvre with an initial rate of {format_vector(RATE_AT_START)} rad/s that the "
        f"fits do not know. {len(check.estimates)} recordings with fresh noise of all sensors and joints were fitted. "
        "The root mean square error over the predicted standard deviation should be one within "
        f"{check.sampling_error:.2f}; the mean error, in units of its standard deviation, should be a standard normal "
        f"number. Chi-square per sample is {check.chi2.mean():.3f} on average."
    )
    add_number_table(
        document,
        ["base", "predicted sd", "rms error / predicted", "mean error [sd of mean]"],
        [
            [
                heading,
                format_number(float(check.predicted[k]), 3),
                format_fixed(check.ratio[k], 2),
                format_signed(check.offset[k]),
            ]
            for k, heading in enumerate(HEADINGS)
        ],
        "Estimates from flights of the independent simulator against the prediction.",
    )


def _assumptions() -> list[str]:
    return [
        "The base is that published in the paper, under a prior of relative width one; the arm has nominal inertias. "
        f"Every manoeuvre starts with the joints at {format_vector(START)} rad; the accelerometer is at "
        f"{format_vector(ACCELEROMETER)} m. Neither is published.",
        f"There is a sample each {INTERVAL:g} s, with white noise. The star sensor's 2 seconds of arc are differenced "
        f"and taken as white too (2.7 × 10⁻⁵ rad/s). The joints have {format_number(ENCODER)} rad of noise and are "
        "smoothed. Their noise reaches the accelerometer, so that one of 10⁻⁹ m/s² is not a hundred times better than "
        "one of 10⁻⁷. The smoothing was judged on the planned motion; the check was made at 10⁻⁵ m/s² only.",
        "The initial rate is unknown and the initial attitude is known exactly. The accelerometer bias, where unknown, "
        f"is within {format_number(BIAS)} m/s² and the same in all repetitions. The gravity gradient is modelled; "
        "wheels, fuel, paddles and thrusters do not act, and the attitude control is off.",
        "The manoeuvre was designed once, for one grade of sensors and an arm that is known. Designs for another grade "
        "would need somewhat less time there. Collisions and true joint ranges, which are not published, are not "
        "considered.",
        "Standard deviations are to first order; those above some 30 % are rough.",
    ]
