"""Figures of the study."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.report.figures import corner
from bayesid.report.figures.figure_style import COLOURS, curve_style, shared_legend, styled, wide_figure
from studies.base_body import paper
from studies.base_body.result import GRADES, BaseBody
from studies.common.ets7 import BASE
from studies.common.quantities import LABELS, MASS, MOMENTS

__all__ = ["draw"]


def draw(result: BaseBody) -> dict[str, Figure]:
    """Return all figures that the numbers allow."""
    figures = {"motion": motion(result), "errors": errors(result), "grades": grades(result)}
    if result.sampled:
        figures["posterior"] = posterior(result)
        figures["corner"] = corner(result.sampled["exact"].bodies[BASE])
    return figures


@styled
def motion(result: BaseBody) -> Figure:
    """Draw the base's motion as in the paper's figure 4."""
    figure = wide_figure(4.6)
    panels = figure.subplots(2, 2)
    limit = 1.1e3 * max(result.noise_free[name].peak.max() for name in ("well", "poor"))
    for axes, name, title in zip(panels[0], ("well", "poor"), ("the paper's", "poorly exciting"), strict=True):
        time, rate = result.noise_free[name].recording.vector("rate")
        _curves(axes, time, 1e3 * rate, f"rate, {title} manoeuvre", "mrad/s")
        axes.set_ylim(-limit, limit)
    fast = result.fast.truth
    turned = np.degrees(2.0 * fast.attitude[:, :3])
    _curves(panels[1, 0], fast.time, turned, "rotation since the start, the paper's manoeuvre", "deg")
    _curves(panels[1, 1], fast.time, 1e3 * fast.accel, "accelerometer, the paper's manoeuvre", "mm/s²")
    for axes in panels[1]:
        axes.set_xlabel("time [s]")
    shared_legend(figure, panels[0, 0], 3)
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
        axes.plot(place, np.abs(error), marker, color=COLOURS[index % len(COLOURS)], label=name, markersize=4)
    axes.axhline(1e-6, color="black", linewidth=0.8, linestyle="--")
    axes.text(place[-1] + 0.4, 1.2e-6, "goal", ha="right", va="bottom")
    axes.set(yscale="log", ylabel="relative error")
    axes.set_xticks(place, LABELS)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=4)
    return figure


@styled
def grades(result: BaseBody) -> Figure:
    """Draw the posterior's width against the accelerometer's grade."""
    figure = wide_figure(2.8)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, pick, title in ((panels[0], [MASS], "mass"), (panels[1], MOMENTS, "worst moment of inertia")):
        for index, (name, rows) in enumerate(result.grades.items()):
            worst = 100.0 * rows[:, pick].max(axis=1)
            axes.plot(GRADES, worst, marker="o", markersize=3, label=f"arm {name}", **curve_style(index))
        axes.set(xscale="log", yscale="log", title=title, xlabel="accelerometer's noise [m/s²]")
        axes.invert_xaxis()
    panels[0].set_ylabel("relative sd [%]")
    panels[0].legend()
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
                color=COLOURS[index],
                label=f"posterior, arm {name}",
            )
        for printed, marker, name in ((paper.RESULT_WELL, "x", "paper, well"), (paper.RESULT_POOR, "+", "paper, poor")):
            error = 100.0 * (printed / paper.TRUTH - 1.0)[pick]
            axes.plot(place, error, marker, color="black", label=name, markersize=5)
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_xticks(place, LABELS[pick])
    panels[0].set(ylabel="difference from the truth [%]", ylim=(-7.0, 7.0))
    panels[0].legend(ncols=2, loc="lower left")
    return figure


def _curves(axes: Axes, time: Floats, values: Floats, title: str, unit: str) -> None:
    for index, axis in enumerate("xyz"):
        axes.plot(time, values[:, index], label=axis, **curve_style(index))
    axes.set(title=title, ylabel=f"[{unit}]")
