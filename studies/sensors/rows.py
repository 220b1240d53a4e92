"""Tables of the study: cells of the report's, and rows of the files beside it with all numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.numbers import format_fixed, format_number, format_range
from studies.common.quantities import JUDGED, MASS
from studies.sensors.montecarlo import Spread
from studies.sensors.result import Result

__all__ = ["estimate_rows", "honesty_of", "linear_rows", "percent", "refit_rows", "rms_of", "rms_pair"]
__all__ += ["treatment_rows"]

FINEST = 7
"""Largest number of decimals of a percentage."""


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


def rms_pair(spread: Spread) -> str:
    """Return the root mean square errors of the mass and of the worst moment in percent."""
    return f"{rms_of(spread, MASS)}; {rms_of(spread, spread.worst())}"


def honesty_of(spread: Spread) -> str:
    """Return the range, over mass and moments, of actual over stated errors."""
    return format_range(spread.honesty[JUDGED], 2)


def treatment_rows(result: Result, level: str) -> list[list[str]]:
    """Return bias and standard deviation of mass and worst moment, and honesty, of every treatment of the joints."""
    rows = []
    for name, spread in result.joints[level].items():
        cells = []
        for k in (MASS, spread.worst()):
            cells += [percent(spread.bias[k], spread.bias_error[k]), percent(spread.sd[k], spread.sd_error[k])]
        rows.append([name, *cells, honesty_of(spread)])
    return rows


def estimate_rows(result: Result) -> Iterator[tuple[object, ...]]:
    """Yield what is treated, noise, treatment, quantity; bias, sd, rms with Monte-Carlo errors; stated sd, honesty."""
    for what, levels in (
        ("joints", result.joints),
        ("rates", result.rates),
        ("accelerometer", result.accelerometers),
    ):
        for level, spreads in levels.items():
            for name, spread in spreads.items():
                stated = np.sqrt((spread.stated**2).mean(axis=0))
                columns = (
                    spread.bias,
                    spread.bias_error,
                    spread.sd,
                    spread.sd_error,
                    spread.rms,
                    spread.rms_error,
                    stated,
                    spread.honesty,
                )
                for k, key in enumerate(BODY_QUANTITIES):
                    yield what, level, name, key, *(f"{column[k]:.4g}" for column in columns)


def linear_rows(result: Result) -> Iterator[tuple[object, ...]]:
    """Yield noise, treatment, quantity, then bias, its Monte-Carlo error and the closed form, of the linear method."""
    for level, regressions in result.regressions.items():
        for name, regression in regressions.items():
            mean, sd = regression.errors.mean(axis=0), regression.errors.std(axis=0, ddof=1)
            closed = result.predicted[level] if name == "differences" else None
            for k in JUDGED:
                exact = "" if closed is None else f"{closed[k]:.4g}"
                error = sd[k] / np.sqrt(len(regression.errors))
                yield level, name, list(BODY_QUANTITIES)[k], f"{mean[k]:.4g}", f"{error:.2g}", exact


def refit_rows(result: Result) -> Iterator[tuple[object, ...]]:
    """Yield noise, estimator, fits, diverged fits, then median errors of mass, nonlinear and linear, and difference."""
    for level, procedures in result.refits.items():
        for name, refits in procedures.items():
            medians = [np.median(np.abs(item.errors[:, MASS])) for item in (refits.nonlinear, refits.linear)]
            difference = float(refits.difference[JUDGED].max())
            count = len(refits.diverged)
            yield level, name, count, int(refits.diverged.sum()), *(f"{value:.4g}" for value in (*medians, difference))
