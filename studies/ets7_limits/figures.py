"""Figure of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import COLOURS, shared_legend, styled, wide_figure
from studies.common import mission

__all__ = ["repetition_figure"]


@styled
def repetition_figure(repetitions: Sequence[float], curves: Mapping[tuple[str, bool], Sequence[float]]) -> Figure:
    """Draw the worst relative standard deviation against the time spent moving."""
    figure = wide_figure(2.7)
    axes = figure.subplots()
    hours = np.array(repetitions) * mission.DURATION / 3600.0
    for index, ((name, known), values) in enumerate(curves.items()):
        label = f"{name} manoeuvre, arm {'exact' if known else '5 %'}"
        line = "--" if known else "-"
        axes.plot(hours, 100.0 * np.array(values), color=COLOURS[index // 2], linestyle=line, label=label)
    axes.axhline(1.0, color="#888888", linewidth=0.8)
    axes.set(xscale="log", yscale="log", xlabel="time spent moving [h]", ylabel="largest relative sd [%]")
    axes.set_yticks(*_ticks(axes.get_ylim()))
    shared_legend(figure, axes, 2, place="outside lower center")
    return figure


def _ticks(limits: tuple[float, float]) -> tuple[list[float], list[str]]:
    values = [value for value in (0.001, 0.01, 0.1, 1.0, 10.0, 100.0) if limits[0] <= value <= limits[1]]
    return values, [f"{value:g}" for value in values]
