"""Figures of the study's report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.figures.figure_style import COLOURS, curve_style, shared_legend, styled, wide_figure
from studies.load import paper
from studies.load.noise_free import Iteration
from studies.load.sampled import Flight

__all__ = ["error_figure", "motion_figure", "width_figure"]

LABELS = [key.replace("inertia.", "I ").replace("com.", "c ") for key in BODY_QUANTITIES]
"""Short labels of the ten quantities."""

FILLS = ("none", "full")
"""Markers of the first and the second iteration or step, open and filled."""


@styled
def motion_figure(iterations: Sequence[Iteration]) -> Figure:
    """Draw the joints that move and the base's rate, in both noise-free iterations."""
    figure = wide_figure(3.6)
    panels = figure.subplots(2, 2, sharex=True)
    for number, ((joints, rates), iteration) in enumerate(zip(panels.T, iterations, strict=True), start=1):
        recording = iteration.recording
        for index in range(3):
            position = recording.channels[f"position.joint{index + 1}"]
            joints.plot(recording.time, position, label=f"joint {index + 1}", **curve_style(index))
        time, rate = recording.vector("rate")
        for index, axis in enumerate("xyz"):
            rates.plot(time, 1e3 * rate[:, index], label=axis, **curve_style(index))
        joints.set_title(f"iteration {number}")
        rates.set_xlabel("time [s]")
    for row, label in zip(panels, ("joints [rad]", "rate of the base [mrad/s]"), strict=True):
        row[0].set_ylabel(label)
        row[1].legend(loc="upper right")
    return figure


@styled
def error_figure(iterations: Sequence[Iteration]) -> Figure:
    """Draw the relative errors of the ten quantities, as printed in the paper and as reached here."""
    figure = wide_figure(2.8)
    axes = figure.subplots()
    place = np.arange(len(LABELS))
    series = {"paper": list(paper.RESULTS), "here, no noise": [item.estimate for item in iterations]}
    for colour, (name, estimates) in zip(COLOURS, series.items(), strict=False):
        for number, estimate in enumerate(estimates):
            error = np.abs(paper.errors(estimate))
            error[error == 0.0] = np.nan  # printed exactly
            look: dict[str, Any] = {
                "color": colour,
                "fillstyle": FILLS[number],
                "label": f"{name}, iteration {number + 1}",
            }
            axes.plot(place, error, "os"[number], markersize=4, **look)
    axes.axhline(1e-6, color="black", linewidth=0.8, linestyle="--")
    axes.text(place[-1] + 0.4, 1.3e-6, "goal", ha="right", va="bottom")
    axes.set(yscale="log", ylabel="relative error", ylim=(1e-11, 1.0))
    axes.set_xticks(place, LABELS)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=4)
    return figure


@styled
def width_figure(flights: Mapping[str, Flight], titles: Mapping[str, str]) -> Figure:
    """Draw the posterior standard deviation of every step, and the last step's mean against the truth."""
    figure = wide_figure(3.2)
    widths, shifts = figure.subplots(1, 2)
    place = np.arange(len(LABELS))
    for index, (name, flight) in enumerate(flights.items()):
        moved = place + 0.22 * (index - 0.5 * (len(flights) - 1))
        for step in range(len(flight.bodies)):
            look = {"color": COLOURS[index], "fillstyle": FILLS[step > 0], "label": f"{titles[name]}, step {step + 1}"}
            widths.plot(moved, flight.relative(step), "os"[step > 0], markersize=4, **look)
        if flight.bodies:
            shifts.errorbar(moved, flight.shift(-1), 1.0, fmt="s", color=COLOURS[index], markersize=4, capsize=2)
    widths.set(yscale="log", title="relative standard deviation")
    shifts.axhline(0.0, color="black", linewidth=0.6)
    shifts.set(title="last mean less truth [standard deviations]", ylim=(-4.0, 4.0))
    for axes in (widths, shifts):
        axes.set_xticks(place, LABELS, rotation=60)
    shared_legend(figure, widths, 3, place="outside lower center")
    return figure
