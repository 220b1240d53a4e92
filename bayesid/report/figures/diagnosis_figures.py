"""Figures of a diagnosis: verdict, strengths of candidates, disturbance, parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Candidate, Diagnosis, DisturbingWrench, Frame
from bayesid.diagnosis.outcome.cause_sizes import Z95
from bayesid.diagnosis.outcome.gain import ParameterChange
from bayesid.diagnosis.outcome.joint_error import JointError
from bayesid.diagnosis.outcome.torque_of_causes import torque_of_causes, torque_spectrum
from bayesid.inference.residual_view import ResidualView
from bayesid.report.figures.figure_style import (
    AFTER,
    BAND,
    BEFORE,
    COLOURS,
    PageFigure,
    axis_title,
    curve_style,
    decimal_scale,
    panels_of,
    residual_limits,
    shared_legend,
    styled,
    title_panel,
    wide_figure,
)
from bayesid.report.figures.residual_figures import SIDES, draw_history
from bayesid.report.figures.robot_with_causes import draw_robot_with_causes
from bayesid.report.numbers import format_signed
from bayesid.simulation.sensors import SensorKind

__all__ = [
    "GIVEN",
    "candidate_strengths",
    "joint_error_curve",
    "moved_axis",
    "parameter_forest",
    "plot_disturbance",
    "plot_verdict",
    "wrench_histories",
    "wrench_spectrum",
]

BEYOND = 1.35  # half-width of the figure of parameters, relative to the furthest end of a bar of a fit
FEW = 7  # largest number of recordings in one figure

GIVEN = "#8c8c8c"
"""Colour of the values given and their prior."""

PARAMETERS_SHOWN = (
    ("given, prior", GIVEN, 0.22, "given", "prior_sd"),
    ("without", BEFORE, 0.0, "without", "without_sd"),
    ("with", AFTER, -0.22, "fitted", "fitted_sd"),
)
"""Name, colour, height and attributes of the values of a parameter that are drawn."""


@styled
def plot_verdict(result: Diagnosis, recording: int | None = None, *, axes: Any = None) -> Figure:
    """Draw the robot with the causes where they act, and the residual of the axis that they change most.

    Parameters
    ----------
    result : Diagnosis
        Result of `diagnose`.
    recording : int, optional
        Number of the recording, by default that where the causes change most.
    axes : sequence of Axes, optional
        Panels of the robot, and of the residual before and, where causes are named, after; by default those of a new
        figure.
    """
    recording = result.strongest_recording if recording is None else recording
    sides = result.residuals
    if axes is None:
        figure = wide_figure(2.4)
        grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.35])
        panels = [figure.add_subplot(grid[0])]
        panels += list(grid[1].subgridspec(len(sides), 1).subplots(squeeze=False, sharex=True)[:, 0])
    else:
        figure, given = panels_of(axes, 1, 1 + len(sides), 2.3)
        panels = list(given[0])
    draw_robot_with_causes(panels[0], result, recording)
    kind, axis = moved_axis(sides, recording)
    values = [side.series(recording, kind, axis) for side in sides]
    for axes, (time, value), (name, colour) in zip(panels[1:], values, SIDES, strict=False):
        axes.axhspan(-2.0, 2.0, **BAND)
        draw_history(axes, time, value, colour, name)
        residual_limits(axes, np.concatenate([own for _, own in values]))
        axes.set_title(f"{axis_title(kind, axis)}, {name}" if len(sides) > 1 else axis_title(kind, axis))
        axes.set_ylabel("residual [σ]")
        axes.locator_params(axis="both", nbins=4)
    for axes in panels[-1:] if isinstance(figure, PageFigure) else panels[1:]:
        axes.set_xlabel("time [s]")
    return figure


def moved_axis(sides: list[ResidualView], recording: int) -> tuple[SensorKind, int]:
    """Return the sensor axis of a recording whose sum of squares decreases most, or is largest of a single side."""

    def gain(kind: SensorKind, axis: int) -> float:
        squares = [float(np.sum(side.series(recording, kind, axis)[1] ** 2)) for side in sides]
        return squares[0] - sum(squares[1:])

    return max(((kind, axis) for kind in sides[0].kinds for axis in range(kind.size)), key=lambda item: gain(*item))


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


def plot_disturbance(result: Diagnosis, frame: str | Frame = Frame.BASE, *, axes: Any = None) -> Figure:
    """Draw the torque, and the force if observable, that would explain the residual, and that of the named causes.

    Parameters
    ----------
    result : Diagnosis
        Result of `diagnose`.
    frame : str or Frame
        Axes: ``"base"``, ``"orbit"`` or ``"inertial"``.
    axes : array_like of Axes, optional
        Panels to draw in, three for the torque and three for the force if observable; by default of a new figure.
    """
    cause = torque_of_causes(result.after) if result.named else None
    return wrench_histories(result.disturbance, Frame(frame), cause, axes)


@styled
def wrench_histories(
    wrench: DisturbingWrench, frame: Frame, cause: Sequence[Floats] | None = None, axes: Any = None
) -> Figure:
    """Draw a reconstructed torque, and force if observable, over time in the axes of one frame, ± 1 sd in base axes.

    Parameters
    ----------
    wrench : DisturbingWrench
    frame : Frame
    cause : sequence of (S, 3) arrays, optional
        Torque of the named causes in each recording, in the same axes, drawn over the reconstructed one.
    axes : array_like of Axes, optional
        Panels to draw in, three for the torque and three for the force if observable; by default of a new figure.
    """
    families = [("torque", "N m", wrench.torque[frame], wrench.torque_sd)]
    if all(np.isfinite(force).all() for force in wrench.force[frame]):
        families.append(("force", "N", wrench.force[frame], wrench.force_sd))
    figure, panels = panels_of(axes, len(families), 3, 1.8 * len(families), sharex=True)
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


@styled
def joint_error_curve(error: JointError) -> Figure:
    """Draw the error of a joint's recorded position by the position, with a band of one standard deviation."""
    figure = wide_figure(1.9)
    axes = figure.subplots()
    scale, prefix = decimal_scale(error.errors)
    middle, half = error.errors / scale, error.deviations / scale
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.fill_between(error.positions, middle - half, middle + half, color=AFTER, alpha=0.25, linewidth=0.0)
    axes.plot(error.positions, middle, color=AFTER)
    axes.set_xlabel(f"recorded position of {error.joint} [{error.unit}]")
    axes.set_ylabel(f"error [{prefix}{error.unit}]")
    return figure


