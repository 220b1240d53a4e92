"""Strengths of the candidates of a diagnosis, and the reconstructed disturbance over time and by frequency."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Candidate, DisturbingWrench, Frame
from bayesid.diagnosis.outcome.torque_of_causes import torque_spectrum
from bayesid.report.figures.figure_style import (
    COLOURS,
    curve_style,
    decimal_scale,
    shared_legend,
    styled,
    title_panel,
    wide_figure,
)

__all__ = ["candidate_strengths", "wrench_histories", "wrench_spectrum"]

FEW = 7
"""Largest number of recordings in one figure."""


@styled
def candidate_strengths(rows: Sequence[Candidate], named: Sequence[str], alarm: float) -> Figure:
    """Draw the signal-to-noise ratio of candidates as bars.

    Parameters
    ----------
    rows : sequence of Candidate
    named : sequence of str
        Causes that the verdict names.
    alarm : float
        Family-wise p-value below which a candidate is significant.
    """
    figure = wide_figure(0.75 + 0.155 * len(rows))
    axes = figure.subplots()
    place = np.arange(len(rows))[::-1]
    kinds = {"named": COLOURS[0], "significant": "#777777", "not significant": "#cccccc"}
    state = [
        "named" if row.name in named else "significant" if row.p_value_adjusted < alarm else "not significant"
        for row in rows
    ]
    strength = np.array([row.signal_to_noise for row in rows])
    for kind, colour in kinds.items():
        chosen = [index for index, item in enumerate(state) if item == kind]
        if chosen:
            axes.barh(place[chosen], strength[chosen], color=colour, height=0.7, label=kind)
    for y, value in zip(place, strength, strict=True):
        axes.annotate(f"{value:.1f}", (value, y), (2, 0), textcoords="offset points", va="center")
    axes.set_yticks(place, [row.name for row in rows])
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.set_xlim(0.0, 1.08 * max(float(strength.max(initial=0.0)), 3.0))
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("signal-to-noise ratio")
    axes.legend(loc="lower right")
    return figure


@styled
def wrench_histories(wrench: DisturbingWrench, frame: Frame, cause: Sequence[Floats] | None = None) -> Figure:
    """Draw a reconstructed torque, and force where it is seen, over time in the axes of one frame, ± 1 sd in base axes.

    Parameters
    ----------
    wrench : DisturbingWrench
    frame : Frame
    cause : sequence of (S, 3) arrays, optional
        Torque of the named causes in each recording, in the same axes, drawn over the reconstructed one.
    """
    families = [("torque", "N m", wrench.torque[frame], wrench.torque_sd)]
    if all(np.isfinite(force).all() for force in wrench.force[frame]):
        families.append(("force", "N", wrench.force[frame], wrench.force_sd))
    figure = wide_figure(1.8 * len(families))
    panels = figure.subplots(len(families), 3, squeeze=False, sharex=True)
    for row, (title, unit, values, spread) in enumerate(families):
        scale, prefix = decimal_scale(np.concatenate([np.abs(value).ravel() for value in values[:FEW]]))
        for axis in range(3):
            axes = panels[row, axis]
            for index, name in enumerate(wrench.names[:FEW]):
                time, value = wrench.time[index], values[index][:, axis] / scale
                style = curve_style(index)
                if frame is Frame.BASE:
                    sd = spread[index][:, axis] / scale
                    axes.fill_between(time, value - sd, value + sd, color=style["color"], alpha=0.18, linewidth=0.0)
                axes.plot(time, value, linewidth=0.9, label=name, **style)
                if cause is not None and title == "torque":
                    axes.plot(time, cause[index][:, axis] / scale, "--", color="black", linewidth=0.9)
            axes.axhline(0.0, color="black", linewidth=0.5)
            title_panel(axes, f"{title} {'xyz'[axis]} [{prefix}{unit}]")
            axes.locator_params(axis="both", nbins=4)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    if cause is not None:
        panels[0, 0].plot([], [], "--", color="black", label="named causes")
    shared_legend(figure, panels[0, 0], columns=4)
    return figure


@styled
def wrench_spectrum(wrench: DisturbingWrench) -> Figure:
    """Draw the amplitude of the reconstructed torque by frequency, in base axes, one curve per recording."""
    figure = wide_figure(1.9)
    panels = figure.subplots(1, 3, squeeze=False)
    series = [torque_spectrum(wrench, index) for index in range(len(wrench.names[:FEW]))]
    scale, prefix = decimal_scale(np.concatenate([amplitude.ravel() for _, amplitude in series]))
    for axis in range(3):
        axes = panels[0, axis]
        for index, (frequency, amplitude) in enumerate(series):
            axes.plot(
                frequency, amplitude[:, axis] / scale, linewidth=0.9, label=wrench.names[index], **curve_style(index)
            )
        title_panel(axes, f"torque {'xyz'[axis]} [{prefix}N m]")
        axes.set_xlabel("frequency [Hz]")
        axes.locator_params(axis="both", nbins=4)
    panels[0, 0].set_ylabel("amplitude")
    shared_legend(figure, panels[0, 0], columns=4)
    return figure
