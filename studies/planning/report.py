"""Report of the study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.design.pose_region import CONTENT
from bayesid.report import Document, figures, format_quantity
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_number, format_vector
from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.common.ets7 import ACCEL, BASE, ENCODER, RATE
from studies.common.report_parts import QUANTITY_TITLES, columns, not_evaluated
from studies.planning.analysis import Case
from studies.planning.calibration import Calibration
from studies.planning.world import EXCITATION, INITIAL_RATE, INTERVAL

__all__ = ["Result", "miss_figure", "write_report"]

BODIES = {"base": "base", "tip": "end-effector"}
"""Bodies whose poses are predicted, with their titles."""


@dataclass(frozen=True)
class Result:
    """Outcome of the study.

    Attributes
    ----------
    cases : mapping of str to Case
        Cases ``drawn`` and, in a full run, ``paper``.
    calibration : tuple of Calibration
        Numbers of regions that hold the truth, for each width of the prior.
    """

    cases: Mapping[str, Case]
    calibration: tuple[Calibration, ...]


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("What a planner gains by identification", "Section 1.1.1 of Lampariello and Hirzinger (2005)")
    document.section("Question and answer")
    document.paragraph(
        "Joint angles lead to a place in space only through the base, which moves as the arm does. A path planned in "
        "joint space with wrong inertial parameters therefore ends elsewhere. Here a path of ETS-VII is planned that "
        "is to bring the end-effector to a pose in orbit axes; an independent simulator (MuJoCo) flies it. Before the "
        "flight, the prediction says where base and end-effector will end, with 95 % regions. Then the base is "
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
        "Distance and angle from its target at which the end-effector truly ended, for paths planned with the guessed "
        "base and with the identified one.",
        columns("llrr"),
    )
    document.figure(miss_figure(result), "The same distances and angles on a logarithmic scale.")
    for case in result.cases.values():
        _case(document, case)
    if len(result.cases) == 1:
        not_evaluated(document, "The paper's initial guess")
    _calibration(document, result.calibration)
    _assumed(document, result)
    document.write(output)


def _case(document: Document, case: Case) -> None:
    document.section(case.guess.title)
    document.table(
        ["path and prior", "body", "error [mm]", "95 % region [mm]", "inside", "error [deg]", "95 % [deg]", "inside"],
        _pose_rows(case),
        "Predicted and flown final poses: distance of the predicted mean from the truth, semi-axes of the 95 % "
        "ellipsoid (of the rotation, the longest), and whether the region holds the truth.",
        columns("llrrlrrl"),
    )
    before, after, _ = (trial.compared("tip")[0] for trial in case.trials)
    document.figure(
        figures.final_positions({"guessed base": before}, case.first.flown.tip[0]),
        "Final position of the end-effector on the first path as predicted before identification: draws and the "
        "outline of the 95 % ellipsoid, in orbit axes, counted from where it truly ended.",
    )
    document.figure(
        figures.final_positions({"identified base": after}, case.first.flown.tip[0]),
        "Final position on the same path as predicted with the identified base; the scale differs.",
    )
    body, truth, guess = case.identification.bodies[BASE], case.truth.vector, case.guess.body.vector
    values = zip(
        QUANTITY_TITLES[:7], mass_com_inertia(truth), mass_com_inertia(guess), body.mean, body.sd, strict=False
    )
    document.table(
        ["base", "true", "guessed", "identified ± standard deviation"],
        [
            [title, format_number(float(t), 5), format_number(float(g), 5), format_quantity(float(m), float(s))]
            for title, t, g, m, s in values
        ],
        "The true, the guessed and the identified base; inertias are about the centre of mass.",
        columns("lrrr"),
    )
    for sentence in case.identification.disagreements:
        document.paragraph(sentence)
    document.paragraph(
        "The joint goals of the second path differ from those of the first by up to "
        f"{np.degrees(np.abs(case.again.goal - case.first.goal).max()):.2g} degrees."
    )


def _pose_rows(case: Case) -> list[list[str]]:
    rows = []
    for trial in case.trials:
        for body, title in BODIES.items():
            pose, flown = trial.compared(body)
            distance, angle = trial.errors(body)
            place, turn = ("yes" if inside else "no" for inside in pose.holds(*flown))
            axes = " / ".join(format_number(float(value), 2) for value in pose.millimetres.semi_axes)
            longest = format_number(float(pose.degrees.semi_axes[0]), 2)
            cells = [format_number(distance, 2), axes, place, format_number(angle, 2), longest, turn]
            rows.append([trial.title, title, *cells])
    return rows


def _calibration(document: Document, calibration: Sequence[Calibration]) -> None:
    document.section("Do the regions hold the truth?")
    count, expected = calibration[0].guesses, CONTENT * calibration[0].guesses
    document.paragraph(
        f"The first path was predicted again for {count} guesses of the base, each such that the truth is a draw of "
        f"the prior about it, with {calibration[0].draws} draws of each. Of {count} regions {expected:.0f} ± "
        f"{np.sqrt(expected * (1.0 - CONTENT)):.1f} should hold the truth. The regions have the "
        "proportions of the draws' covariance and are as large as the draws want, since the tails of final poses are "
        "heavier than normal under the wide prior."
    )
    document.table(
        ["width of the prior", "body", "position held", "rotation held"],
        [
            [f"{100.0 * item.spread:g} %", title, *(f"{number} of {count}" for number in item.held[body])]
            for item in calibration
            for body, title in BODIES.items()
        ],
        "Number of the 95 % regions before identification that hold the pose that was flown.",
        columns("llrr"),
    )


@styled
def miss_figure(result: Result) -> Figure:
    """Draw the true miss of the end-effector before and after identification."""
    figure = wide_figure(2.2)
    panels = figure.subplots(1, 2)
    cases = list(result.cases.values())
    place = np.arange(len(cases))
    for axes, unit, scale, key in ((panels[0], "mm", 1e3, "miss"), (panels[1], "degrees", 1.0, "turned")):
        for shift, (label, attribute) in enumerate((("guessed", "first"), ("identified", "again"))):
            values = [scale * float(getattr(getattr(case, attribute), key)) for case in cases]
            axes.bar(place + 0.36 * (shift - 0.5), values, 0.32, color=COLOURS[shift], label=label)
        axes.set_yscale("log")
        axes.set_xticks(place, [case.guess.title.replace("initial ", "initial\n") for case in cases])
        axes.set_ylabel(f"miss [{unit}]")
        axes.grid(visible=False, axis="x")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, [f"planned with the {label} base" for label in labels], loc="outside upper center", ncols=2)
    return figure


def _assumed(document: Document, result: Result) -> None:
    document.section("Assumptions")
    case = next(iter(result.cases.values()))
    document.items(
        [
            "The real robot is ETS-VII with the base of the paper and a nominal arm, in MuJoCo, with gravity gradient "
            "on every body. The planner knows the arm exactly, but not the base.",
            "A guess is drawn such that the truth is a draw of the planner's prior about it, normal in log-Cholesky "
            "coordinates. The paper's initial guess has a prior of relative width one, under which final positions "
            "are far from normal: its ellipsoid before identification is only a rough picture.",
            f"The target of the end-effector is {format_vector(case.target[0])} m from where the base started, in "
            "orbit axes, with an attitude; it is where one true flight ended, so that it can be reached. Joints move "
            f"from rest to rest on quintics within {case.trials[0].prediction.base.time[-1]:g} s; the planner "
            "determines their goals by least squares.",
            f"Identification is by emcee from {EXCITATION.duration:.0f} s of joints 1 to 3, with sensors read every "
            f"{INTERVAL:g} s with {format_number(RATE)} rad/s, {format_number(ACCEL)} m/s² and "
            f"{format_number(ENCODER)} rad of white noise. The true initial rate of about "
            f"{format_number(INITIAL_RATE)} rad/s is unknown. Predicted paths start at rest.",
            "No external force acts, so that the centre of mass rests.",
        ]
    )