@styled
def parameter_forest(changes: Sequence[ParameterChange]) -> Figure:
    """Draw every parameter about the fit without the named causes, in its standard deviations, as bars of 95 %.

    The axis is limited to the fits; a given value beyond it is stated at the edge.

    Parameters
    ----------
    changes : sequence of ParameterChange
    """
    figure = wide_figure(0.7 + 0.24 * len(changes))
    axes = figure.subplots()
    rows = np.arange(len(changes))[::-1].astype(float)
    centre, sd = (np.array([getattr(item, key) for item in changes]) for key in ("without", "without_sd"))
    furthest = 0.0
    for name, colour, offset, mean_key, sd_key in PARAMETERS_SHOWN:
        place, reach = (np.array([getattr(item, key) for item in changes]) for key in (mean_key, sd_key))
        place, reach = (place - centre) / sd, Z95 * reach / sd
        axes.errorbar(place, rows + offset, xerr=reach, fmt="o", color=colour, markersize=3, linewidth=1.3, label=name)
        furthest = furthest if colour == GIVEN else max(furthest, float((np.abs(place) + reach).max()))
    limit = BEYOND * furthest
    axes.set_xlim(-limit, limit)
    for row, place in zip(rows, (np.array([item.given for item in changes]) - centre) / sd, strict=True):
        if abs(place) > limit:
            side = "right" if place > 0.0 else "left"
            text = f"given at {format_signed(place, 0)}"
            axes.text(np.sign(place) * 0.99 * limit, row + 0.24, text, color=GIVEN, ha=side, va="bottom", fontsize=6.5)
    axes.axvline(0.0, color="black", linewidth=0.5)
    axes.set_yticks(rows, [item.name for item in changes])
    axes.set_ylim(-0.6, len(changes) - 0.2)
    axes.set_xlabel("distance from the value fitted without the named causes [its standard deviations]")
    axes.grid(visible=False, axis="y")
    axes.legend(loc="lower right", ncols=3, bbox_to_anchor=(1.0, 1.0))
    return figure
