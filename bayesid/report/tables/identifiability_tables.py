"""Rows of an identifiability report's tables."""

from __future__ import annotations

from bayesid.identifiability.advice import WORST, Advice
from bayesid.identifiability.base_parameters import BaseParameters
from bayesid.identifiability.parameter_table import ParameterRow
from bayesid.identifiability.practical_identifiability import Practical
from bayesid.inference.contraction import ContractionVerdict
from bayesid.report.document import Rows
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_percent,
    format_quantity,
    format_signed,
    format_unit,
)

__all__ = ["advice_rows", "direction_rows", "parameter_rows", "regrouping_rows"]

NEGLIGIBLE = 1e-9
"""Size of a regrouping's coefficient below which it is rounding."""


def direction_rows(result: Practical, shown: int) -> Rows:
    """Return number, share of the prior's width that is left, verdict and words of the worst known directions."""
    worst = zip(result.directions[:shown], result.words[:shown], strict=True)
    return [
        [str(number), format_percent(item.sd / item.prior_sd), item.verdict.value, words.partition(": ")[0]]
        for number, (item, words) in enumerate(worst, start=1)
    ]


def parameter_rows(result: Practical) -> Rows:
    """Return name, unit, value ± sd, prior sd, shrinkage, verdict, correlations and profile interval of parameters."""
    return [
        [
            item.name,
            format_unit(item.unit),
            format_quantity(item.mean, item.sd),
            format_number(item.prior_sd, 2),
            format_percent(item.shrinkage),
            "prior only" if item.verdict is ContractionVerdict.NOT else item.verdict.value,
            _correlations(item),
            _interval(item),
        ]
        for item in result.parameters
    ]


def _correlations(item: ParameterRow) -> str:
    body = item.name.partition(".")[0]
    return ", ".join(
        f"{name.removeprefix(f'{body}.')} ({format_signed(value, 2)})" for name, value in item.correlated_with
    )


def _interval(item: ParameterRow) -> str:
    if item.profile is None:
        return "" if item.normal else "not evaluated"
    return " to ".join("beyond" if end is None else format_number(end, 3) for end in item.profile.to_dict()["95 %"])


def advice_rows(result: Practical, worst: ParameterRow) -> Rows:
    """Return what is left of the worst directions, sd of one parameter, and information: now, and with each candidate.

    Parameters
    ----------
    worst : ParameterRow
        Parameter of which the data tell least at present.
    """
    now = [item.sd / item.prior_sd for item in result.directions[:WORST]]
    return [
        ["nothing more (now)", *_shares(now), f"{format_number(worst.sd, 2)} {format_unit(worst.unit)}", "0.0"],
        *(_advice_row(item, worst.unit) for item in result.advice),
    ]


def _advice_row(item: Advice, unit: str) -> list[str]:
    if item.reason:
        return [item.text, f"not evaluated: {item.reason}", *[""] * (WORST + 1)]
    sd = f"{format_number(item.sd, 2)} {format_unit(unit)}"
    return [item.text, *_shares(item.directions), sd, format_fixed(item.information, 1)]


def _shares(ratios: list[float] | tuple[float, ...]) -> list[str]:
    return [format_percent(ratio) for ratio in ratios] + [""] * (WORST - len(ratios))


def regrouping_rows(structure: BaseParameters) -> tuple[Rows, list[str]]:
    """Return base parameter and sum for those that stand for sums, and the names of those that stand for themselves."""
    rows, alone = [], []
    for name, row in zip(structure.independent, structure.regrouping, strict=True):
        terms = [
            _term(float(value), dependent)
            for value, dependent in zip(row, structure.dependent, strict=True)
            if abs(value) > NEGLIGIBLE
        ]
        if terms:
            rows.append([name, " ".join([name, *terms])])
        else:
            alone.append(name)
    return rows, alone


def _term(value: float, name: str) -> str:
    sign = "−" if value < 0.0 else "+"
    size = "" if abs(abs(value) - 1.0) < NEGLIGIBLE else f"{format_number(abs(value), 4)} "
    return f"{sign} {size}{name}"
