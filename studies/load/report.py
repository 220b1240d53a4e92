"""Report of the study."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.report import Document, format_quantity
from bayesid.report.numbers import format_number
from studies.common.report_parts import QUANTITY_TITLES, columns, not_evaluated
from studies.load import paper
from studies.load.figures import error_figure, motion_figure, width_figure
from studies.load.noise_free import Iteration
from studies.load.sampled import CAREFUL, SPREAD, Flight
from studies.load.setting import DURATION, JOLT, LIMITS, RANGE

__all__ = ["Result", "write_report"]

GOAL = 1e-6
"""Relative error to reach without noise."""

TITLES = {"paper": "paper's motion and criterion", "careful": "splines, d-optimal, base limited"}
"""Titles of the ways to plan."""


@dataclass(frozen=True)
class Result:
    """Outcome of the study.

    Attributes
    ----------
    iterations : list of Iteration
        Iterations without noise.
    flights : mapping of str to Flight
        Loops with noise, by the way in which their manoeuvres were planned; full study only.
    """

    iterations: list[Iteration]
    flights: Mapping[str, Flight]


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Load on ETS-VII", "Section 4.2 of Lampariello and Hirzinger (IDETC 2005), beside the paper")
    _answers(document, result)
    _readings(document)
    _noise_free(document, result.iterations)
    _sampled(document, result.flights)
    document.write(output)


def _worst(estimates: Iterable[Floats]) -> list[str]:
    return [format_number(float(np.abs(paper.errors(estimate)).max()), 2) for estimate in estimates]


def _answers(document: Document, result: Result) -> None:
    document.section("Questions and answers")
    estimates = [item.estimate for item in result.iterations]
    worst, printed = (" and then ".join(_worst(values)) for values in (estimates, paper.RESULTS))
    rows = [
        [
            "Is a load of 370 kg identified from a guess of 10 kg, without noise, within 1e-6 after two iterations?",
            f"{'Yes' if result.iterations[-1].worst < GOAL else 'No'}. The worst relative error is {worst}; in the "
            f"paper it is {printed}.",
        ],
        [
            "Which point is the printed inertia about?",
            "It is about the load's centre of mass. About the link's origin no rigid body has it.",
        ],
    ]
    flown = {name: flight for name, flight in result.flights.items() if flight.bodies}
    if flown:
        best, flight = min(flown.items(), key=lambda item: item[1].precisions[-1])
        distance = max(np.abs(item.shift(-1)).max() for item in flown.values())
        rows.append(
            [
                "What remains with the noise of sensors and encoders?",
                f"Mass and principal moments are known to {flight.precisions[-1]:.2%} at worst "
                f"after {len(flight.bodies)} manoeuvres ({TITLES[best]}). The truth lies within {distance:.1f} "
                "standard deviations of every posterior mean.",
            ]
        )
    document.table(["question", "answer"], rows)


def _readings(document: Document) -> None:
    document.section("The inertia that the paper prints")
    document.paragraph(
        "The paper does not say which point its inertia is about. The principal moments of a rigid body about its "
        "centre of mass satisfy I1 + I2 ≥ I3. If the printed inertia were about the link's origin, the share m (c c 1 "
        "− c c') of 370 kg at 1.20 m, 533 kg m² about every axis across c, would have to be subtracted, and the "
        "remainder violates this condition. All results below take the inertia about the load's centre of mass."
    )
    printed = {"truth": paper.TRUTH, "guess": paper.GUESS, "result 1": paper.RESULTS[0], "result 2": paper.RESULTS[1]}
    rows = []
    for name, quantities in printed.items():
        for reading in paper.readings(quantities):
            low, middle, high = reading.moments
            rows.append(
                [
                    name,
                    reading.about,
                    ", ".join(f"{value:.1f}" for value in reading.moments),
                    f"{low + middle:.1f} {'≥' if reading.physical else '<'} {high:.1f}",
                    "yes" if reading.physical else "no",
                ]
            )
    document.table(
        ["values", "printed inertia about", "principal moments [kg m²]", "I1 + I2, I3", "rigid body"],
        rows,
        "Both readings of what is printed: principal moments about the centre of mass that follow from each, and "
        "whether a rigid body can have them.",
    )


def _noise_free(document: Document, iterations: list[Iteration]) -> None:
    document.section("Without noise and without prior")
    document.paragraph(
        f"The motion is (27): the first three joints oscillate and the wrist is extended. It lasts {DURATION:g} s "
        f"with two periods, stays within ±{RANGE:.3f} rad as in the paper, and within {LIMITS.joint_speed:g} rad/s, a "
        "limit that the paper does not state. It maximises (26) as it appears to be intended, with the sizes of the "
        "differences. MuJoCo flies it, and ten parameters are fitted to rates and accelerations by least squares. The "
        "first manoeuvre is planned with the guessed load, the second with the load identified from the first."
    )
    rows = []
    for k, title in enumerate(QUANTITY_TITLES):
        digits = ".9g" if paper.TRUTH[k] else ".0e"
        values = [format_number(paper.TRUTH[k], 6), format_number(paper.GUESS[k], 4)]
        values += [format_number(quantities[k], 6) for quantities in paper.RESULTS]
        values += [f"{item.estimate[k]:{digits}}".replace("-", "−") for item in iterations]
        rows.append([title, *values])
    rows.append(["worst relative error", "", "", *_worst([*paper.RESULTS, *(item.estimate for item in iterations)])])
    document.table(
        ["", "truth", "guess", "paper 1", "paper 2", "here 1", "here 2"],
        rows,
        "Estimates after the first and second iteration. Errors of products of inertia are relative to the moments.",
        columns("lrrrrrr"),
    )
    document.figure(error_figure(iterations), "Relative errors. What the paper prints exactly is not drawn.")
    planned = [", ".join(f"{value:.2f}" for value in item.excursion) for item in iterations]
    document.paragraph(
        f"With the guessed load, the base was expected to move by {planned[0]} (three displacements in m and three "
        f"rotations in rad); with the identified load, the plan is {planned[1]}. A load that is guessed too light "
        "makes the first manoeuvre far larger than planned. Therefore the paper asks for a conservative guess, and "
        "the loop below flies a manoeuvre only if its limits hold with 99 % probability."
    )
    document.figure(motion_figure(iterations), "Joints and rate of the base as flown.")


def _sampled(document: Document, flights: Mapping[str, Flight]) -> None:
    document.section("The loop with noise")
    if not flights:
        not_evaluated(document)
        return
    document.paragraph(
        "Rates have a noise of 1e-5 rad/s and accelerations of 1e-5 m/s² at 2 Hz, encoders of 1e-6 rad. The prior is "
        f"centred on the guess with a width of {SPREAD:g} in log-Cholesky coordinates, so that the mass may be fifty "
        "times larger or smaller. Each posterior, sampled by emcee, is the prior of the next step. There are two ways "
        "to plan: the paper's motion with its criterion; and quintic splines of all six joints with the smallest "
        f"volume of the posterior, flown only if the base turns by less than {CAREFUL.base_rotation:g} rad with 99 % "
        "probability under the prior of the load."
    )
    document.paragraph(
        f"Readings of the base's sensors within {JOLT:g} s of the places where (27) meets its connecting splines are "
        "left out. The third derivative of the joints jumps there, which no smoothing of encoder samples at 2 Hz "
        "follows: accelerations are wrong by some fifteen of their standard deviations, and with these samples the "
        "chi-square was 1715 of 1446. Splines have no such place."
    )
    steps = [(name, step) for name, item in flights.items() for step in range(len(item.bodies))]
    entries = [flights[name].identifications[step] for name, step in steps]
    rows = []
    for k, title in enumerate(QUANTITY_TITLES):
        bodies = [flights[name].bodies[step] for name, step in steps]
        cells = [format_quantity(float(body.mean[k]), float(body.sd[k])) for body in bodies]
        rows.append([title, format_number(paper.TRUTH[k], 4), *cells])
    precisions = [flights[name].precisions[step] for name, step in steps]
    rows.append(["worst of mass and moments", "", *(f"{value:.2%}" for value in precisions)])
    rows.append(["chi-square / samples", "", *(f"{entry['chi2']:.0f} / {entry['samples']}" for entry in entries)])
    document.table(
        ["", "truth", *(f"{TITLES[name]}, step {step + 1}" for name, step in steps)],
        rows,
        "Posterior mean and standard deviation after each step.",
        columns("lr" + "r" * len(steps)),
    )
    document.figure(
        width_figure(flights, TITLES),
        "Posterior standard deviations after each step, and the means of the last step beside the truth.",
    )
    if "careful" in flights:
        document.items(_attempts(flights["careful"]))
    document.items(
        [
            f"{TITLES[name]}, step {step + 1}: {sentence}"
            for (name, step), entry in zip(steps, entries, strict=True)
            for sentence in entry["disagreements"]
        ]
    )


def _attempts(flight: Flight) -> list[str]:
    sentences = []
    for number, plan in enumerate(flight.plans, start=1):
        parts = []
        for attempt in plan["attempts"]:
            limit = attempt["limits"]["base_rotation"]
            verdict = "go" if attempt["go"] else "no go"
            parts.append(
                f"the manoeuvre designed for {limit['designed_for']:.3g} rad stays below {limit['quantile_99']:.3g} "
                f"rad with 99 % probability ({verdict})"
            )
        sentences.append(f"Step {number} with the base limited: {'; '.join(parts)}.")
    if flight.status == "no-go":
        sentences.append("The loop stopped there, because it flies nothing that is not certain to be safe.")
    return sentences
