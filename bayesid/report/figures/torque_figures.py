"""Measured and simulated joint torques."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.sensor_fit import TorqueFit

__all__ = ["torques_over_time"]

COLUMNS = 3


@styled
def torques_over_time(fits: Sequence[TorqueFit]) -> Figure:
    """Draw the torque of each joint in one recording, with the whitened residual of the samples used beneath."""
    count = -(-len(fits) // COLUMNS)
    figure = wide_figure(0.3 + 1.9 * count)
    panels = figure.subplots(
        2 * count, COLUMNS, squeeze=False, sharex=True, gridspec_kw={"height_ratios": [1.5, 1.0] * count}
    )
    for index in range(count * COLUMNS):
        row, column = divmod(index, COLUMNS)
        above, below = panels[2 * row, column], panels[2 * row + 1, column]
        if index >= len(fits):
            above.set_axis_off()
            below.set_axis_off()
            continue
        fit = fits[index]
        above.plot(fit.time, fit.measured, ".", color=COLOURS[5], markersize=2.0, label="measured")
        above.plot(fit.time, fit.predicted, color="black", linewidth=0.6, label="simulated, as identified")
        above.set_title(f"{fit.joint} [{fit.unit}]")
        below.axhspan(-2.0, 2.0, color="#e8e8e8", linewidth=0.0)
        below.plot(fit.residual_time, fit.residual, ".", color=COLOURS[1], markersize=1.5)
        largest = float(np.max(np.abs(fit.residual), initial=0.0))
        below.set_ylim(-max(4.5, 1.1 * largest), max(4.5, 1.1 * largest))
        if column == 0:
            below.set_ylabel("residual [\u03c3]")
        for axes in (above, below):
            axes.locator_params(axis="both", nbins=4)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, markerscale=2.0)
    return figure
