"""Rows of the report's tables, and numbers for its sentences."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayesid.report.numbers import format_fixed, format_number, format_percent, format_quantity, format_range
from studies.base_body import paper
from studies.common.quantities import HEADINGS, JUDGED, MASS, MOMENTS
from studies.sensors.montecarlo import Spread
from studies.sensors.result import Result

__all__ = ["falsified_rows", "honesty_of", "level_rows", "median_of", "parameter_rows", "percent", "refit_rows"]
__all__ += ["regression_rows", "rms_of", "scalar_rows", "shift_of", "spread_rows"]

NO_CHI2 = 1e-2
"""Chi-square per degree of freedom below which it is in SI units and without meaning."""

FINEST = 7
"""Largest number of decimals of a percentage."""

HALF_NORMAL = 1.17
"""Error of the median of n absolute normal numbers over that median, times the root of n."""

NOTHING = 1e-9
"""Relative error below which only rounding remains."""


def percent(value: float, error: float) -> str:
    """Return a fraction in percent with its Monte-Carlo error in units of the last digits: ``3.22(35)``."""
    value, error = 100.0 * float(value), 100.0 * float(error)
    if not (np.isfinite(value) and np.isfinite(error) and error > 0.0):
        return format_number(value, 3)
    # the error keeps one digit from 2 on, else two
    decimals = min(max(0, -int(np.floor(np.log10(error / 2.0)))), FINEST)
    digits = f"{error * 10.0**decimals:.0f}"
    return format_fixed(value, decimals) + ("" if digits == "0" else f"({digits})")


def rms_of(spread: Spread, index: int) -> str:
    """Return a quantity's root mean square error in percent."""
    return percent(spread.rms[index], spread.rms_error[index])


def shift_of(spread: Spread, first: Spread, index: int) -> str:
    """Return the mean shift against another estimator on the same noise, in percent."""
    shift = spread.errors[:, index] - first.errors[:, index]
    return percent(shift.mean(), shift.std(ddof=1) / np.sqrt(len(shift)))


def median_of(spread: Spread, index: int) -> str:
    """Return the median absolute error in percent; its Monte-Carlo error is that of normal estimates."""
    median = np.median(np.abs(spread.errors[:, index]))
    return percent(float(median), float(HALF_NORMAL * median / np.sqrt(len(spread.errors))))


def honesty_of(spread: Spread) -> str:
    """Return the range, over mass and moments, of actual over stated errors."""
    return format_range(spread.honesty[JUDGED], 2)


def level_rows(result: Result) -> list[list[str]]:
    """Return the noise of the sensors at every level, with its share of the signal's peak."""
    rate, accel = (float(np.abs(values).max()) for values in (result.flight.rate, result.flight.accel))
    return [
        [
            name,
            f"{format_number(noise.rate, 2)} ({format_percent(noise.rate / rate, 2)})",
            f"{format_number(noise.accel, 2)} ({format_percent(noise.accel / accel, 2)})",
            format_number(noise.position, 2),
        ]
        for name, noise in result.levels.items()
    ]


def spread_rows(spreads: Mapping[str, Spread]) -> list[list[str]]:
    """Return bias, shift against the first row and standard deviation of mass and worst moment, and honesty."""
    rows, first = [], next(iter(spreads.values()))
    for name, spread in spreads.items():
        cells = []
        for k in (MASS, spread.worst()):
            cells += [
                percent(spread.bias[k], spread.bias_error[k]),
                shift_of(spread, first, k) if spread is not first else "",
                percent(spread.sd[k], spread.sd_error[k]),
            ]
        chi2 = float(spread.chi2.mean())
        rows.append([name, *cells, honesty_of(spread), format_number(chi2, 3) if chi2 > NO_CHI2 else "–"])
    return rows


def parameter_rows(spreads: Mapping[str, Spread]) -> list[list[str]]:
    """Return every quantity's truth, then bias, standard deviation and stated standard deviation, in its unit."""
    rows = []
    for k, heading in enumerate(HEADINGS):
        size, cells = abs(paper.TRUTH[k]), []
        for spread in spreads.values():
            cells += [
                format_quantity(size * float(spread.bias[k]), size * float(spread.bias_error[k])),
                format_quantity(size * float(spread.sd[k]), size * float(spread.sd_error[k])),
                format_number(size * float(np.sqrt((spread.stated[:, k] ** 2).mean())), 2),
            ]
        rows.append([heading, format_number(paper.TRUTH[k], 6), *cells])
    return rows


def falsified_rows(result: Result) -> list[list[str]]:
    """Return the errors that a bias and the trapezoidal rule cause in every use of the accelerometer."""
    rows = []
    for name, falsified in result.falsified.items():
        pairs = [(errors[MASS], np.abs(errors[MOMENTS]).max()) for errors in (falsified.bias, falsified.rule)]
        cells = (
            (format_number(100.0 * float(value) if abs(value) > NOTHING else 0.0, 2) for value in pair)
            for pair in pairs
        )
        rows.append([name, *(" / ".join(cell) for cell in cells)])
    return rows


def scalar_rows(result: Result) -> list[list[str]]:
    """Return closed form, matrices and simulation of one unknown."""
    return [
        [
            item.name,
            format_fixed(item.closed, 4),
            format_fixed(item.matrices, 4),
            format_quantity(item.simulated, item.error),
            format_fixed(item.whole, 4),
            format_number(item.bias_closed),
            format_fixed(item.bias, 3),
        ]
        for item in result.scalars
    ]


def regression_rows(result: Result) -> list[list[str]]:
    """Return bias and standard deviation of the linear method, and the closed form for central differences."""
    rows = []
    for level, regressions in result.regressions.items():
        predicted = (format_number(100.0 * float(result.predicted[level][k]), 3) for k in JUDGED)
        rows.append([level, "closed form, differences", *predicted, "", ""])
        for name, regression in regressions.items():
            count = len(regression.errors)
            mean, sd = regression.errors.mean(axis=0), regression.errors.std(axis=0, ddof=1)
            rows.append(
                [
                    level,
                    name,
                    *(percent(mean[k], sd[k] / np.sqrt(count)) for k in JUDGED),
                    percent(sd[MASS], sd[MASS] / np.sqrt(2.0 * (count - 1))),
                    f"{regression.unphysical} of {count}",
                ]
            )
    return rows


def refit_rows(result: Result) -> list[list[str]]:
    """Return nonlinear against linear errors from the same noise."""
    rows = []
    for level, procedures in result.refits.items():
        for name, refits in procedures.items():
            medians = [
                median_of(spread, k)
                for k in (MASS, refits.linear.worst())
                for spread in (refits.nonlinear, refits.linear)
            ]
            diverged = f"{int(refits.diverged.sum())} of {len(refits.diverged)}"
            rows.append([level, name, diverged, *medians, format_number(float(refits.difference[JUDGED].max()), 2)])
    return rows
