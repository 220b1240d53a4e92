"""Rows of the report's tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.numbers import format_number, format_quantity, format_unit
from studies.base_body import paper
from studies.sensors.montecarlo import Spread
from studies.sensors.result import Result

__all__ = [
    "MASS",
    "MOMENTS",
    "falsified_rows",
    "honest",
    "level_rows",
    "median_of",
    "parameter_rows",
    "percent",
    "refit_rows",
]
__all__ += ["regression_rows", "rms_of", "scalar_rows", "shift_of", "spread_rows", "worst"]

Floats = NDArray[np.floating]

MASS, MOMENTS = 0, [4, 5, 6]
JUDGED = [MASS, *MOMENTS]

NO_CHI2 = 1e-2
"""Below, chi-square is in SI units and says nothing."""

FINEST = 7
"""Decimals of a percentage at most."""

HALF_NORMAL = 1.17
"""Error of the median of n absolute normal numbers over that median, times the root of n."""

NOTHING = 1e-9
"""Relative errors below are rounding."""


def percent(value: float, error: float) -> str:
    """Return a fraction in percent with its Monte-Carlo error in units of the last digits: ``3.22(35)``."""
    value, error = 100.0 * value, 100.0 * error
    if not (np.isfinite(value) and np.isfinite(error) and error > 0.0):
        return format_number(value, 3)
    # the error keeps one digit from 2 on, else two
    decimals = min(max(0, -int(np.floor(np.log10(error / 2.0)))), FINEST)
    digits = f"{error * 10.0**decimals:.0f}"
    return f"{value:.{decimals}f}{'' if digits == '0' else f'({digits})'}".replace("-", "−")


def worst(spread: Spread, chosen: Sequence[int] = tuple(MOMENTS)) -> int:
    """Return which of some quantities has the largest root mean square error."""
    return max(chosen, key=lambda index: float(spread.rms[index]))


def rms_of(spread: Spread, index: int) -> str:
    """Return a quantity's root mean square error in percent."""
    return percent(float(spread.rms[index]), float(spread.rms_error[index]))


def shift_of(spread: Spread, first: Spread, index: int) -> str:
    """Return the mean shift against another estimator on the same noise, in percent."""
    shift = spread.errors[:, index] - first.errors[:, index]
    return percent(float(shift.mean()), float(shift.std(ddof=1) / np.sqrt(len(shift))))


def honest(spread: Spread) -> str:
    """Return the range, over mass and moments, of actual over stated errors."""
    found = spread.honesty[JUDGED]
    return f"{format_number(float(found.min()), 2)} to {format_number(float(found.max()), 2)}"


def level_rows(result: Result) -> list[list[str]]:
    """Return what every level of noise means for the sensors."""
    rate, accel = (float(np.abs(values).max()) for values in (result.flight.rate, result.flight.accel))
    return [
        [
            name,
            f"{format_number(noise.rate, 2)} ({format_number(100.0 * noise.rate / rate, 2)} %)",
            f"{format_number(noise.accel, 2)} ({format_number(100.0 * noise.accel / accel, 2)} %)",
            format_number(noise.encoder, 2),
        ]
        for name, noise in result.levels.items()
    ]


def spread_rows(spreads: Mapping[str, Spread]) -> list[list[str]]:
    """Return bias, shift against the first row and standard deviation of mass and worst moment, and honesty."""
    rows, first = [], next(iter(spreads.values()))
    for name, own in spreads.items():
        cells = []
        for k in (MASS, worst(own)):
            cells += [
                percent(float(own.bias[k]), float(own.bias_error[k])),
                shift_of(own, first, k) if own is not first else "",
                percent(float(own.sd[k]), float(own.sd_error[k])),
            ]
        chi2 = float(own.chi2.mean())
        rows.append([name, *cells, honest(own), format_number(chi2, 3) if chi2 > NO_CHI2 else "–"])
    return rows


def parameter_rows(spreads: Mapping[str, Spread]) -> list[list[str]]:
    """Return every quantity: truth, then bias, standard deviation and what was stated, in its unit."""
    rows = []
    for k, (name, unit) in enumerate(BODY_QUANTITIES.items()):
        size, cells = abs(paper.TRUTH[k]), []
        for own in spreads.values():
            stated = size * float(np.sqrt((own.stated[:, k] ** 2).mean()))
            cells += [
                format_quantity(size * float(own.bias[k]), size * float(own.bias_error[k])),
                format_quantity(size * float(own.sd[k]), size * float(own.sd_error[k])),
                format_number(stated, 2),
            ]
        rows.append([f"{name} [{format_unit(unit)}]", f"{paper.TRUTH[k]:g}".replace("-", "−"), *cells])
    return rows


def falsified_rows(result: Result) -> list[list[str]]:
    """Return what a bias and the trapezoidal rule do to every use of the accelerometer."""
    return [
        [
            name,
            *(
                " / ".join(
                    format_number(100.0 * value if abs(value) > NOTHING else 0.0, 2)
                    for value in (float(errors[MASS]), float(np.abs(errors[MOMENTS]).max()))
                )
                for errors in (own.bias, own.rule)
            ),
        ]
        for name, own in result.falsified.items()
    ]


def scalar_rows(result: Result) -> list[list[str]]:
    """Return closed form, matrices and simulation of one unknown."""
    return [
        [
            item.name,
            f"{item.closed:.4f}",
            f"{item.matrices:.4f}",
            format_quantity(item.simulated, item.error),
            f"{item.whole:.4f}",
            f"{item.bias_closed:g}".replace("-", "−"),
            f"{item.bias:.3f}".replace("-", "−"),
        ]
        for item in result.scalars
    ]


def regression_rows(result: Result) -> list[list[str]]:
    """Return bias and standard deviation of the linear method, and the closed form for central differences."""
    rows = []
    for level, found in result.regressions.items():
        predicted = result.predicted[level]
        rows.append(
            [
                level,
                "closed form, differences",
                *(format_number(100.0 * float(predicted[k]), 3) for k in JUDGED),
                "",
                "",
            ]
        )
        for name, own in found.items():
            count = len(own.errors)
            error = own.errors.std(axis=0, ddof=1) / np.sqrt(count)
            mean = own.errors.mean(axis=0)
            sd = float(own.errors[:, MASS].std(ddof=1))
            rows.append(
                [
                    level,
                    name,
                    *(percent(float(mean[k]), float(error[k])) for k in JUDGED),
                    percent(sd, sd / float(np.sqrt(2.0 * (count - 1)))),
                    f"{own.unphysical} of {count}",
                ]
            )
    return rows


def median_of(spread: Spread, index: int) -> str:
    """Return the median absolute error in percent; its Monte-Carlo error is that of normal estimates."""
    median = float(np.median(np.abs(spread.errors[:, index])))
    return percent(median, HALF_NORMAL * median / float(np.sqrt(len(spread.errors))))


def refit_rows(result: Result) -> list[list[str]]:
    """Return nonlinear against linear errors of the same draws."""
    rows = []
    for level, found in result.refits.items():
        for name, own in found.items():
            index = worst(own.linear)
            rows.append(
                [
                    level,
                    name,
                    f"{int(own.runaway.sum())} of {len(own.runaway)}",
                    median_of(own.nonlinear, MASS),
                    median_of(own.linear, MASS),
                    median_of(own.nonlinear, index),
                    median_of(own.linear, index),
                    format_number(float(own.apart[JUDGED].max()), 2),
                ]
            )
    return rows
