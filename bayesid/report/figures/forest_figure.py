"""Inertial parameters as a forest: prior, fitted without the named causes, fitted with them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from bayesid.diagnosis.outcome.cause_sizes import Z95
from bayesid.diagnosis.outcome.model_change import ParameterChange
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure

__all__ = ["parameter_forest"]

GIVEN = "#999999"
"""Colour of the values given and their prior."""


@styled
def parameter_forest(changes: Sequence[ParameterChange], named: bool = True) -> Figure:
    """Draw every parameter about its given value, in widths of the prior, as bars of 95 %.

    Parameters
    ----------
    changes : sequence of ParameterChange
    named : bool
        Whether causes are named, so that there is a fit with them.
    """
    figure = wide_figure(0.7 + 0.26 * len(changes))
    axes = figure.subplots()
    rows = np.arange(len(changes))[::-1].astype(float)
    series = [
        ("given, prior", GIVEN, 0.22, [(item.given, item.prior_sd) for item in changes]),
        ("without" if named else "fitted", COLOURS[1], 0.0, [(item.without, item.without_sd) for item in changes]),
    ]
    if named:
        series.append(("with", COLOURS[0], -0.22, [(item.fitted, item.fitted_sd) for item in changes]))
    for name, colour, offset, values in series:
        centre = [(mean - item.given) / item.prior_sd for (mean, _), item in zip(values, changes, strict=True)]
        reach = [Z95 * sd / item.prior_sd for (_, sd), item in zip(values, changes, strict=True)]
        axes.errorbar(centre, rows + offset, xerr=reach, fmt="o", color=colour, markersize=3, linewidth=1.3, label=name)
    axes.axvline(0.0, color="black", linewidth=0.5)
    axes.set_yticks(rows, [item.name for item in changes])
    axes.set_ylim(-0.6, len(changes) - 0.4)
    axes.set_xlabel("distance from the value given [widths of the prior]")
    axes.grid(visible=False, axis="y")
    axes.legend(loc="upper right", ncols=3, bbox_to_anchor=(1.0, 1.14))
    return figure
