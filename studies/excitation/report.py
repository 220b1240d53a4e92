"""Report of the study."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, curve_style, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_signed
from bayesid.report.tables.design_tables import sd_rows
from bayesid.robot.log_cholesky import LOG_CHOLESKY
from studies.common.report_parts import QUANTITY_TITLES, columns
from studies.excitation import Result
from studies.excitation.contest import Contest

__all__ = ["write_report"]

TITLES = {
    "printed": "the paper's optimum, as printed",
    "poor": "its poor neighbour",
    "27: paper-26": "(26), motion (27)",
    "27: d-optimal": "d-optimal, motion (27)",
    "paper-26": "(26) as printed",
    "paper-26-intended": "(26) as intended",
    "condition-number": "condition number",
    "d-optimal": "d-optimal",
    "a-optimal": "a-optimal",
    "e-optimal": "e-optimal",
    "information-gain": "information gain",
    "wrong guess": "d-optimal for the paper's wrong guess",
}
"""Titles of the manoeuvres."""

SHOWN = ("printed", "paper-26", "condition-number", "d-optimal")
"""Manoeuvres that are drawn, and whose standard deviations are listed."""


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Manoeuvres compared by the posterior they lead to", "Sections 3.2, 3.3 and 4.1 of the paper")
    document.section("Question and answer")
    document.paragraph(
        "Which manoeuvre of ETS-VII tells most about its base? All manoeuvres last 120 s, start and end at rest with "
        "the wrist extended, and keep the same limits. Rates have a noise of 1e-5 rad/s and accelerations of 1e-5 "
        "m/s² at 2 Hz, encoders of 1e-6 rad. The accelerometer's bias (prior 1e-4 m/s²) and the initial rate are "
        "unknown and marginalised; the arm is known. The predicted posterior is that of the problem linearised at the "
        "true base, and sd stands for standard deviation throughout."
    )
    document.items(_answers(result))
    for name, contest in result.contests.items():
        _contest(document, name, contest)
    _realised(document, result)
    document.section("Is excitation the same as base motion?")
    document.paragraph(
        "Random manoeuvres were drawn within the flight's rule, each a random part of the largest that keeps it. If "
        "base motion were what tells most, criterion (26) would rank them as the posterior does."
    )
    document.figure(
        _cloud_figure(result),
        "Information (minus half the log-determinant of the posterior covariance of the log-Cholesky coordinates) of "
        "random manoeuvres against (26) as printed, (26) as intended, and the plain sum of the squared largest "
        "excursions. The horizontal scale is logarithmic to either side of a linear part about zero.",
    )
    document.section("The weights of the errors, (25)")
    document.figure(
        _weight_figure(result),
        "Sensitivities along the paper's manoeuvre and its poor neighbour without a rule for the tip: change of rate "
        "and acceleration per unit of each log-Cholesky coordinate of the base, in standard deviations of a sample.",
    )
    document.write(output)


def _answers(result: Result) -> list[str]:
    texts = []
    for name, contest in result.contests.items():
        best = contest.relative("d-optimal")[2]
        texts.append(
            f"{name.capitalize()}, the geometric mean of the d-optimal manoeuvre's sds is {1.0 / best:.2f} times "
            "smaller than that of (26) with the same splines (goal 2), "
            f"{contest.relative('condition-number')[2] / best:.2f} times smaller than that of the condition number "
            f"(goal 1.3), and {contest.relative('printed')[2] / best:.2f} times smaller than that of the paper's "
            "printed optimum."
        )
    for (name, design), item in result.realised.items():
        if design == "d-optimal":
            texts.append(
                f"{name.capitalize()}, the errors realised over {len(item.errors)} noisy recordings of an independent "
                f"simulator are {item.ratio:.3f} of the predicted sd in the geometric mean (goal: within 10 %) and "
                f"{item.rms.min():.2f} to {item.rms.max():.2f} by parameter, each with a standard error of "
                f"{item.rms_error:.2f}."
            )
    cloud = result.clouds["splines, six joints"]
    printed, motion = ("{:.2f} ± {:.2f}".format(*cloud.correlation(x)) for x in (cloud.printed, cloud.motion))
    texts.append(
        f"Over random manoeuvres, the rank correlation of the information with (26) as printed is {printed}, and with "
        f"the plain sum of the squared excursions {motion}."
    )
    return texts


def _contest(document: Document, name: str, contest: Contest) -> None:
    document.section(f"Manoeuvres {name}")
    rows = []
    for key, item in contest.designs.items():
        difference, worst, mean = contest.relative(key)
        active = ", ".join(reached.name.replace("joint_", "") for reached in item.reached if reached.active)
        numbers = ((difference, 3), (worst, 2), (mean, 3), (item.predicted.worst, 2))
        rows.append([TITLES[key], *(format_number(value, digits) for value, digits in numbers), active or "none"])
    document.table(
        ["manoeuvre", "log det − (26)", "worst / (26)", "mean sd / (26)", "worst", "active limits"],
        rows,
        "Predicted posterior: log-determinant of the covariance of mass, centre of mass and inertia less that of (26) "
        "as printed with splines on all joints; sd of the log-Cholesky coordinates along the worst direction, and "
        "geometric mean of the ten sds, over those of (26); the worst sd itself; limits filled to more than 97 %.",
        columns("lrrrrl"),
    )
    scaled = [f"{TITLES[key]} by {format_number(value, 3)}" for key, value in contest.shrink.items() if value < 1.0]
    if scaled:
        document.paragraph(f"Made smaller, towards rest, to keep the limits: {'; '.join(scaled)}.")
    shown = {TITLES[key]: contest.designs[key] for key in SHOWN if key in contest.designs}
    document.table(
        ["parameter", "unit", "true", *shown],
        sd_rows(list(shown.values())),
        "Predicted posterior standard deviations.",
        columns("llr" + "r" * len(shown)),
    )
    document.figure(
        _motion_figure(contest), "Joint positions, speed of the tip and rotation of the base since the start."
    )


def _realised(document: Document, result: Result) -> None:
    document.section("Predicted, sampled and realised")
    document.paragraph(
        "Some designs were flown by MuJoCo with fresh noise of sensors and encoders and a fresh accelerometer bias "
        "each time, and the base was identified by the mode of the posterior. One recording of each was also sampled "
        "with emcee."
    )
    for (name, key), item in result.realised.items():
        document.table(
            ["parameter", "predicted sd", "emcee sd / predicted", "rms error / predicted", "emcee mean − truth, sd"],
            [
                [
                    title,
                    format_number(float(item.predicted[row]), 3),
                    format_fixed(item.sampled[row] / item.predicted[row], 3),
                    format_fixed(item.rms[row], 3),
                    format_signed(item.offset[row] / item.sampled[row], 2),
                ]
                for row, title in enumerate(QUANTITY_TITLES)
            ],
            f"{TITLES[key]}, {name}: errors of {len(item.errors)} recordings, so that each rms is known to "
            f"{100.0 * item.rms_error:.1f} %. The squared distance of the truth in the predicted covariance is "
            f"{item.distances.mean():.2f} on average (expected: 10 ± {np.sqrt(20.0 / len(item.distances)):.2f}).",
            columns("lrrrr"),
        )


@styled
def _motion_figure(contest: Contest) -> Figure:
    keys = [key for key in SHOWN if key in contest.designs]
    figure = wide_figure(5.2)
    panels = figure.subplots(3, len(keys), sharex=True, sharey="row", squeeze=False)
    for (top, middle, bottom), key in zip(panels.T, keys, strict=True):
        trajectory = contest.designs[key].trajectory
        for joint in range(6):
            label = f"joint {joint + 1}" if key == keys[0] else None
            top.plot(trajectory.time, trajectory.position[:, joint], label=label, **curve_style(joint))
        middle.plot(trajectory.time, 1e3 * np.asarray(trajectory.tip_speed), color=COLOURS[0])
        if contest.limits.tip_speed is not None:
            middle.axhline(1e3 * contest.limits.tip_speed, color="black", linestyle=":", linewidth=0.8)
        bottom.plot(trajectory.time, np.degrees(trajectory.rotation), color=COLOURS[1])
        top.set_title(TITLES[key], fontsize=6.5)
        bottom.set_xlabel("time [s]")
    for axes, label in zip(panels[:, 0], ("joints [rad]", "tip speed [mm/s]", "base rotation [deg]"), strict=True):
        axes.set_ylabel(label)
    shared_legend(figure, panels[0, 0], 6)
    return figure


@styled
def _cloud_figure(result: Result) -> Figure:
    figure = wide_figure(2.3 * len(result.clouds))
    panels = figure.subplots(len(result.clouds), 3, squeeze=False)
    titles = ("(26) as printed", "(26) as intended", "sum of squared excursions")
    for row, (family, cloud) in zip(panels, result.clouds.items(), strict=True):
        for axes, title, values in zip(row, titles, (cloud.printed, cloud.intended, cloud.motion), strict=True):
            axes.plot(values, -0.5 * cloud.log_det, ".", color=COLOURS[0], markersize=2.5)
            axes.set_xscale("symlog", linthresh=max(float(np.quantile(np.abs(values), 0.1)), 1e-12), linscale=0.3)
            rho, error = cloud.correlation(values)
            axes.set_title(f"rank correlation {rho:.2f} ± {error:.2f}", fontsize=6.5)
            axes.set_xlabel(f"{title} [m², rad²]")
            axes.tick_params(axis="x", labelsize=5, labelrotation=45)
        row[0].set_ylabel(f"{family}\ninformation [nats]")
    return figure


@styled
def _weight_figure(result: Result) -> Figure:
    figure = wide_figure(4.2)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for (top, bottom), (name, weights) in zip(panels.T, result.sensitivities.items(), strict=True):
        for axes, values in ((top, weights.rate), (bottom, weights.accel)):
            for k, key in enumerate(LOG_CHOLESKY):
                axes.semilogy(weights.time, np.maximum(values[:, k], 1e-3), label=key, **curve_style(k))
        top.set_title(TITLES[name])
        bottom.set_xlabel("time [s]")
    panels[0, 0].set_ylabel("rate [standard deviations]")
    panels[1, 0].set_ylabel("acceleration [standard deviations]")
    shared_legend(figure, panels[0, 0], 10)
    return figure
