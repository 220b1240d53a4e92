"""Figures of the study: bias and standard deviation by treatment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import AFTER, BEFORE, COLOURS, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_text
from studies.common.quantities import MASS, MOMENTS
from studies.sensors.montecarlo import LIKELIHOOD, PAPER, Spread
from studies.sensors.result import Result

__all__ = ["level_figure", "treatment_figure"]


@styled
def level_figure(result: Result) -> Figure:
    """Draw the error of mass and worst moment by level of noise, of the paper's procedure and of the likelihood."""
    figure = wide_figure(2.6)
    panels = figure.subplots(1, 2, sharey=True, sharex=True)
    series = (
        (PAPER, BEFORE, -0.12, {name: uses[PAPER] for name, uses in result.accelerometers.items()}),
        ("the package's likelihood", AFTER, 0.12, {name: uses[LIKELIHOOD] for name, uses in result.joints.items()}),
    )
    for axes, title in zip(panels, ("mass", "moment with the largest error"), strict=True):
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
def treatment_figure(tables: Mapping[str, Mapping[str, Spread]], without: Sequence[str] = ()) -> Figure:
    """Draw bias, thick, and standard deviation, thin, of mass and moments by treatment, one panel for each level.

    Parameters
    ----------
    tables : mapping
        Estimates by level, then by treatment, with the same treatments at each level.
    without : sequence of str
        Treatments that are left out, since they would spoil the scale.
    """
    names = [name for name in next(iter(tables.values())) if name not in without]
    figure = wide_figure(0.72 + 0.125 * len(names))
    panels = figure.subplots(1, len(tables), sharey=True, squeeze=False)[0]
    for axes, (level, spreads) in zip(panels, tables.items(), strict=True):
        for index, (label, chosen) in enumerate((("mass", [MASS]), ("moment with the largest error", MOMENTS))):
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
