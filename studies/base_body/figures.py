"""Figures of the study."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import AFTER, BEFORE, COLOURS, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.base_body import paper
from studies.base_body.result import BaseBody
from studies.common.ets7 import BASE
from studies.common.quantities import LABELS

__all__ = ["errors", "posterior", "precision"]

REACH = 7.0
"""Half-height of the panel of mass, centre of mass and moments [%]; points beyond are marked at its edge."""


@styled
def precision(result: BaseBody) -> Figure:
    """Draw the relative standard deviation of every quantity by speed and knowledge of the arm."""
    figure = wide_figure(2.9)
    axes = figure.subplots()
    looks = {
        "permitted, arm exact": (AFTER, "o", "at the permitted speed, arm exact"),
        "permitted, arm 5 %": (AFTER, "s", "at the permitted speed, arm known to 5 %"),
        "faster, arm exact": (COLOURS[5], "^", f"{result.slowness:.1f} times faster, arm exact"),
        "faster, arm 5 %": (COLOURS[5], "v", f"{result.slowness:.1f} times faster, arm known to 5 %"),
    }
    place = np.arange(len(LABELS))
    for shift, (name, values) in zip((-0.24, -0.08, 0.08, 0.24), result.precision.items(), strict=True):
        colour, marker, label = looks[name]
        face = colour if name.endswith("exact") else "white"
        axes.plot(place + shift, 100.0 * values, marker, color=colour, label=label, markersize=5, mfc=face)
    axes.set(yscale="log", ylabel="relative sd [%]")
    axes.set_xticks(place, LABELS)
    shared_legend(figure, axes, 2)
    return figure


@styled
def errors(result: BaseBody) -> Figure:
    """Draw the relative errors of the ten quantities, the paper's and those of this study."""
    figure = wide_figure(3.4)
    axes = figure.subplots()
    series = {
        "paper, well exciting": paper.RESULT_WELL / paper.TRUTH - 1.0,
        "paper, poorly exciting": paper.RESULT_POOR / paper.TRUTH - 1.0,
        **{f"here, {name}": case.error for name, case in result.noise_free.items()},
    }
    place = np.arange(len(LABELS))
    for index, (name, error) in enumerate(series.items()):
        marker = "os^vDPX*"[index % 8]
        colour = BEFORE if name.startswith("paper") else AFTER
        axes.plot(place + 0.06 * (index - 3.5), np.abs(error), marker, color=colour, label=name, markersize=4)
    axes.axhline(1e-6, color="black", linewidth=0.8, linestyle="--")
    axes.text(place[-1] + 0.4, 1.2e-6, "goal", ha="right", va="bottom")
    axes.set(yscale="log", ylabel="relative error")
    axes.set_xticks(place, LABELS)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=4)
    return figure


@styled
def posterior(result: BaseBody) -> Figure:
    """Draw posterior means and standard deviations beside what the paper printed, relative to the truth."""
    figure = wide_figure(3.0)
    panels = figure.subplots(1, 2, width_ratios=(7, 3))
    for axes, pick in ((panels[0], slice(0, 7)), (panels[1], slice(7, 10))):
        place = np.arange(10)[pick]
        for index, (name, identified) in enumerate(result.sampled.items()):
            body = identified.bodies[BASE]
            axes.errorbar(
                place + 0.15 * (2 * index - 1),
                100.0 * (body.mean / paper.TRUTH - 1.0)[pick],
                100.0 * (body.sd / np.abs(paper.TRUTH))[pick],
                fmt="o",
                markersize=3,
                capsize=2,
                color=(AFTER, COLOURS[5])[index],
                label=f"posterior, arm {name}",
            )
        for printed, marker, name in ((paper.RESULT_WELL, "x", "paper, well"), (paper.RESULT_POOR, "+", "paper, poor")):
            error = 100.0 * (printed / paper.TRUTH - 1.0)[pick]
            axes.plot(place, error, marker, color=BEFORE, label=name, markersize=5)
            for x, value in zip(place, error, strict=True):
                if axes is panels[0] and abs(value) > REACH:
                    text = f"{format_number(float(value), 2)} %"
                    edge = float(np.copysign(REACH, value))
                    axes.plot(x, 0.97 * edge, "v" if value < 0.0 else "^", color=BEFORE, markersize=4)
                    axes.annotate(text, (x, 0.97 * edge), (5, 0), textcoords="offset points", color=BEFORE, va="center")
        axes.axhline(0.0, color=TRUTH, linewidth=0.8)
        axes.set_xticks(place, LABELS[pick])
    panels[0].set(ylabel="difference from the truth [%]", ylim=(-REACH, REACH))
    panels[0].legend(ncols=2, loc="upper right")
    return figure
