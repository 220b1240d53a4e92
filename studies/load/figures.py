"""Figures of the study's report."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import AFTER, BEFORE, COLOURS, shared_legend, styled, wide_figure
from studies.common.quantities import LABELS
from studies.load import paper
from studies.load.noise_free import Iteration
from studies.load.safe_loop import GOAL, LIMITED, Flight
from studies.load.setting import SAFE

__all__ = ["TITLES", "error_figure", "loop_figure"]

TITLES = {"loop": "arm known to 5 %", "exact": "arm known exactly"}
"""What is known of the arm, the headline first."""

LIMIT_TITLES = {"tip_speed": "tip speed", "tip_rate": "tip rate", "base_rotation": "base rotation"}
"""Titles of the limits."""


@styled
def loop_figure(flights: dict[str, Flight]) -> Figure:
    """Draw the error and the standard deviation of the mass after every manoeuvre, and what it used of the limits."""
    figure = wide_figure(2.6)
    left, right = figure.subplots(1, 2)
    for index, (name, flight) in enumerate(flights.items()):
        steps = np.arange(1, len(flight.bodies) + 1)
        error = [abs(flight.error(step)[0]) for step in range(len(steps))]
        sd = [flight.relative(step)[0] for step in range(len(steps))]
        colour = COLOURS[index]
        left.plot(steps, 100.0 * np.array(sd), "-", color=colour, label=f"sd, {TITLES[name]}")
        left.plot(steps, 100.0 * np.array(error), "o", color=colour, markersize=4, label=f"error, {TITLES[name]}")
    left.axhline(100.0 * GOAL, color="#888888", linestyle=":")
    left.text(0.55, 110.0 * GOAL, "wanted", fontsize=8, va="bottom")
    flown = next(iter(flights.values()))
    steps = np.arange(1, len(flown.bodies) + 1)
    left.set(yscale="log", xlabel="manoeuvre", ylabel="error or sd of the mass [%]", xlim=(0.5, steps[-1] + 0.5))
    left.set_xticks(steps)
    for index, name in enumerate(LIMITED):
        part = 100.0 * np.array([row[name] for row in flown.largest]) / getattr(SAFE, name)
        right.bar(steps + 0.25 * (index - 1), part, 0.22, color=COLOURS[index + 2], label=LIMIT_TITLES[name])
    right.axhline(100.0, color="black", linewidth=0.8)
    right.set(xlabel="manoeuvre", ylabel="share of the limit [%]", ylim=(0.0, 145.0))
    right.set_xticks(steps)
    right.legend(loc="upper left", ncols=2)
    shared_legend(figure, left, 4, place="outside lower center")
    return figure


@styled
def error_figure(iterations: list[Iteration]) -> Figure:
    """Draw the relative errors of the ten quantities, as printed in the paper and as reached here."""
    figure = wide_figure(2.4)
    axes = figure.subplots()
    place = np.arange(len(LABELS))
    series = {"paper": list(paper.RESULTS), "here, no noise": [item.estimate for item in iterations]}
    for colour, (name, estimates) in zip((BEFORE, AFTER), series.items(), strict=True):
        for number, estimate in enumerate(estimates):
            error = np.abs(paper.errors(estimate))
            error[error == 0.0] = np.nan  # printed exactly
            fill = "full" if number else "none"
            label = f"{name}, iteration {number + 1}"
            axes.plot(place, error, "os"[number], color=colour, fillstyle=fill, markersize=4, label=label)
    axes.set(yscale="log", ylabel="relative error")
    axes.set_xticks(place, LABELS)
    shared_legend(figure, axes, 4, place="outside lower center")
    return figure
