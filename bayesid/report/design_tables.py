"""Rows of a design report's tables."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.design import Design
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.design_text import reference_design
from bayesid.report.numbers import format_number, format_unit

__all__ = ["design_rows", "limit_rows", "pairs", "parameter_units", "risk_rows", "sd_rows"]

Rows = list[list[str]]

PAIRS = (
    ("mass", "com.x"),
    ("com.x", "com.y"),
    ("com.y", "com.z"),
    ("inertia.xx", "inertia.yy"),
    ("inertia.yy", "inertia.zz"),
    ("inertia.xy", "inertia.xz"),
)
"""Quantities of a body that are drawn together."""


def design_rows(designs: Sequence[Design]) -> Rows:
    """Return name, log-determinant, geometric mean relative to the reference, worst direction, evaluations, go."""
    reference = reference_design(designs).predicted
    return [
        [
            design.name,
            f"{design.predicted.log_det:.2f}".replace("-", "−"),
            f"{design.predicted.geometric_mean / reference.geometric_mean:.3f}",
            format_number(design.predicted.worst),
            str(design.found.evaluations),
            "go" if design.go else "no go",
        ]
        for design in designs
    ]


def sd_rows(designs: Sequence[Design]) -> Rows:
    """Return quantity, unit, prior centre and predicted standard deviation by every design."""
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
    """Return limit, bound, largest, unit, part used."""
    return [
        [
            item.name,
            format_unit(item.unit),
            format_number(item.limit, 4),
            format_number(item.largest, 4),
            f"{100.0 * item.largest / item.limit:.0f} %",
            "active" if item.active else "",
        ]
        for item in design.reached
    ]


def risk_rows(designs: Sequence[Design]) -> Rows:
    """Return design, limit, bound, 99 % quantile and go or no go."""
    return [
        [
            design.name,
            risk.name,
            format_unit(risk.unit),
            format_number(risk.limit, 4),
            format_number(risk.quantile, 4),
            "go" if risk.go else "no go",
        ]
        for design in designs
        for risk in design.risks
    ]


def parameter_units(design: Design) -> dict[str, str]:
    """Return the unit of every predicted quantity."""
    bodies = design.problem.plan.model.bodies
    return {f"{body.name}.{key}": unit for body in bodies for key, unit in BODY_QUANTITIES.items()}


def pairs(body: str) -> list[tuple[str, str]]:
    """Return names of the quantities of a body that are drawn together."""
    return [(f"{body}.{first}", f"{body}.{second}") for first, second in PAIRS]
