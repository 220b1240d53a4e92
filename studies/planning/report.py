"""The study's report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid import InertialParameters
from bayesid.pose import CONTENT
from bayesid.report import Document, figures, format_quantity
from bayesid.report.figures.style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.planning.analysis import Case, Result
from studies.planning.world import (
    ACCEL_SIGMA,
    BASE,
    ENCODER_SIGMA,
    EXCITATION,
    INITIAL_RATE,
    INTERVAL,
    RATE_SIGMA,
)

__all__ = ["miss_figure", "write_report"]

KEYS = ("mass", "centre of mass x", "centre of mass y", "centre of mass z", "Ixx", "Iyy", "Izz")
UNITS = ("kg", "m", "m", "m", "kg m²", "kg m²", "kg m²")


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("What identification buys the planner", "Section 1.1.1 of Lampariello and Hirzinger (2005)")
    document.section("What was asked, and what came out")
    document.paragraph(
        "Joint angles lead to a place in space only through the base, which moves as the arm does. A path planned in "
        "joint space with wrong inertial parameters therefore ends elsewhere. Here a path of ETS-VII is planned that "
        "is to bring the end-effector to a pose in orbit axes; an independent simulator (MuJoCo) flies it. Before the "
        "flight the prediction says where base and end-effector will end, with 95 % regions. Then the base is "
        "identified from one recorded manoeuvre, its posterior becomes the prior of the next prediction, and the path "
        "is planned again."
    )
    document.table(
        ["case", "base", "miss [mm]", "miss [degrees]"],
        [
            [case.guess.title, base, f"{1e3 * flight.miss:.3g}", f"{flight.turned:.2g}"]
            for case in result.cases.values()
            for base, flight in (("guessed", case.first), ("identified", case.again))
        ],
        "How far from its target the end-effector truly ended, planned with the guessed base and the identified one.",
        ["left", "left", "right", "right"],
    )
    document.figure(miss_figure(result), "The same, on a logarithmic scale.", "75%")
    for case in result.cases.values():
        _case(document, case)
    if len(result.cases) == 1:
        document.section("The paper's initial guess")
        document.paragraph("Not evaluated: only the full study has it.")
    _assumed(document, result)
    document.write(output)


def _case(document: Document, case: Case) -> None:
    document.section(case.guess.title)
    document.table(
        [
            "path and prior",
            "body",
            "error [mm]",
            "95 % semi-axes [mm]",
            "inside",
            "error [deg]",
            "95 % [deg]",
            "inside",
        ],
        _rows(case),
        "Predicted against flown final poses: distance of the predicted mean from the truth, semi-axes of the 95 % "
        "ellipsoid (of the rotation, the longest), and whether the region holds the truth.",
        ["left", "left", "right", "right", "left", "right", "right", "left"],
    )
    before, after, again = case.trials
    document.figure(
        figures.final_positions({"guessed base": before.pose("tip")}, case.first.flown.tip[0]),
        "Final position of the end-effector on the first path as predicted before identification, orbit axes, from "
        "where it truly ended: draws, and the outline of the 95 % ellipsoid.",
    )
    document.figure(
        figures.final_positions({"identified base": after.pose("tip")}, case.first.flown.tip[0]),
        "The same path predicted with the identified base. Mind the scale.",
    )
    rows = [
        [key, unit, format_number(float(t), 5), format_number(float(g), 5), format_quantity(float(m), float(s))]
        for key, unit, t, g, m, s in zip(
            KEYS,
            UNITS,
            _reported(case.truth),
            _reported(case.guess.body),
            case.identification.bodies[BASE].mean,
            case.identification.bodies[BASE].sd,
            strict=False,
        )
    ]
    document.table(
        ["base", "unit", "true", "guessed", "identified ± sd"],
        rows,
        "The base: true, guessed and as identified; inertias about the centre of mass.",
        ["left", "left", "right", "right", "right"],
    )
    for sentence in case.identification.disagreements:
        document.paragraph(sentence)
    document.paragraph(
        f"The second path's joint goals differ from the first's by up to "
        f"{np.degrees(np.abs(case.again.goal - case.first.goal).max()):.2g} degrees."
    )


def _rows(case: Case) -> list[list[str]]:
    rows = []
    for trial in case.trials:
        for body, name in (("base", "base"), ("tip", "end-effector")):
            pose, (distance, angle), (place, turn) = trial.pose(body), trial.errors[body], trial.inside[body]
            rows.append(
                [
                    trial.title,
                    name,
                    f"{distance:.3g}",
                    " / ".join(f"{value:.2g}" for value in pose.millimetres.semi_axes),
                    "yes" if place else "no",
                    f"{angle:.2g}",
                    f"{pose.degrees.semi_axes[0]:.2g}",
                    "yes" if turn else "no",
                ]
            )
    return rows


@styled
def miss_figure(result: Result) -> Figure:
    """Draw the true miss of the end-effector before and after identification."""
    figure = wide_figure(1.9)
    panels = figure.subplots(1, 2)
    cases = list(result.cases.values())
    place = np.arange(len(cases))
    for axes, unit, scale, key in ((panels[0], "mm", 1e3, "miss"), (panels[1], "degrees", 1.0, "turned")):
        for shift, (label, flights) in enumerate(
            (("guessed", [case.first for case in cases]), ("identified", [case.again for case in cases]))
        ):
            values = [scale * float(getattr(flight, key)) for flight in flights]
            axes.bar(place + 0.36 * (shift - 0.5), values, 0.32, color=COLOURS[shift], label=label)
        axes.set_yscale("log")
        axes.set_xticks(place, [case.guess.title.replace("initial ", "initial\n") for case in cases])
        axes.set_ylabel(f"miss [{unit}]")
        axes.grid(visible=False, axis="x")
    panels[0].legend(title="planned with the base")
    return figure


def _reported(body: InertialParameters) -> list[float]:
    return [body.mass, *body.com, *np.diag(body.inertia)]


def _assumed(document: Document, result: Result) -> None:
    document.section("What was assumed")
    case = next(iter(result.cases.values()))
    tested = ", ".join(format_number(float(value)) for value in case.target[0])
    document.items(
        [
            "The real robot is ETS-VII with the base of the paper and a nominal arm, in MuJoCo, with gravity gradient "
            "on every body. The arm is known exactly to the planner: only the base is not.",
            "A guess is drawn from the stated prior about the truth, in log-Cholesky coordinates, and the planner's "
            "prior is as wide. The paper's initial guess is met by a prior of relative width one, under which final "
            "positions are far from normal: its ellipsoid before identification is only a rough picture.",
            f"Target of the end-effector: ({tested}) m from where the base started, orbit axes, with its attitude; it is "
            "where one true flight ended, so that it can be reached. Joints move from rest to rest on quintics within "
            f"{case.trials[0].prediction.base.time[-1]:g} s; the planner finds their goals by least squares.",
            f"Identification: {EXCITATION.duration:.0f} s of joints 1 to 3, sensors each {INTERVAL:g} s with "
            f"{RATE_SIGMA:g} rad/s, {ACCEL_SIGMA:g} m/s² and {ENCODER_SIGMA:g} rad of white noise, a true initial rate of "
            f"about {INITIAL_RATE:g} rad/s that is unknown, emcee. Predicted paths start at rest.",
            "No external force: the centre of mass rests. One flight says little of whether 95 % regions hold the truth "
            f"in {100.0 * CONTENT:.0f} % of cases; the table states this one.",
        ]
    )
