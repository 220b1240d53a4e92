"""Figures of the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from bayesid.design.plan import Trajectory
from bayesid.report.figures.figure_style import COLOURS, shared_legend, styled, wide_figure
from studies.common.ets7 import LIMITS

__all__ = ["manoeuvre_figure", "repetition_figure"]


@styled
def manoeuvre_figure(trajectory: Trajectory) -> Figure:
    """Draw the joints, the tip's speed and the base's rotation along a manoeuvre."""
    figure = wide_figure(2.3)
    left, middle, right = figure.subplots(1, 3)
    for index, values in enumerate(np.asarray(trajectory.position).T):
        left.plot(trajectory.time, values, color=COLOURS[index], label=f"joint {index + 1}")
    left.set(ylabel="position [rad]")
    middle.plot(trajectory.time, 1e3 * np.asarray(trajectory.tip_speed), color=COLOURS[0])
    middle.axhline(1e3 * (LIMITS.tip_speed or 0.0), color="#888888", linestyle="--")
    middle.set(ylabel="speed of the tip [mm/s]")
    right.plot(trajectory.time, np.degrees(np.asarray(trajectory.rotation)), color=COLOURS[0])
    right.set(ylabel="rotation of the base [deg]")
    for axes in (left, middle, right):
        axes.set_xlabel("time [s]")
    shared_legend(figure, left, 6)
    return figure


@styled
def repetition_figure(
    repetitions: Sequence[float], curves: Mapping[tuple[str, bool], Sequence[float]], duration: float
) -> Figure:
    """Draw the worst relative standard deviation against the time spent moving."""
    figure = wide_figure(2.6)
    axes = figure.subplots()
    hours = np.array(repetitions) * duration / 3600.0
    for index, ((name, known), values) in enumerate(curves.items()):
        label = f"{name} manoeuvre, arm {'known exactly' if known else 'known to 5 %'}"
        axes.plot(
            hours, 100.0 * np.array(values), color=COLOURS[index // 2], linestyle="-" if known else "--", label=label
        )
    axes.axhline(1.0, color="#888888", linewidth=0.8)
    axes.set(xscale="log", yscale="log", xlabel="time spent moving [h]", ylabel="largest relative sd [%]")
    axes.legend()
    return figure
