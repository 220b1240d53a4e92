"""Report of the study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bayesid.diagnosis import Diagnosis
from bayesid.report import Document, format_quantity
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_probability, format_signed
from studies.common.report_parts import columns
from studies.common.template import Setup, Summary, add_first_page, add_setup, write_study
from studies.throws.bodies import BLOCK_SD, PLATE_SD
from studies.throws.body_result import BodyResult
from studies.throws.data import EXCLUDED, INTERVAL
from studies.throws.diagnosis import SPREAD
from studies.throws.figures import left_over_figure, throws_figure
from studies.throws.goals import goals_of, held_in_all, wheel_probability
from studies.throws.shaking import shaking_words
from studies.throws.tables import write_tables

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["write_report"]


def write_report(result: Result, output: Path, origin: str | None = None) -> None:
    """Write the report as PDF, and beside it its summary and its further tables."""
    document = Document("Thrown bodies", "Real measurements of a small free-flying device with one reaction wheel")
    summary = _summary(result)
    add_first_page(
        document,
        summary,
        throws_figure(result.plain, result.extended),
        "Errors of the principal moments in single throws, with formal standard deviations: a rigid body with its "
        "wheel and nothing else (left), and with what the device and the air add (right). The grey band is the "
        "uncertainty of the stated moments.",
    )
    add_setup(document, _setup(result))
    document.section("What failed, and what cannot be told")
    document.items(_failures(result))
    _bodies(document, result)
    _diagnosis(document, result)
    _left_over(document, result)
    files = write_tables(output, result)
    document.paragraph(f"Beside this report, in SI units: {', '.join(files)}.")
    credit = "Data: Blaha, Kuijper, Pop and Smeur, arXiv:2503.13137; no measurement is reproduced here."
    write_study(document, summary, output, None if origin is None else f"{origin}. {credit}")


def _summary(result: Result) -> Summary:
    count, total = held_in_all(result)
    errors = " and ".join(
        f"{body.mean_error:.2f} % ({body.name}, stated to {_uncertain(body)} %; rigid body: "
        f"{result.plain.bodies[body.name].mean_error:.2f} %)"
        for body in result.extended.bodies.values()
    )
    named = sum(bool(study.diagnosis.verdict.causes) for study in result.studies)
    said = f", and a cause is named on {named} of {len(result.studies)} bodies" if result.studies else ""
    return Summary(
        question="How well does half a second of real flight tell the principal moments of inertia, do the intervals "
        "hold, and does the diagnosis say what a rigid body with its wheel lacks?",
        answer=f"Principal moments of single throws differ from the stated moments, which are uncertain themselves, by "
        f"{errors} in the mean, {count} of {total} of their 95 % intervals hold the stated moments{said}.",
        goals=tuple(goals_of(result)),
        valid="the wheel's momentum is recorded and one throw series on a box of known inertia gives its scale. Four "
        "choices were made while looking at these throws, so that this is no blind test.",
        full=bool(result.studies and result.wheels),
    )


def _uncertain(body: BodyResult) -> str:
    """Return the uncertainty of a body's stated moments [%], as a range where it differs."""
    percent = 100.0 * body.truth_sd / body.truth
    low, high = (format_number(float(end), 2) for end in (percent.min(), percent.max()))
    return low if low == high else f"{low} to {high}"


def _setup(result: Result) -> Setup:
    throws = {name: len(left.names) for name, left in result.extended.left.items()}
    excluded = "; ".join(f"{name}, because {reason}" for name, reason in EXCLUDED.items())
    return Setup(
        robot="A device with one reaction wheel, alone (cal_device), on a box of known inertia (cal_proof), on a plate "
        "(Empty), and on the plate with blocks (A).",
        manoeuvre="Thrown by hand and caught; the wheel spins up and down in flight. There is no rule of speed.",
        sensors=f"Gyro, accelerometer and wheel speed, raw at 4 kHz. Samples every {1e3 * INTERVAL:g} ms are local "
        "parabolas with Gaussian weights, whose neighbours are uncorrelated; their noise is measured on quiet "
        "stretches, by body and axis. Samples next to the largest accelerations of the wheel (12000 rad/s² within "
        "4 ms) and the last 20 ms are left out.",
        known=f"Mass, and the stated moments, which are taken as uncertain by {100 * PLATE_SD:.0f} % for the plate "
        f"(CAD) and by {100 * BLOCK_SD:.1f} % for what blocks add (our numbers). Inertias are relative to the wheel's, "
        "which the box gives; the device is taken off with the parallel-axis theorem.",
        unknown="Ten parameters of each body (prior of 100 % about a regression that needs its mass alone), cross-axis "
        "terms of the gyro, tilt and delay of the wheel, drag, and a torque and a specific force per throw that are "
        f"piecewise linear over 32 ms. In the diagnosis the body is known to {100 * SPREAD:g} % about the regression; "
        "friction of the wheel's own axis and noise that depends on acceleration are no candidates.",
        replicates=f"{sum(throws.values())} throws: {', '.join(f'{name} {count}' for name, count in throws.items())}. "
        f"Left out: {excluded}.",
    )


