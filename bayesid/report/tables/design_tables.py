"""Rows of a design report's tables."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.design import Design
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.document import Rows
from bayesid.report.numbers import format_fixed, format_number, format_unit
from bayesid.report.sentences.design_sentences import reference_design

__all__ = ["design_rows", "limit_rows", "parameter_units", "risk_rows", "sd_rows"]


def design_rows(designs: Sequence[Design]) -> Rows:
    """Return name, log-determinant, geometric mean over the reference's, worst direction, evaluations, go or no go."""
    reference = reference_design(designs).predicted
    return [
        [
            design.name,
            format_fixed(design.predicted.log_det, 2),
            format_fixed(design.predicted.geometric_mean / reference.geometric_mean, 3),
            format_number(design.predicted.worst),
            str(design.found.evaluations),
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
