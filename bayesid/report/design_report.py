"""The report of designed manoeuvres, and its sentences for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid._io.words import counted, joined, ordinal
from bayesid.design import Criterion, Design
from bayesid.design.decision_rate import DECISION
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report import figures
from bayesid.report.document import Document, Rows
from bayesid.report.model_assumptions import planning_sentences
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_range, format_unit

__all__ = ["design_report", "design_sentences", "separation_sentence"]

POSES = 5  # number of instants at which the robot is drawn

PAIRS = (
    ("mass", "com.x"),
    ("com.x", "com.y"),
    ("com.y", "com.z"),
    ("inertia.xx", "inertia.yy"),
    ("inertia.yy", "inertia.zz"),
    ("inertia.xy", "inertia.xz"),
)
"""Pairs of a body's quantities whose ellipses are drawn."""

REFERENCE = "paper-26"  # name of the design that the others are compared with


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
    document.items([f"{design.name}. {(design.designed_by or Criterion).meaning}" for design in designs])
    document.section("Assumptions")
    document.items(assumption_sentences(best))
    document.write(file)


def _add_result(document: Document, designs: Sequence[Design], best: Design) -> None:
    reference = reference_design(designs)
    document.section("Result")
    document.paragraph(summary(designs, best))
    document.table(
        [
            "manoeuvre",
            "log-determinant:",
            f"sd relative to {reference.name}:",
            "worst direction:",
            "evaluations:",
            "go",
        ],
        design_rows(designs),
        "Manoeuvres, named after their design criterion. Logarithm of the determinant of the predicted posterior "
        "covariance of all parameters in SI units; geometric mean of their standard deviations (sd) relative to "
        f"{reference.name}; sd of the log-Cholesky coordinates along the worst direction (the relative sd of a mass is "
        "twice as large); evaluations of the search; whether all limits are satisfied with 99 % probability.",
    )
    document.table(
        ["quantity", "unit", "prior centre:", *(f"{design.name}:" for design in designs)],
        sd_rows(designs),
        "Predicted posterior standard deviation of every parameter, in the unit of its row, by manoeuvre.",
    )


def _add_limits(document: Document, designs: Sequence[Design], best: Design) -> None:
    document.section("Limits")
    document.table(
        ["quantity", "unit", "limit:", "largest:", "used:", "state"],
        limit_rows(best),
        f"Limits of {best.name} and the largest value along it, at the prior's centre. The range of a joint is "
        "measured from its midpoint; rest is the speed of the joints at both ends; the value of a quiet band is the "
        "share of the power of the base motion within it.",
    )
    if rows := risk_rows(designs):
        document.table(
            ["manoeuvre", "quantity", "unit", "limit:", "99 % quantile:", "go"],
            rows,
            "Limits that depend on the inertial parameters, under the present uncertainty: the value below which the "
            "maximum along the manoeuvre lies with 99 % probability.",
        )


def _add_manoeuvres(document: Document, designs: Sequence[Design], best: Design) -> None:
    document.section("Manoeuvres")
    reference = reference_design(designs)
    shown = {best.name: best, reference.name: reference}
    robot, duration = best.problem.plan.model.robot, best.problem.plan.family.duration
    document.figure(
        figures.robot_pose(robot, best.motion, np.linspace(0.0, duration, POSES + 1)[:-1]),
        f"The robot as given along {best.name}, in the base frame. Lines connect the joints; the last ones end at the "
        "centre of mass of the last body.",
    )
    for design in shown.values():
        document.figure(
            figures.joints_within_limits(design),
            f"Positions and speeds of the joints along {design.name}; limits are dashed red lines.",
        )
    document.figure(
        figures.tip_motion(shown),
        "Speed and angular rate of the tip, each the larger of the values relative to the base and to inertial space.",
    )
    document.figure(
        figures.base_motion(shown),
        "Motion of the base, as in figure 4 of the paper: angular velocity in base axes; displacement of the base "
        "origin and Cardan angles of the base relative to the initial axes.",
    )


def _add_uncertainty(document: Document, designs: Sequence[Design]) -> None:
    document.section("Predicted uncertainty")
    for body in designs[0].problem.plan.model.bodies:
        pairs = [(f"{body.name}.{first}", f"{body.name}.{second}") for first, second in PAIRS]
        document.figure(
            figures.covariance_ellipses(designs, pairs, parameter_units(designs[0])),
            f"Predicted 95 % ellipses of pairs of parameters of {body.name}, about the prior's centre. A much wider "
            "ellipse may extend beyond its panel.",
        )


def reference_design(designs: Sequence[Design]) -> Design:
    """Return the design that the others are compared with: the one by (26), or the first where there is none."""
    return next((design for design in designs if design.name == REFERENCE), designs[0])


def summary(designs: Sequence[Design], best: Design) -> str:
    """Return which manoeuvre is best and by how much it narrows the posterior."""
    reference, family = reference_design(designs), best.problem.plan.family
    names = joined(body.name for body in best.problem.plan.model.bodies)
    text = (
        f"{counted(len(designs), 'manoeuvre')} of {family.duration:g} s for the robot "
        f"{best.problem.plan.model.robot.name}, of the family {family.name} with {family.size} parameters, "
        f"{'was' if len(designs) == 1 else 'were'} designed to identify {names}. "
        f"The smallest posterior is that of {best.name}"
    )
    if best is reference:
        return f"{text}. {_verdict(best)}"
    ratio = best.predicted.geometric_mean / reference.predicted.geometric_mean
    worst = best.predicted.worst / reference.predicted.worst
    return (
        f"{text}: in the geometric mean its standard deviations are {ratio:.3g} times those of {reference.name}, and "
        f"{worst:.3g} times along the worst direction. {_verdict(best)}"
    )


