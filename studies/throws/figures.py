"""Figures of the study."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import styled, wide_figure
from studies.throws.analysis import Analysis

__all__ = ["throws_figure"]


@styled
def throws_figure(plain: Analysis, extended: Analysis) -> Figure:
    """Draw the errors of single throws, a row per body, a column per model."""
    figure = wide_figure(2.0 * len(extended.bodies))
    panels = figure.subplots(len(extended.bodies), 2, sharey="row", squeeze=False)
    for row, body in zip(panels, extended.bodies, strict=True):
        for axes, analysis in zip(row, (plain, extended), strict=True):
            result = analysis.bodies[body]
            band = float(100.0 * (result.truth_sd / result.truth).max())
            axes.axhspan(-band, band, color="#eeeeee")
            axes.axhline(0.0, color="#888888", linewidth=0.8)
            places = np.arange(len(result.throws))
            for index, name in enumerate(("smallest", "middle", "largest")):
                sd = 100.0 * result.formal[:, index] / result.truth[index]
                place = places + 0.2 * (index - 1)
                axes.errorbar(
                    place, result.errors[:, index], sd, fmt="os^"[index], markersize=3, linewidth=1, label=name
                )
            axes.set_xticks(places, [name[-3:] for name in result.throws])
            axes.set_title(f"{body}, {analysis.label} model")
        row[0].set_ylabel("error [%]")
    for axes in panels[-1]:
        axes.set_xlabel("number of the throw")
    panels[0][1].legend(title="principal moment")
    return figure
