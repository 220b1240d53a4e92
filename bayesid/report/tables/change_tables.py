"""Rows of the tables of what the named causes change: inertial parameters and errors of the simulation."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.diagnosis.outcome.model_change import ParameterChange, SimulationError
from bayesid.report.document import Rows
from bayesid.report.numbers import format_number, format_quantity, format_signed, format_unit

__all__ = ["change_rows", "error_rows", "most_moved"]


def change_rows(changes: Sequence[ParameterChange], named: bool = True) -> Rows:
    """Return parameter, unit, given, prior sd, without, with, and shift in sd; only the fit where nothing is named."""
    rows = []
    for item in changes:
        given = [format_number(item.given, 4), format_number(item.prior_sd, 2)]  # wide priors would round it away
        start = [item.name, format_unit(item.unit), *given]
        without = format_quantity(item.without, item.without_sd)
        fitted = [format_quantity(item.fitted, item.fitted_sd), format_signed(item.shift)] if named else []
        rows.append([*start, without, *fitted])
    return rows


def error_rows(errors: Sequence[SimulationError], named: bool = True) -> Rows:
    """Return sensor, unit, error before and after, and what noise alone makes; only before where nothing is named."""
    return [
        [
            item.kind.value,
            format_unit(item.kind.unit),
            format_number(item.before),
            *([format_number(item.after)] if named else []),
            format_number(item.noise),
        ]
        for item in errors
    ]


def most_moved(changes: Sequence[ParameterChange], most: int) -> list[ParameterChange]:
    """Return the parameters that move most in standard deviations, in their usual order."""
    chosen = sorted(changes, key=lambda item: -abs(item.shift))[:most]
    return [item for item in changes if item in chosen]
