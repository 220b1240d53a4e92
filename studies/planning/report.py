"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid import InertialParameters
from bayesid.design.pose_region import CONTENT
from bayesid.report import Document, figures, format_quantity
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.common.ets7 import ACCEL, BASE, ENCODER, RATE
from studies.planning.analysis import Case
from studies.planning.calibration import Calibration
from studies.planning.world import EXCITATION, INITIAL_RATE, INTERVAL

__all__ = ["Result", "miss_figure", "write_report"]

KEYS = ("mass", "centre of mass x", "centre of mass y", "centre of mass z", "Ixx", "Iyy", "Izz")
UNITS = ("kg", "m", "m", "m", "kg m²", "kg m²", "kg m²")


@dataclass(frozen=True)
class Result:
    """The cases by name, drawn and in a full run paper, and how often regions hold the truth."""

    cases: Mapping[str, Case]
    calibration: tuple[Calibration, ...]


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
            [case.guess.title, base, format_number(1e3 * flight.miss, 2), format_number(flight.turned, 2)]
            for case in result.cases.values()
            for base, flight in (("guessed", case.first), ("identified", case.again))
        ],
        "How far from its target the end-effector truly ended, planned with the guessed base and the identified one.",
        ["left", "left", "right", "right"],
    )
    document.figure(miss_figure(result), "The same, on a logarithmic scale.")
    for case in result.cases.values():
        _case(document, case)
    if len(result.cases) == 1:
        document.section("The paper's initial guess")
        document.paragraph("Not evaluated: only the full study has it.")
    _calibration(document, result.calibration)
    _assumed(document, result)
    document.write(output)


def _case(document: Document, case: Case) -> None:
    document.section(case.guess.title)
    document.table(
        [
            "path and prior",
            "body",
            "error [mm]",
            "95 % region [mm]",
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
    before, after = case.trials[:2]
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


def _calibration(document: Document, found: tuple[Calibration, ...]) -> None:
    document.section("Do the regions hold the truth?")
    count, content = found[0].guesses, CONTENT
    document.paragraph(
        f"The first path was predicted again for {count} guesses of the base, each such that the truth is a draw "
        f"of the prior about it, with {found[0].draws} draws of each. Of {count} regions {content * count:.0f} ± "
        f"{np.sqrt(count * content * (1.0 - content)):.1f} should hold the truth. "
        "The regions are normal approximations; under the narrow prior final poses are nearly normal, which shows how "
        "much of a shortfall is due to that."
    )
    document.table(
        ["width of the prior", "body", "position held", "rotation held"],
        [
            [f"{100.0 * item.spread:g} %", name, f"{place} of {count}", f"{turn} of {count}"]
            for item in found
            for name, (place, turn) in (("base", item.base), ("end-effector", item.tip))
        ],
        "How many of the 95 % regions before identification hold the pose that was flown.",
        ["left", "left", "right", "right"],
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
                    format_number(distance, 2),
                    " / ".join(format_number(float(value), 2) for value in pose.millimetres.semi_axes),
                    "yes" if place else "no",
                    format_number(angle, 2),
                    format_number(float(pose.degrees.semi_axes[0]), 2),
                    "yes" if turn else "no",
                ]
            )
    return rows


@styled
def miss_figure(result: Result) -> Figure:
    """Draw the true miss of the end-effector before and after identification."""
    figure = wide_figure(2.2)
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
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, [f"planned with the {label} base" for label in labels], loc="outside upper center", ncols=2)
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
            "A guess is drawn such that the truth is a draw of the planner's prior about it, normal in log-Cholesky "
            "coordinates. The paper's initial guess is met by a prior of relative width one, under which final "
            "positions are far from normal: its ellipsoid before identification is only a rough picture.",
            f"Target of the end-effector: ({tested}) m from where the base started, orbit axes, with its attitude; it "
            "is where one true flight ended, so that it can be reached. Joints move from rest to rest on quintics "
            f"within {case.trials[0].prediction.base.time[-1]:g} s; the planner finds their goals by least squares.",
            f"Identification: {EXCITATION.duration:.0f} s of joints 1 to 3, sensors each {INTERVAL:g} s with "
            f"{format_number(RATE)} rad/s, {format_number(ACCEL)} m/s² and {format_number(ENCODER)} "
            f"rad of white noise, a true initial rate of about {format_number(INITIAL_RATE)} rad/s that is unknown, "
            "emcee. Predicted paths start at rest.",
            "No external force: the centre of mass rests.",
        ]
    )
