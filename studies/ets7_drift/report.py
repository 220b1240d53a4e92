"""Report of the study."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.report import Document, format_quantity
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_number, format_probability, format_signed, format_unit, format_vector
from bayesid.report.sentences.set_words import set_text
from bayesid.report.tables.probability_tables import set_rows
from studies.common.ets7 import RADIUS, RAMPS
from studies.common.report_parts import QUANTITY_TITLES, columns, not_evaluated
from studies.ets7_drift.analysis import CAUSES, Case, Step
from studies.ets7_drift.world import ATTITUDE_SIGMA, ENCODER_SIGMA, INTERVAL, MOMENTUM, RATE, RATE_SIGMA, TRUE_SPREAD

__all__ = ["attitude_figure", "error_figure", "write_report"]

SHOWN = 6
"""Number of sets in the table of the most probable ones."""

NOISE = float(np.degrees(np.sqrt(3.0) * ATTITUDE_SIGMA))
"""Expected size of the attitude's noise [degrees]."""


def write_report(cases: Mapping[str, Case], output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Drift of ETS-VII", "Section 2.1 and figure 2 of Lampariello and Hirzinger (IDETC 2005)")
    case = cases["main"]
    _answer(document, case)
    _drift(document, case)
    _causes(document, case)
    _measured(document, case)
    if "loose" in cases:
        _harder(document, cases["loose"])
    else:
        not_evaluated(document, "A base hardly known")
    _assumed(document, case)
    document.write(output)


def _answer(document: Document, case: Case) -> None:
    document.section("Question and answer")
    document.paragraph(
        "With attitude control off, the attitude of ETS-VII drifted away from its simulation (the paper's figure 2). "
        "The paper attributes this to gravity gradient, momentum left in the reaction wheels and a non-zero initial "
        "rate. Here an independent simulator makes recordings with all three; the simulation knows the orbit, starts "
        "at rest and has no effect. The diagnosis uses the rates and joints alone and is to name the causes. It does "
        "not use the measured attitude, so that the attitude simulated with the named causes is a prediction."
    )
    document.paragraph(_verdict(case))


def _verdict(case: Case) -> str:
    verdict = case.diagnosis.verdict
    text = f"The verdict is {verdict.status.value}, and the causes named are: {', '.join(verdict.causes) or 'none'}."
    if case.right:
        text += " These are the three true causes and no other."
    else:
        missed = [cause for cause in CAUSES if cause not in verdict.causes]
        wrong = [cause for cause in verdict.causes if cause not in CAUSES]
        text += f" Missed: {', '.join(missed) or 'none'}; wrongly named: {', '.join(wrong) or 'none'}."
    text += f" The probability of the three together, with nothing beside them, is {format_probability(_true(case))}."
    if verdict.ambiguous_with:
        text += f" Other explanations: {'; '.join(map(set_text, verdict.ambiguous_with))}."
    if verdict.equivalent_to:
        others = "; ".join(f"{', '.join(names)} for {cause}" for cause, names in verdict.equivalent_to.items())
        text += f" Other names of the same change: {others}."
    return text


def _true(case: Case) -> float:
    """Return the probability of the three true causes and nothing else."""
    sets = case.diagnosis.probabilities.sets
    return sum(item.probability for item in sets if item.generic is None and set(item.causes) == set(CAUSES))


def _drift(document: Document, case: Case) -> None:
    document.section("The drift")
    document.figure(
        attitude_figure(case),
        "The paper's figure 2 with its remedy: Euler angles of the base since the start of the recording, measured, "
        "simulated before, and simulated after. The short bump between 60 and 145 s is the motion of the arm. Where "
        "the extended model agrees with the measurement, its dots hide the curve.",
    )
    document.figure(
        error_figure(case),
        "Angle between measured and simulated attitude. The grey line is the expected size of the attitude's noise.",
        "80%",
    )
    document.table(
        ["recording", "as it stands", "base fitted", "extended"],
        [
            [manoeuvre.recording.name, *(f"{attitude.errors[key]:.4f}" for key in ("plain", "fitted", "extended"))]
            for manoeuvre, attitude in zip(case.world.manoeuvres, case.attitudes, strict=True)
        ],
        "Root mean square angle between measured and simulated attitude [degrees], where noise alone makes "
        f"{NOISE:.4f} degrees. 'Base fitted' is the present model after its base was fitted to the rates as well as "
        "it can be.",
        columns("lrrr"),
    )


def _steps(document: Document, case: Case, caption: str) -> None:
    """Write a table of the most probable set of each number of causes."""
    document.table(
        ["causes", "probability", "log evidence", "chi-square per sample"],
        [_step_row(step) for step in case.steps],
        caption,
        columns("lrrr"),
    )


def _step_row(step: Step) -> list[str]:
    fit = step.fitted.fit
    return [
        set_text(step.found.causes),
        format_probability(step.found.probability),
        format_signed(step.found.log_evidence) if step.found.causes else "0",
        format_number(fit.chi2 / fit.posterior.samples),
    ]


def _causes(document: Document, case: Case) -> None:
    document.section("The causes, one by one")
    named = " of the named causes" if case.diagnosis.verdict.causes else ""
    sets = case.diagnosis.probabilities.sets
    _steps(
        document,
        case,
        f"The most probable sets{named} with none to three causes, each fitted. The probability is that of the set "
        "alone, and the log evidence is relative to nothing.",
    )
    document.table(
        ["causes", "probability", "log evidence", "size", "bound", "share of the bound"],
        set_rows(case.diagnosis, SHOWN),
        f"The {min(SHOWN, len(sets))} most probable of all {len(sets)} sets considered. Sizes are root mean squares of "
        "the amplitudes that share a unit, by the linear model.",
        columns("lrrlrr"),
    )


def _measured(document: Document, case: Case) -> None:
    document.section("Amplitudes and base body")
    if case.amplitudes:
        document.table(
            ["amplitude", "unit", "true", "estimate ± sd", "distance [sd]"],
            [
                [
                    item.name,
                    format_unit(item.unit),
                    format_number(item.truth),
                    format_quantity(item.mean, item.sd),
                    format_signed(item.distance, 2),
                ]
                for item in case.amplitudes
            ],
            "Amplitudes with their standard deviation (sd), all causes fitted together. The gravity gradient has no "
            "amplitude.",
            columns("llrrr"),
        )
    else:
        document.paragraph("Nothing is named, so that there is no amplitude to compare.")
    before, after = case.diagnosis.gain.before.bodies, case.diagnosis.gain.after.bodies
    rows = []
    for k, title in enumerate(QUANTITY_TITLES):
        truth, cells = float(case.world.base[k]), []
        for bodies in (before, after):
            mean, sd = float(bodies.mean[k]), float(bodies.sd[k])
            cells += [format_quantity(mean, sd), format_signed((mean - truth) / sd)]
        rows.append([title, f"{truth:.4g}", *cells])
    document.table(
        ["base", "true", "before ± sd", "error [sd]", "after ± sd", "error [sd]"],
        rows,
        "The base body, before and after the extension. "
        + (
            "Every fit of the present model attributes the drift to the base and drives it to where its prior all but "
            "excludes it, so the base stays at the prior before the extension."
            if case.diagnosis.held
            else "The present model attributes the drift to the base, which biases its estimates."
        ),
        columns("lrrrrr"),
    )
    document.paragraph(_gain_sentence(case))


def _gain_sentence(case: Case) -> str:
    before, after = case.diagnosis.gain.before, case.diagnosis.gain.after
    text = (
        f"The chi-square per sample is {format_number(before.chi2_per_sample)} before and {after.chi2_per_sample:.3f} "
        "after the extension."
    )
    if before.held_out is not None and after.held_out is not None:
        scores = (format_number(float(held_out.sum()), 4) for held_out in (before.held_out, after.held_out))
        text += " The log score of recordings left out is {} before and {} after.".format(*scores)
    return text


def _harder(document: Document, case: Case) -> None:
    document.section("A base hardly known")
    document.paragraph(
        f"Here the base is known to a relative width of {100.0 * case.spread:g} %, and the wheel momentum is "
        f"{format_vector(case.world.momentum, 2)} N m s. {_verdict(case)} {_gain_sentence(case)}"
    )
    _steps(document, case, "The most probable set of each number of causes.")
    if case.amplitudes:
        distance = max(abs(item.distance) for item in case.amplitudes)
        document.paragraph(f"Amplitudes lie at most {distance:.1f} standard deviations from the truth.")
    if not case.right and not case.diagnosis.verdict.causes:
        off = (case.diagnosis.gain.before.bodies.mean[0] / case.world.base[0] - 1.0) * 100.0
        document.paragraph(
            "The fit of the present model, about which the causes are weighed at first, lets the base imitate the "
            f"drift: its mass is {off:+.0f} % wrong."
        )


def _assumed(document: Document, case: Case) -> None:
    document.section("Assumptions")
    ramps = " and ".join(f"{start:g} to {stop:g} s" for start, stop in RAMPS)
    document.items(
        [
            "We know of no public flight telemetry, wheel momentum or drift of ETS-VII. All numbers of the "
            "disturbances are assumed, and the recordings are simulated.",
            f"The manoeuvre moves joints 2 to 4 by 0.264, −0.321 and 0.057 rad out and back, over {ramps}: amplitudes "
            "and times of a flight manoeuvre, its piecewise linear ramps replaced by quintic ones.",
            f"The wheel momentum of {format_vector(MOMENTUM)} N m s is constant. Initial rates are drawn with a "
            f"standard deviation of {format_number(RATE)} rad/s per axis, attitudes from all rotations, and places "
            f"from all of the circular orbit of {RADIUS / 1e3:g} km.",
            f"The true base is drawn within {100.0 * TRUE_SPREAD:g} % (log-Cholesky) of the paper's; the model knows "
            f"the paper's to {100.0 * case.spread:g} %. The links are known exactly.",
            f"The noise per sample, every {INTERVAL:g} s, is {format_number(RATE_SIGMA)} rad/s of the rates (the "
            f"paper's star sensor: 2 arcsec), {format_number(ATTITUDE_SIGMA)} rad of the attitude and "
            f"{format_number(ENCODER_SIGMA)} rad of the joints. The attitude at the start is exact.",
            "The candidates are the whole catalogue of effects that can occur in this case.",
        ]
    )


@styled
def attitude_figure(case: Case) -> Figure:
    """Draw the paper's figure 2, one row per recording."""
    figure = wide_figure(1.75 * len(case.attitudes) + 0.3)
    panels = figure.subplots(len(case.attitudes), 3, squeeze=False, sharex=True)
    after = {"color": COLOURS[0], "linestyle": "", "marker": ".", "markersize": 3.5, "label": "simulated after"}
    for row, attitude, manoeuvre in zip(panels, case.attitudes, case.world.manoeuvres, strict=True):
        for axis, axes in enumerate(row):
            axes.plot(attitude.time, attitude.measured[:, axis], color="#000000", label="measured")
            axes.plot(attitude.time, attitude.plain[:, axis], "--", color=COLOURS[1], label="simulated before")
            axes.plot(attitude.time[::12], attitude.extended[::12, axis], **after)
        row[0].set_ylabel(f"{manoeuvre.recording.name} [deg]")
    for axis, name in enumerate("xyz"):
        panels[0, axis].set_title(f"angle about {name}")
        panels[-1, axis].set_xlabel("time [s]")
    panels[0, 0].legend()
    return figure


@styled
def error_figure(case: Case) -> Figure:
    """Draw the size of the attitude's error against time."""
    figure = wide_figure(2.4)
    axes = figure.subplots()
    for colour, attitude, manoeuvre in zip(COLOURS, case.attitudes, case.world.manoeuvres, strict=False):
        for name, values, style in (("before", attitude.plain, "--"), ("after", attitude.extended, "-")):
            size = np.linalg.norm(values - attitude.measured, axis=1)
            label = f"{manoeuvre.recording.name}, {name}"
            axes.plot(attitude.time, size, color=colour, linestyle=style, label=label)
    axes.axhline(NOISE, color="#888888", linewidth=0.8)
    axes.set(yscale="log", ylim=(1e-4, None), xlabel="time [s]", ylabel="error [deg]")
    axes.legend(ncols=len(case.attitudes))
    return figure
