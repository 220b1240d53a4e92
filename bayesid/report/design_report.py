"""The report of designed manoeuvres."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid.design import Design
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.sentences.design_sentences import MEANING, assumption_sentences, reference_design, summary
from bayesid.report.tables import design_tables as tables

__all__ = ["design_report"]

POSES = 5
"""Number of instants at which the robot is drawn."""

PAIRS = (
    ("mass", "com.x"),
    ("com.x", "com.y"),
    ("com.y", "com.z"),
    ("inertia.xx", "inertia.yy"),
    ("inertia.yy", "inertia.zz"),
    ("inertia.xy", "inertia.xz"),
)
"""Pairs of a body's quantities whose ellipses are drawn."""


def design_report(designs: Sequence[Design], best: Design, title: str, file: Path, *, origin: str = "") -> None:
    """Write the report of designs of one problem as PDF, whole or not at all.

    Parameters
    ----------
    designs : sequence of Design
    best : Design
        Best of the designs.
    title : str
        Title of the study.
    file : path
    origin : str, optional
        Where the report comes from: files with their hashes, version, seed and command.
    """
    document = Document(title, "Design of manoeuvres")
    document.foot(origin)
    _add_result(document, designs, best)
    _add_limits(document, designs, best)
    _add_manoeuvres(document, designs, best)
    _add_uncertainty(document, designs)
    document.section("Criteria")
    document.items(
        [f"{design.name}. {MEANING.get(design.criterion, 'A criterion that the user defined.')}" for design in designs]
    )
    document.section("Assumptions")
    document.items(assumption_sentences(best))
    document.write(file)


def _add_result(document: Document, designs: Sequence[Design], best: Design) -> None:
    reference = reference_design(designs)
    document.section("Result")
    document.paragraph(summary(designs, best))
    document.table(
        ["manoeuvre", "log-determinant", f"sd relative to {reference.name}", "worst direction", "evaluations", "go"],
        tables.design_rows(designs),
        "Manoeuvres, named after the criterion each was designed by. Logarithm of the determinant of the predicted "
        "posterior covariance of all parameters in SI units; geometric mean of their standard deviations (sd) relative "
        f"to {reference.name}; sd of the log-Cholesky coordinates along the worst direction (relative: a mass is known "
        "to twice it); evaluations of the search; whether all limits hold with 99 % probability.",
        ["left", "right", "right", "right", "right", "left"],
    )
    document.table(
        ["quantity", "unit", "prior centre", *(design.name for design in designs)],
        tables.sd_rows(designs),
        "Predicted posterior standard deviation of every parameter, in the unit of its row, by manoeuvre.",
        ["left", "left", *["right"] * (1 + len(designs))],
    )


def _add_limits(document: Document, designs: Sequence[Design], best: Design) -> None:
    document.section("Limits")
    document.table(
        ["quantity", "unit", "limit", "largest", "used", "state"],
        tables.limit_rows(best),
        f"Limits of {best.name} and the largest value along it, at the prior's centre. A joint's range is counted from "
        "its middle; rest is the joints' speed at both ends; the value of a quiet band is the share of the power of "
        "the base's motion within it.",
        ["left", "left", "right", "right", "right", "left"],
    )
    if rows := tables.risk_rows(designs):
        document.table(
            ["manoeuvre", "quantity", "unit", "limit", "99 % below", "go"],
            rows,
            "Limits that depend on the inertial parameters, under the present uncertainty: the value that the largest "
            "along the manoeuvre stays below with 99 % probability.",
            ["left", "left", "left", "right", "right", "left"],
        )


def _add_manoeuvres(document: Document, designs: Sequence[Design], best: Design) -> None:
    document.section("Manoeuvres")
    reference = reference_design(designs)
    shown = {best.name: best, reference.name: reference}
    robot, duration = best.problem.plan.model.robot, best.problem.plan.family.duration
    document.figure(
        figures.robot_pose(robot, best.motion, np.linspace(0.0, duration, POSES + 1)[:-1]),
        f"The robot as given along {best.name}, in the base frame. Sticks join the joints; the last ones end at the "
        "centre of mass of the last body.",
    )
    for design in shown.values():
        document.figure(
            figures.joints_within_limits(design),
            f"Positions and speeds of the joints along {design.name}; limits are dashed red.",
        )
    document.figure(
        figures.tip_motion(shown),
        "Speed and turning rate of the tip, each the larger of those relative to the base and to inertial space.",
    )
    document.figure(
        figures.base_motion(shown),
        "Motion of the base, as in the paper's figure 4: angular velocity in base axes; displacement of the base's "
        "origin and Cardan angles of the base in the axes of the start.",
    )


def _add_uncertainty(document: Document, designs: Sequence[Design]) -> None:
    document.section("Predicted uncertainty")
    for body in designs[0].problem.plan.model.bodies:
        pairs = [(f"{body.name}.{first}", f"{body.name}.{second}") for first, second in PAIRS]
        document.figure(
            figures.covariance_ellipses(designs, pairs, tables.parameter_units(designs[0])),
            f"Predicted 95 % ellipses of pairs of parameters of {body.name}, about the prior's centre. A much wider "
            "ellipse may extend beyond its panel.",
        )