def design_sentences(designs: Sequence[Design], best: Design) -> list[str]:
    """Return one sentence on each design and one on the best, for the terminal."""
    reference = reference_design(designs)
    scale = reference.predicted.geometric_mean
    lines = []
    for design in designs:
        ratio = design.predicted.geometric_mean / scale
        size = "" if design is reference else f"standard deviations {ratio:.3g} times those of {reference.name}, and "
        kept = "every limit is satisfied" if design.go else "at least one limit is not satisfied"
        lines.append(f"{design.name}: {size}{kept} with 99 % probability under the present uncertainty of the robot.")
    separated = [design for design in designs if design.designed_by is not None and design.designed_by.rivals]
    return [
        *lines,
        *map(separation_sentence, separated),
        f"Best by the determinant of the posterior covariance: {best.name}.",
    ]


def separation_sentence(design: Design) -> str:
    """Return how often a manoeuvre that was designed to distinguish effects is expected to do so."""
    criterion = design.designed_by
    if criterion is None or not criterion.rivals:
        raise ValueError(f"{design.name} was not designed to separate effects")
    rates = [
        f"{format_percent(rate.rate, 3)} of flights (standard error {format_percent(rate.standard_error, 1)}) if "
        f"{label} is the cause"
        for label, rate in design.decisions.items()
    ]
    return (
        f"{design.name} distinguishes {joined(criterion.rivals)}: if both are equally probable beforehand, the correct "
        f"one is expected to reach a probability of {format_number(DECISION)} in {joined(rates)}. Sizes and "
        "directions follow the prior of a diagnosis: sizes are log-uniform, from those that no "
        "manoeuvre resolves to the largest plausible ones."
    )


def assumption_sentences(best: Design) -> list[str]:
    """Return what the design assumes."""
    problem = best.problem
    plan = problem.plan
    sensors = [
        f"Sensor {sensor.kind.value}: white noise of {format_range(sensor.noise.sigma(plan.interval))} "
        f"{format_unit(sensor.kind.unit)} per sample and axis."
        for sensor in plan.model.sensors
    ]
    return [
        "The search compares manoeuvres by the white noise of the sensors and the noise of the encoders at the "
        "start. The predicted standard deviations and covariances below use the noise of the encoders along the "
        "manoeuvre and include the filters; every other unknown is marginalised.",
        "Predictions are valid to first order about the prior's centre (Laplace), and include the prior.",
        f"Sampling every {plan.interval:g} s; the search integrates with steps of {format_number(plan.step)} s and "
        f"simulates every {f'{ordinal(plan.thinning)} ' if plan.thinning > 1 else ''}sample. Limits are evaluated "
        "every half step in the search, and eight times more finely at its end.",
        f"Tip speed and tip rate are those of {plan.tip.name}, each the larger of the one relative to the base and the "
        "one relative to inertial space.",
        "The risk is evaluated over draws from the prior of the bodies with the base starting at rest: the initial "
        "rate, which the manoeuvre does not cause, is omitted.",
        *sensors,
        *planning_sentences(plan),
    ]


def _verdict(best: Design) -> str:
    if best.go:
        return "It satisfies every limit, also with 99 % probability under the present uncertainty of the robot."
    broken = ", ".join(
        f"{risk.name} ({format_number(risk.quantile)} {format_unit(risk.unit)})" for risk in best.risks if not risk.go
    )
    return (
        "It satisfies every limit for the robot as given, but not with 99 % probability under the present uncertainty: "
        f"{broken}. It is a no go until the robot is known more accurately or the limits are relaxed."
    )


def design_rows(designs: Sequence[Design]) -> Rows:
    """Return name, log-determinant, geometric mean over the reference's, worst direction, evaluations, go or no go."""
    reference = reference_design(designs).predicted
    return [
        [
            design.name,
            format_fixed(design.predicted.log_det, 2),
            format_fixed(design.predicted.geometric_mean / reference.geometric_mean, 3),
            format_number(design.predicted.worst),
            str(design.optimum.evaluations),
            _go(design.go),
        ]
        for design in designs
    ]


def sd_rows(designs: Sequence[Design]) -> Rows:
    """Return quantity, unit, prior centre, and the standard deviation that each design predicts."""
    units = parameter_units(designs[0])
    return [
        [
            name,
            format_unit(units[name]),
            format_number(float(designs[0].predicted.mean[row]), 4),
            *(format_number(float(design.predicted.sd[row])) for design in designs),
        ]
        for row, name in enumerate(designs[0].predicted.names)
    ]


def limit_rows(design: Design) -> Rows:
    """Return limited quantity, unit, limit, largest value, its share of the limit, and whether the limit is active."""
    return [
        [
            item.name,
            format_unit(item.unit),
            format_number(item.limit, 4),
            format_number(item.largest, 4),
            f"{format_fixed(100.0 * item.largest / item.limit, 0)} %",
            "active" if item.active else "",
        ]
        for item in design.reached
    ]


def risk_rows(designs: Sequence[Design]) -> Rows:
    """Return design, limited quantity, unit, limit, 99 % quantile, and go or no go."""
    return [
        [
            design.name,
            risk.name,
            format_unit(risk.unit),
            format_number(risk.limit, 4),
            format_number(risk.quantile, 4),
            _go(risk.go),
        ]
        for design in designs
        for risk in design.risks
    ]


def parameter_units(design: Design) -> dict[str, str]:
    """Return the unit of every predicted quantity."""
    bodies = design.problem.plan.model.bodies
    return {f"{body.name}.{key}": unit for body in bodies for key, unit in BODY_QUANTITIES.items()}


def _go(go: bool) -> str:
    return "go" if go else "no go"
