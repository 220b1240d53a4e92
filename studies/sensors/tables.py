"""Cells of the report's tables, rows of the tables beside it, and figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.figures.figure_style import AFTER, BEFORE, COLOURS, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_range, format_text
from studies.common.quantities import JUDGED, MASS, MOMENTS
from studies.sensors.estimators import LIKELIHOOD, PAPER, Spread
from studies.sensors.result import Result

PLAIN = 0.01  # size of a percentage below which it is written with its power of ten, as `format_number` does


def percent(value: float, error: float) -> str:
    """Return a fraction in percent with its Monte-Carlo error in units of the last digits, ``3.2(3)``.

    Small ones have their power of ten, ``1.65(18) × 10⁻⁵``.
    """
    value, error = 100.0 * float(value), 100.0 * float(error)
    if not (np.isfinite(value) and np.isfinite(error) and error > 0.0):
        return format_number(value, 3)
    if max(abs(value), error) < PLAIN:
        power = int(np.floor(np.log10(max(abs(value), error))))
        scaled = _bracketed(value / 10.0**power, error / 10.0**power)
        return f"{scaled} × {format_number(10.0**power).removeprefix('1 × ')}"
    return _bracketed(value, error)


def _bracketed(value: float, error: float) -> str:
    """Return a number with its error in units of the last digits, one digit from 2 on, else two."""
    decimals = max(0, -int(np.floor(np.log10(error / 2.0))))
    return f"{format_fixed(value, decimals)}({error * 10.0**decimals:.0f})"


def rms_of(spread: Spread, index: int) -> str:
    """Return a quantity's root mean square error in percent."""
    return percent(spread.rms[index], spread.rms_error[index])


def rms_pair(spread: Spread) -> str:
    """Return the root mean square errors of the mass and of the worst moment in percent."""
    return f"{rms_of(spread, MASS)}; {rms_of(spread, spread.worst())}"


def diverging(result: Result, level: str) -> bool:
    """Return whether any nonlinear fit by the paper's procedure diverges at a level of noise."""
    fits = result.refits.get(level, {}).get(PAPER)
    return fits is not None and bool(fits.diverged.any())


def equal_rms(result: Result, level: str, name: str) -> tuple[str, str]:
    """Return the errors of mass and worst moment with equal weights as in (21), in percent.

    Parameters
    ----------
    result : Result
    level : str; level of noise; where fits diverge at it, errors are orders of magnitude only
    name : str; `PAPER` or `EQUAL`
    """
    spread = result.accelerometers[level][name]
    mass, moment = MASS, spread.worst()
    if diverging(result, level):
        return _about(spread.rms[mass]), _about(spread.rms[moment])
    return rms_of(spread, mass), rms_of(spread, moment)


def _about(ratio: float) -> str:
    return f"about {format_number(100.0 * float(ratio), 1)}"


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
    for what, levels in (("joints", result.joints), ("rates", result.rates), ("accelerometer", result.accelerometers)):
        for level, spreads in levels.items():
            for name, spread in spreads.items():
                stated = np.sqrt((spread.stated**2).mean(axis=0))
                measured = (spread.bias, spread.bias_error, spread.sd, spread.sd_error, spread.rms, spread.rms_error)
                for k, key in enumerate(BODY_QUANTITIES):
                    yield (
                        what,
                        level,
                        name,
                        key,
                        *(f"{column[k]:.4g}" for column in (*measured, stated, spread.honesty)),
                    )


def linear_rows(result: Result) -> Iterator[tuple[object, ...]]:
    """Yield noise, treatment, quantity, then bias, its Monte-Carlo error and the closed form, of the linear method."""
    for level, regressions in result.regressions.items():
        for name, errors in regressions.items():
            mean, sd = errors.mean(axis=0), errors.std(axis=0, ddof=1)
            closed = result.predicted[level] if name == "differences" else None
            for k in JUDGED:
                exact = "" if closed is None else f"{closed[k]:.4g}"
                error = sd[k] / np.sqrt(len(errors))
                yield level, name, list(BODY_QUANTITIES)[k], f"{mean[k]:.4g}", f"{error:.2g}", exact


def refit_rows(result: Result) -> Iterator[tuple[object, ...]]:
    """Yield noise, estimator, fits, diverged fits, then median errors of mass, nonlinear and linear, and difference."""
    for level, procedures in result.refits.items():
        for name, refits in procedures.items():
            medians = [np.median(np.abs(fits.errors[:, MASS])) for fits in (refits.nonlinear, refits.linear)]
            difference = float(refits.difference[JUDGED].max())
            count = len(refits.diverged)
            yield level, name, count, int(refits.diverged.sum()), *(f"{value:.4g}" for value in (*medians, difference))


@styled
def level_figure(result: Result) -> Figure:
    """Draw the error of mass and worst moment by level of noise, of the paper's procedure and of the likelihood."""
    figure = wide_figure(2.6)
    panels = figure.subplots(1, 2, sharey=True, sharex=True)
    series = (
        (PAPER, BEFORE, -0.12, {name: uses[PAPER] for name, uses in result.accelerometers.items()}),
        (LIKELIHOOD, AFTER, 0.12, {name: uses[LIKELIHOOD] for name, uses in result.joints.items()}),
    )
    for axes, title in zip(panels, ("mass", "worst moment"), strict=True):
        for label, colour, shift, spreads in series:
            chosen = [(spread, MASS if title == "mass" else spread.worst()) for spread in spreads.values()]
            size, error = (100.0 * np.array([getattr(s, key)[k] for s, k in chosen]) for key in ("rms", "rms_error"))
            place = np.arange(len(size)) + shift
            axes.errorbar(size, place, xerr=error, fmt="o", markersize=3.5, color=colour, label=label)
        axes.axvline(2.0, color=TRUTH, linewidth=0.8)
        axes.set(xscale="log", title=title, xlabel="error [%]")
    panels[0].set_yticks(range(len(result.levels)), [format_text(name) for name in result.levels])
    panels[0].set_ylim(len(result.levels) - 0.5, -0.5)
    shared_legend(figure, panels[0], 2)
    return figure


@styled
def treatment_figure(tables: Mapping[str, Mapping[str, Spread]]) -> Figure:
    """Draw bias, thick, and sd, thin, of mass and moments by treatment, one panel for each level of noise."""
    names = list(next(iter(tables.values())))
    figure = wide_figure(0.72 + 0.125 * len(names))
    panels = figure.subplots(1, len(tables), sharey=True, squeeze=False)[0]
    for axes, (level, spreads) in zip(panels, tables.items(), strict=True):
        for index, (label, chosen) in enumerate((("mass", [MASS]), ("worst moment", MOMENTS))):
            _bars(axes, [spreads[name] for name in names], chosen, index, label)
        axes.axvline(0.0, color="#888888", linewidth=0.6)
        axes.set(title=level, xlabel="error [%]")
    panels[0].set_yticks(range(len(names)), names)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    shared_legend(figure, panels[0], 2)
    return figure


def _bars(axes: Axes, spreads: Sequence[Spread], chosen: Sequence[int], index: int, label: str) -> None:
    place = np.arange(len(spreads)) + 0.26 * (index - 0.5)
    rows = [(spread, spread.worst(chosen)) for spread in spreads]
    bias = np.array([100.0 * spread.bias[k] for spread, k in rows])
    sd = np.array([100.0 * spread.sd[k] for spread, k in rows])
    error = np.array([100.0 * spread.bias_error[k] for spread, k in rows])
    colour = COLOURS[2 + index]  # neither of the colours of before and after
    axes.errorbar(bias, place, xerr=sd, fmt="o", markersize=2.5, color=colour, linewidth=0.8, capsize=2.0, label=label)
    axes.errorbar(bias, place, xerr=error, fmt="none", color=colour, linewidth=2.6)
