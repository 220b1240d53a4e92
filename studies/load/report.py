"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report import Document, format_quantity
from bayesid.report.numbers import format_number, format_unit
from studies.load import paper
from studies.load.figures import error_figure, motion_figure, width_figure
from studies.load.noise_free import Iteration, errors
from studies.load.sampled import CAREFUL, SPREAD, Flight
from studies.load.setting import DURATION, JOLT, LIMITS, RANGE

__all__ = ["write"]

GOAL = 1e-6

TITLES = {
    "paper": "paper's motion and criterion",
    "careful": "splines, d-optimal, base limited",
}


def write(iterations: Sequence[Iteration], flights: Mapping[str, Flight], output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Load on ETS-VII", "Section 4.2 of Lampariello and Hirzinger (IDETC 2005), beside the paper")
    _goals(document, iterations, flights)
    _readings(document)
    _noise_free(document, iterations)
    _sampled(document, flights)
    document.write(output)


def _goals(document: Document, iterations: Sequence[Iteration], flights: Mapping[str, Flight]) -> None:
    document.section("What was asked, and what came out")
    worst = [f"{item.worst:.1e}" for item in iterations]
    printed = [f"{np.abs(errors(result)).max():.1e}" for result in paper.RESULTS]
    rows = [
        [
            "Load of 370 kg from a guess of 10 kg, without noise, within 1e-6 after two iterations?",
            f"{'Yes' if iterations[-1].worst < GOAL else 'No'}: worst relative error {worst[0]}, then {worst[1]} "
            f"(paper: {printed[0]}, then {printed[1]}).",
        ],
        [
            "Which point is the printed inertia about?",
            "The load's centre of mass. About the link's origin no rigid body has it.",
        ],
    ]
    done = {name: flight for name, flight in flights.items() if flight.bodies}
    if done:
        best = min(done, key=lambda name: done[name].identifications[-1]["precision"])
        rows.append(
            [
                "And with sensor and encoder noise?",
                f"Mass and principal moments to {done[best].identifications[-1]['precision']:.2%} at worst after "
                f"{len(done[best].bodies)} manoeuvres ({TITLES[best]}); the truth is within "
                f"{max(np.abs(flight.shift(len(flight.bodies) - 1)).max() for flight in done.values()):.1f} sd "
                "of every posterior mean.",
            ]
        )
    document.table(["question", "answer"], rows)


def _readings(document: Document) -> None:
    document.section("The inertia the paper prints")
    document.paragraph(
        "The paper does not say which point its inertia is about. A rigid body's principal moments about its centre of "
        "mass satisfy I1 + I2 >= I3. Taken about the link's origin, the share m (c c 1 - c c') of 370 kg at 1.20 m, "
        "533 kg m2 about every axis across c, has to be subtracted, and what is left fails. All below "
        "takes it about the load's centre of mass."
    )
    rows = []
    for name, quantities in (
        ("truth", paper.TRUTH),
        ("guess", paper.GUESS),
        ("result 1", paper.RESULTS[0]),
        ("result 2", paper.RESULTS[1]),
    ):
        for reading in paper.readings(quantities):
            low, middle, high = reading.moments
            rows.append(
                [
                    name,
                    reading.about,
                    ", ".join(f"{value:.1f}" for value in reading.moments),
                    f"{low + middle:.1f} {'>=' if reading.physical else '<'} {high:.1f}",
                    "yes" if reading.physical else "no",
                ]
            )
    document.table(
        ["values", "printed inertia about", "principal moments about c [kg m2]", "I1 + I2, I3", "a body?"],
        rows,
        caption="Both readings of what is printed.",
    )


def _noise_free(document: Document, iterations: Sequence[Iteration]) -> None:
    document.section("Without noise and without prior")
    document.paragraph(
        f"The motion is (27): the first three joints oscillate, the wrist is extended. It lasts {DURATION:g} s with "
        f"two periods, stays within ±{RANGE:.3f} rad as in the paper, and within {LIMITS.joint_speed:g} rad/s, which "
        "the paper does not state. It maximises (26) as it appears to be intended, with the sizes of the differences. "
        "MuJoCo flies it, and ten parameters are fitted to rates and accelerations by least squares. The first "
        "manoeuvre is planned with the load guessed, the second with the load found."
    )
    rows = []
    for k, (name, unit) in enumerate(BODY_QUANTITIES.items()):
        digits = ".9g" if paper.TRUTH[k] else ".0e"
        values = [format_number(paper.TRUTH[k], 6), format_number(paper.GUESS[k], 4)]
        values += [format_number(result[k], 6) for result in paper.RESULTS]
        values += [f"{item.estimate[k]:{digits}}".replace("-", "−") for item in iterations]
        rows.append([f"{name} [{format_unit(unit)}]", *values])
    rows.append(
        ["worst relative error", "", ""]
        + [f"{np.abs(errors(result)).max():.1e}" for result in paper.RESULTS]
        + [f"{item.worst:.1e}" for item in iterations]
    )
    heads = [f"{who} {number}" for who in ("paper", "here") for number in (1, 2)]
    document.table(
        ["", "truth", "guess", *heads],
        rows,
        caption="After the first and second iteration. Errors of products of inertia are relative to the moments.",
        align=["left", *["right"] * 6],
    )
    document.figure(error_figure(iterations), "Relative errors. What the paper prints exactly is not drawn.")
    planned = [", ".join(f"{value:.2f}" for value in item.excursion) for item in iterations]
    document.paragraph(
        f"With the guess, the base was expected to move by {planned[0]} (three displacements in m, three rotations in "
        f"rad); with the load found, {planned[1]} is planned. A load guessed too light makes the first manoeuvre far "
        "larger than planned: the paper asks for a conservative guess, and the loop below for a go."
    )
    document.figure(motion_figure(iterations), "Joints and rate of the base as flown.")


def _sampled(document: Document, flights: Mapping[str, Flight]) -> None:
    document.section("The loop with noise")
    if not flights:
        document.paragraph("Not evaluated: only the full study flies with noise.")
        return
    document.paragraph(
        "Rates with 1e-5 rad/s and accelerations with 1e-5 m/s2 of noise at 2 Hz, encoders with 1e-6 rad. The prior is "
        f"centred on the guess with a width of {SPREAD:g} in log-Cholesky coordinates, so that the mass may be "
        "fifty times more or less. Each posterior, sampled by emcee, is the prior of the next step. Two ways to "
        "plan: the paper's motion with its criterion; and quintic splines of all six joints with the smallest "
        "volume of the posterior, flown only if the base stays within "
        f"{CAREFUL.base_rotation:g} rad with 99 % whatever the load is."
    )
    heads = [f"{TITLES[name]}, step {step + 1}" for name, item in flights.items() for step in range(len(item.bodies))]
    rows = []
    for k, (name, unit) in enumerate(BODY_QUANTITIES.items()):
        cells = [
            format_quantity(float(body.mean[k]), float(body.sd[k])) for item in flights.values() for body in item.bodies
        ]
        rows.append([f"{name} [{format_unit(unit)}]", format_number(paper.TRUTH[k], 4), *cells])
    worst = [f"{found['precision']:.2%}" for item in flights.values() for found in item.identifications]
    rows.append(["worst of mass and moments", "", *worst])
    fits = [f"{found['chi2']:.0f} / {found['samples']}" for item in flights.values() for found in item.identifications]
    rows.append(["chi-square / samples", "", *fits])
    document.paragraph(
        f"What the base's sensors read within {JOLT:g} s of where (27) meets its connecting splines is left out. The "
        "third derivative of the joints jumps there, which no smoothing of encoder samples at 2 Hz follows: "
        "accelerations are wrong by some fifteen of their standard deviations, and with these samples chi-square was "
        "1715 of 1446. "
        "Splines have no such place."
    )
    document.table(
        ["", "truth", *heads], rows, caption="Posterior mean and sd.", align=["left", *["right"] * (len(heads) + 1)]
    )
    document.figure(width_figure(flights, TITLES), "Posterior widths after each step, and the means beside the truth.")
    if "careful" in flights:
        document.items(_attempts(flights["careful"]))
    sentences = [
        f"{TITLES[name]}, step {step + 1}: {sentence}"
        for name, item in flights.items()
        for step, found in enumerate(item.identifications)
        for sentence in found["disagreements"]
    ]
    if sentences:
        document.items(sentences)


def _attempts(flight: Flight) -> list[str]:
    sentences = []
    for number, plan in enumerate(flight.plans, start=1):
        parts = []
        for attempt in plan["attempts"]:
            limit = attempt["limits"]["base_rotation"]
            verdict = "go" if attempt["go"] else "no go"
            parts.append(
                f"designed for {limit['designed_for']:.3g} rad, 99 % below {limit['quantile_99']:.3g} rad: {verdict}"
            )
        sentences.append(f"Step {number} with the base limited: {'; '.join(parts)}.")
    if flight.status == "no-go":
        sentences.append("The loop stopped there: what is not certain to be safe is not flown.")
    return sentences