def _failures(result: Result) -> list[str]:
    plain = result.plain.bodies.values()
    both, total = held_in_all(result, with_truth=True)
    factors = [factor.max() for factor in result.extended.noise.values()]
    unsaid = [study.body for study in result.studies if not study.diagnosis.verdict.causes]
    texts = []
    if unsaid:
        texts.append(
            f"No cause is named on {', '.join(unsaid)}: what the best known causes leave there is more than noise, and "
            "the verdict is that it is unknown."
        )
    for study in result.studies:
        if study.body in result.plain.bodies:
            errors = (result.errors[model][study.body] for model in ("rigid", "extended"))
            rigid, extended = (" / ".join(format_signed(value) for value in row) for row in errors)
            texts.append(
                f"{study.body}, from the one diagnosed throw: the three moments are wrong by {rigid} % with the rigid "
                f"model and by {extended} % with the extension that was found."
            )
    texts += [
        "A rigid body with its wheel and nothing else states standard deviations of single throws that are "
        f"{' and '.join(f'{body.inflation:.0f} times ({body.name})' for body in plain)} too small, by the scatter of "
        "the throws alone.",
        "Four choices were made while looking at these throws: the delay of the wheel's reading, the wheel "
        "acceleration beyond which samples are left out, that a smooth force is fitted beside the torque, and that the "
        "noise in flight is scaled. The sizes of the last two follow from each body's throws by marginal likelihood; "
        "the first two are constants of the reader.",
        "Every throw of a body shares the error of its stated geometry and of the wheel's inertia. Intervals that "
        f"count both hold {both} of {total}.",
        "In flight the samples vary about the smooth model by up to "
        f"{format_fixed(min(factors), 1)} to {format_fixed(max(factors), 1)} times as much as quiet stretches do, by "
        "body.",
        "The gyro's scale cannot be told from the wheel's inertia; a shift of the wheel's place is not a candidate.",
    ]
    for body, widths in result.extended.widths.items():
        if widths["smooth-torque"].doubtful:
            texts.append(f"{body}: the unexplained torque is {widths['smooth-torque'].ratio:.2f} times its prior sd.")
    return texts


def _bodies(document: Document, result: Result) -> None:
    document.section("The bodies against their geometry")
    rows = []
    for body in result.extended.bodies.values():
        for k, name in enumerate(("smallest", "middle", "largest")):
            truth, errors = body.truth[k], body.errors[:, k]
            single = 100.0 * np.sqrt((body.formal[:, k] ** 2).mean()) / truth
            widths = (100.0 * sd[k] / truth for sd in (body.joint_formal, body.joint_jackknife))
            rows.append(
                [
                    *(body.name, name, format_quantity(1e6 * truth, 1e6 * body.truth_sd[k])),
                    f"{format_signed(errors.mean(), 2)} ± {errors.std(ddof=1):.2f}",
                    f"{single:.2f}",
                    format_signed(body.joint_errors[k], 2),
                    *(f"{width:.2f}" for width in widths),
                ]
            )
    extended = result.extended
    settled = "converged" if extended.converged and result.plain.converged else "did not all converge"
    document.table(
        ["body", "moment", "stated [mg m²]", "single [%]", "sd [%]", "joint [%]", "sd [%]", "jackknife [%]"],
        rows,
        "Errors of principal moments with the extended model: mean and scatter of single throws, and the joint fit of "
        f"all throws; sd is the formal one. The joint fits {settled}. The wheel's inertia is "
        f"{1e6 * extended.wheel:.4f} mg m², with sd {1e6 * extended.wheel_formal:.4f} formal and "
        f"{1e6 * extended.wheel_jackknife:.4f} by jackknife.",
        columns("llrrrrrr"),
    )


def _diagnosis(document: Document, result: Result) -> None:
    if not result.studies:
        return
    document.section("What the diagnosis says")
    document.table(
        ["body", "verdict", "unknown", "most probable set", "chi-square", "gain", "wheel about z"],
        [
            [
                study.body,
                study.diagnosis.verdict.status.value,
                format_probability(study.diagnosis.probabilities.unknown),
                _likely(study.diagnosis),
                format_number(study.diagnosis.gain.before.chi2_per_sample),
                f"{format_number(study.held_out.gain.sum())}, {(study.held_out.gain > 0.0).sum()} of "
                f"{len(study.held_out.gain)}",
                _dropped(result, study.body),
            ]
            for study in result.studies
        ],
        "The first throw of each body, diagnosed from its data alone: verdict, probability of something unknown, most "
        "probable set of causes, chi-square per sample of the rigid model, and what the extension gains in log score "
        "on throws left out, with the number of those that it predicts better. Last: the same throw without its "
        "recorded wheel, probability of a wheel of unknown course about the right axis and the verdict.",
        columns("lllllll"),
    )
    if result.wheels:
        minutes = format_number(result.reverse_seconds / 60.0, 2)
        held = sum(found.held for found in result.wheels.values())
        chi2 = [found.gain.before.chi2_per_sample for found in result.wheels.values()]
        document.paragraph(
            "Without the recorded wheel a rigid body leaves chi-square per sample of "
            f"{format_number(min(chi2), 2)} to {format_number(max(chi2), 2)}, and its fit diverges; on {held} of "
            f"{len(result.wheels)} bodies the body is held at its prior and causes are weighed along the motion that "
            f"the data show. This took {minutes} minutes. The verdict is unknown wherever the named causes leave more "
            "than noise."
        )


def _likely(found: Diagnosis) -> str:
    best = found.probabilities.sets[0]
    return f"{' + '.join(best.names) or 'nothing'} ({format_percent(best.probability)})"


def _dropped(result: Result, body: str) -> str:
    if body not in result.wheels:
        return "not run"
    found = result.wheels[body]
    return f"{format_probability(wheel_probability(found))}, {found.verdict.status.value}"


def _left_over(document: Document, result: Result) -> None:
    document.section("What stays unexplained")
    document.items(shaking_words(result.extended.left, result.pairs))
    document.figure(
        left_over_figure(result.extended.left),
        "What is left, mean over throws. Left: amplitude of the residual of the samples; the bands are the recorded "
        "wheel's frequency where it idles. Right: amplitude of the raw accelerometer at multiples of the recorded "
        "wheel's frequency while it coasts at speed; the line is the loudest.",
    )
