"""The study's report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, curve_style, styled, wide_figure
from bayesid.report.numbers import format_number
from bayesid.robot.log_cholesky import LOG_CHOLESKY
from studies.excitation import Result
from studies.excitation.contest import Contest
from studies.excitation.realised import Realised

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


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Manoeuvres compared by the posterior they buy", "Sections 3.2, 3.3 and 4.1 of the paper")
    document.section("What was asked, and what came out")
    document.paragraph(
        "ETS-VII is to identify its base. All manoeuvres last 120 s, start and end at rest with the wrist extended and "
        "keep the same limits; rates are read with 1e-5 rad/s and accelerations with 1e-5 m/s² at 2 Hz, encoders with "
        "1e-6 rad. The accelerometer's bias (prior 1e-4 m/s²) and the initial rate are unknown and marginalised; the "
        "arm is known. The predicted posterior is that of the linearised problem at the true base."
    )
    document.items(_findings(result))
    for name, contest in result.contests.items():
        _contest(document, name, contest)
    _realised(document, result)
    document.section("Is excitation the same as base motion?")
    document.paragraph(
        "Random manoeuvres within the flight's rule, each a random part of the largest that keeps it. If base motion "
        "were what tells most, criterion (26) would rank them as the posterior does."
    )
    document.figure(
        _cloud_figure(result),
        "Information (minus half the log-determinant of the posterior covariance of the log-Cholesky coordinates) of "
        "random manoeuvres against (26) as printed, as intended, and against the plain sum of the squared largest "
        "excursions. Logarithmic to either side of a linear part about zero.",
    )
    document.section("The weights of the errors, (25)")
    document.figure(
        _weight_figure(result),
        "Sensitivities along the paper's manoeuvre and its poor neighbour without a rule for the tip: change of rate "
        "and acceleration per unit of each log-Cholesky coordinate of the base, in sigmas of a sample.",
    )
    document.write(output)


def _findings(result: Result) -> list[str]:
    texts = []
    for name, contest in result.contests.items():
        ours = contest.relative("d-optimal")[2]
        peers = ours / contest.relative("condition-number")[2]
        texts.append(
            f"{name.capitalize()}: the d-optimal manoeuvre's geometric-mean sd is {1.0 / ours:.2f} times smaller than "
            f"that of (26) with the same splines (goal 2), {1.0 / peers:.2f} times smaller than that of the condition "
            f"number (goal 1.3), and {contest.relative('printed')[2] / ours:.2f} times smaller than that of the "
            "paper's printed optimum."
        )
    for (name, item), own in result.realised.items():
        if item == "d-optimal":
            texts.append(
                f"{name.capitalize()}: over {len(own.errors)} noisy recordings of an independent simulator the "
                f"realised errors are {own.ratio:.3f} of the predicted sd in the geometric mean (goal: within 10 %), "
                f"{own.rms.min():.2f} to {own.rms.max():.2f} by parameter, each +- {own.rms_error:.2f}."
            )
    cloud = result.clouds["splines, six joints"]
    printed, motion = cloud.correlation(cloud.printed), cloud.correlation(cloud.motion)
    texts.append(
        f"Rank correlation of information with (26) as printed over random manoeuvres: {printed[0]:.2f} +- "
        f"{printed[1]:.2f}; with the plain sum of squared excursions {motion[0]:.2f} +- {motion[1]:.2f}."
    )
    return texts


def _contest(document: Document, name: str, contest: Contest) -> None:
    document.section(f"Manoeuvres {name}")
    rows = []
    for key, item in contest.designs.items():
        difference, worst, mean = contest.relative(key)
        active = ", ".join(reached.name.replace("joint_", "") for reached in item.reached if reached.active)
        rows.append(
            [
                TITLES[key],
                format_number(difference, 3),
                format_number(worst, 2),
                format_number(mean, 3),
                format_number(item.predicted.worst, 2),
                active or "none",
            ]
        )
    document.table(
        ["manoeuvre", "log det − (26)", "worst / (26)", "mean sd / (26)", "worst", "active limits"],
        rows,
        "Predicted posterior: log-determinant of the covariance of mass, centre of mass and inertia less that of (26) "
        "as printed with splines on all joints; sd of the log-Cholesky coordinates along the worst direction, and "
        "geometric mean of the ten sds, over those of (26); the worst sd itself; limits filled to more than 97 %.",
        ["left", "right", "right", "right", "right", "left"],
    )
    scaled = [f"{TITLES[key]} by {format_number(value, 3)}" for key, value in contest.shrink.items() if value < 1.0]
    if scaled:
        document.paragraph("Made smaller, towards rest, to keep the limits: " + "; ".join(scaled) + ".")
    keys = [key for key in ("printed", "paper-26", "condition-number", "d-optimal") if key in contest.designs]
    names = contest.designs["d-optimal"].predicted.names
    document.table(
        ["parameter", *(TITLES[key] for key in keys)],
        [
            [
                f"{quantity.split('.', 1)[1]} [{unit}]",
                *(format_number(float(contest.designs[key].predicted.sd[row]), 3) for key in keys),
            ]
            for row, (quantity, unit) in enumerate(zip(names, BODY_QUANTITIES.values(), strict=True))
        ],
        "Predicted posterior standard deviations.",
        ["left", *("right" for _ in keys)],
    )
    document.figure(
        _motion_figure(contest), "Joint positions, speed of the tip and rotation of the base since the start."
    )


def _realised(document: Document, result: Result) -> None:
    document.section("Predicted, sampled and realised")
    document.paragraph(
        "Flown by MuJoCo with fresh noise of sensors and encoders and a fresh accelerometer bias each time, and "
        "identified by the mode of the posterior. One recording of each was also sampled with emcee."
    )
    for (name, key), own in result.realised.items():
        _table(document, f"{TITLES[key]}, {name}", own)


def _table(document: Document, title: str, own: Realised) -> None:
    document.table(
        ["parameter", "predicted sd", "emcee sd / predicted", "rms error / predicted", "emcee mean − truth, sd"],
        [
            [
                f"{quantity} [{unit}]",
                format_number(float(own.predicted[row]), 3),
                f"{own.sampled[row] / own.predicted[row]:.3f}",
                f"{own.rms[row]:.3f}",
                f"{own.offset[row] / own.sampled[row]:+.2f}",
            ]
            for row, (quantity, unit) in enumerate(BODY_QUANTITIES.items())
        ],
        f"{title}: {len(own.errors)} recordings, so that each rms is known to {100.0 * own.rms_error:.1f} %. Squared "
        f"distance of the truth in the predicted covariance: {own.distances.mean():.2f} on average, "
        f"10 +- {np.sqrt(20.0 / len(own.distances)):.2f} expected.",
        ["left", "right", "right", "right", "right"],
    )


@styled
def _motion_figure(contest: Contest) -> Figure:
    keys = [key for key in ("printed", "paper-26", "condition-number", "d-optimal") if key in contest.designs]
    figure = wide_figure(5.2)
    panels = figure.subplots(3, len(keys), sharex=True, sharey="row", squeeze=False)
    for column, key in enumerate(keys):
        trajectory = contest.designs[key].trajectory
        top, middle, bottom = panels[:, column]
        for joint in range(6):
            label = f"joint {joint + 1}" if column == 0 else None
            top.plot(trajectory.time, trajectory.position[:, joint], label=label, **curve_style(joint))
        middle.plot(trajectory.time, 1e3 * np.asarray(trajectory.tip_speed), color=COLOURS[0])
        if contest.limits.tip_speed is not None:
            middle.axhline(1e3 * contest.limits.tip_speed, color="black", linestyle=":", linewidth=0.8)
        bottom.plot(trajectory.time, np.degrees(trajectory.rotation), color=COLOURS[1])
        top.set_title(TITLES[key], fontsize=6.5)
        bottom.set_xlabel("time [s]")
    for axes, label in zip(panels[:, 0], ("joints [rad]", "tip speed [mm/s]", "base rotation [deg]"), strict=True):
        axes.set_ylabel(label)
    figure.legend(loc="outside upper center", ncols=6)
    return figure


@styled
def _cloud_figure(result: Result) -> Figure:
    figure = wide_figure(2.3 * len(result.clouds))
    panels = figure.subplots(len(result.clouds), 3, squeeze=False)
    for row, (family, cloud) in enumerate(result.clouds.items()):
        columns = (
            ("(26) as printed", cloud.printed),
            ("(26) as intended", cloud.intended),
            ("sum of squared excursions", cloud.motion),
        )
        for axes, (label, values) in zip(panels[row], columns, strict=True):
            axes.plot(values, -0.5 * cloud.log_det, ".", color=COLOURS[0], markersize=2.5)
            axes.set_xscale("symlog", linthresh=max(float(np.quantile(np.abs(values), 0.1)), 1e-12), linscale=0.3)
            rho, error = cloud.correlation(values)
            axes.set_title(f"rank correlation {rho:.2f} ± {error:.2f}", fontsize=6.5)
            axes.set_xlabel(f"{label} [m², rad²]")
            axes.tick_params(axis="x", labelsize=5, labelrotation=45)
        panels[row, 0].set_ylabel(f"{family}\ninformation [nats]")
    return figure


@styled
def _weight_figure(result: Result) -> Figure:
    figure = wide_figure(4.2)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for column, (name, own) in enumerate(result.sensitivities.items()):
        for axes, values in zip(panels[:, column], (own.rate, own.accel), strict=True):
            for k, key in enumerate(LOG_CHOLESKY):
                label = key if column == 0 and axes is panels[0, 0] else None
                axes.semilogy(own.time, np.maximum(values[:, k], 1e-3), label=label, **curve_style(k))
        panels[0, column].set_title(TITLES[name])
        panels[1, column].set_xlabel("time [s]")
    panels[0, 0].set_ylabel("rate [sigma]")
    panels[1, 0].set_ylabel("acceleration [sigma]")
    figure.legend(loc="outside upper center", ncols=10)
    return figure
