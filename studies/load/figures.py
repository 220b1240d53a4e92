"""Figures of the study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.figures.figure_style import COLOURS, curve_style, styled, wide_figure
from studies.load import paper
from studies.load.noise_free import Iteration, errors
from studies.load.sampled import Flight

__all__ = ["error_figure", "motion_figure", "width_figure"]

LABELS = [key.replace("inertia.", "I ").replace("com.", "c ") for key in BODY_QUANTITIES]


@styled
def motion_figure(iterations: Sequence[Iteration]) -> Figure:
    """Draw the joints that move and the base's rate, of both noise-free iterations."""
    figure = wide_figure(3.6)
    panels = figure.subplots(2, 2, sharex=True)
    for column, iteration in enumerate(iterations):
        recording = iteration.recording
        for index in range(3):
            position = recording.channels[f"position.joint{index + 1}"]
            panels[0, column].plot(recording.time, position, label=f"joint {index + 1}", **curve_style(index))
        time, rate = recording.vector("rate")
        for index, axis in enumerate("xyz"):
            panels[1, column].plot(time, 1e3 * rate[:, index], label=axis, **curve_style(index))
        panels[0, column].set_title(f"iteration {column + 1}")
        panels[1, column].set_xlabel("time [s]")
    panels[0, 0].set_ylabel("joints [rad]")
    panels[1, 0].set_ylabel("rate of the base [mrad/s]")
    for row in panels:
        row[1].legend(loc="upper right")
    return figure


@styled
def error_figure(iterations: Sequence[Iteration]) -> Figure:
    """Draw relative errors of the ten quantities: the paper's and ours."""
    figure = wide_figure(2.8)
    axes = figure.subplots()
    place = np.arange(len(LABELS))
    for index, (name, estimates) in enumerate(
        (("paper", list(paper.RESULTS)), ("here, no noise", [item.estimate for item in iterations]))
    ):
        for number, estimate in enumerate(estimates, start=1):
            error = np.abs(errors(estimate))
            error[error == 0.0] = np.nan  # printed exactly
            marker = "o" if number == 1 else "s"
            axes.plot(
                place, error, marker, color=COLOURS[index], fillstyle="none" if number == 1 else "full",
                label=f"{name}, iteration {number}", markersize=4,
            )  # fmt: skip
    axes.axhline(1e-6, color="black", linewidth=0.8, linestyle="--")
    axes.text(place[-1] + 0.4, 1.3e-6, "goal", ha="right", va="bottom")
    axes.set(yscale="log", ylabel="relative error", ylim=(1e-11, 1.0))
    axes.set_xticks(place, LABELS)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=4)
    return figure


@styled
def width_figure(flights: Mapping[str, Flight], titles: Mapping[str, str]) -> Figure:
    """Draw posterior mean and sd against the truth after the last step, and the sd of every step."""
    figure = wide_figure(3.2)
    widths, shifts = figure.subplots(1, 2)
    place = np.arange(len(LABELS))
    for index, (name, flight) in enumerate(flights.items()):
        offset = 0.22 * (index - 0.5 * (len(flights) - 1))
        for step in range(len(flight.bodies)):
            widths.plot(
                place + offset,
                flight.relative(step),
                "o" if step == 0 else "s",
                color=COLOURS[index],
                fillstyle="none" if step == 0 else "full",
                markersize=4,
                label=f"{titles[name]}, step {step + 1}",
            )
        if flight.bodies:
            last = len(flight.bodies) - 1
            shifts.errorbar(
                place + offset, flight.shift(last), 1.0, fmt="s", color=COLOURS[index], markersize=4, capsize=2
            )
    widths.set(yscale="log", title="relative sd")
    shifts.axhline(0.0, color="black", linewidth=0.6)
    shifts.set(title="mean less truth after the last step, in sd", ylim=(-4.0, 4.0))
    for axes in (widths, shifts):
        axes.set_xticks(place, LABELS, rotation=60)
    figure.legend(*widths.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure
