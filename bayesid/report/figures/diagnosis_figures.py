"""Figures of a diagnosis: the robot with its causes, strengths of candidates, disturbance, parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Candidate, Diagnosis, DisturbingWrench, Frame, Hypothesis
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.diagnosis.outcome.cause_sizes import Z95, vector_size
from bayesid.diagnosis.outcome.gain import ParameterChange
from bayesid.diagnosis.outcome.torque_of_causes import torque_of_causes, torque_spectrum
from bayesid.inference.residual_view import ResidualView
from bayesid.report.figures.figure_style import (
    BAND,
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
from bayesid.report.figures.robot_figures import VIEWS, draw_box, draw_sticks, sticks_of
from bayesid.robot.kinematics import kinematics
from bayesid.robot.link_shapes import equivalent_box
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.sensors import SensorKind

__all__ = [
    "candidate_strengths",
    "cause_marks",
    "moved_axis",
    "parameter_forest",
    "plot_disturbance",
    "plot_verdict",
    "wrench_histories",
    "wrench_spectrum",
]

ROBOT = "#888888"
"""Colour of the robot's sticks."""

ARROW = 0.45  # length of the arrow of a vector, relative to the width of the picture
PLACES = ("cp", "position")  # names of the quantities of an effect that are a point of the base
FEW = 7  # largest number of recordings in one figure

GIVEN = "#999999"
"""Colour of the values given and their prior."""


@styled
def plot_verdict(result: Diagnosis, recording: int | None = None, *, axes: Any = None) -> Figure:
    """Draw the robot with the causes where they act, and the residual of the axis that they change most.

    Parameters
    ----------
    result : Diagnosis
    recording : int, optional
        Number of the recording, by default that where the causes change most.
    axes : sequence of Axes, optional
        Panels of the robot, and of the residual before and, where causes are named, after; by default those of a new
        figure.
    """
    recording = result.strongest_recording if recording is None else recording
    sides = result.residuals
    if axes is None:
        figure = wide_figure(2.3)
        grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.35])
        panels = [figure.add_subplot(grid[0])]
        panels += list(grid[1].subgridspec(len(sides), 1).subplots(squeeze=False, sharex=True)[:, 0])
    else:
        figure, given = panels_of(axes, 1, 1 + len(sides), 2.3)
        panels = list(given[0])
    _draw_robot(panels[0], result, recording)
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


def _draw_robot(axes: Axes, result: Diagnosis, recording: int) -> None:
    """Draw the robot at the start of a recording, in the projection that shows it and its causes largest."""
    posterior = result.before.fit.posterior
    robot, manoeuvre = posterior.model.robot, posterior.manoeuvres[recording]
    pose = kinematics(robot, manoeuvre.motion.evaluate(manoeuvre.recording.time[:1])).pose[0]
    box, path = equivalent_box(robot.link(robot.base).inertial), sticks_of(robot, pose)
    marks = cause_marks(result.after, pose) if result.verdict.causes else []
    points = np.concatenate([box, *path, *(mark.point[None] for mark in marks)])
    title, *plane = max(VIEWS, key=lambda view: _shown(points, marks, (view[1], view[2])))
    across, up = plane
    draw_box(axes, box, (across, up))
    draw_sticks(axes, path, (across, up), ROBOT)
    reach = ARROW * float(np.ptp(points, axis=0).max())
    for mark in marks:
        _draw_mark(axes, mark, (across, up), reach)
    axes.set_title(f"{title}, cause in blue" if marks else title)
    axes.set_xlabel(f"{'xyz'[across]} [m]")
    axes.set_ylabel(f"{'xyz'[up]} [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    axes.locator_params(axis="both", nbins=4)


def _shown(points: Floats, marks: list[CauseMark], plane: tuple[int, int]) -> float:
    """Return how much of a robot a projection shows, with the share of the causes' arrows that lies in it."""
    spans = np.ptp(points, axis=0)
    arrows = [float(np.linalg.norm(mark.direction[list(plane)])) for mark in marks if mark.direction is not None]
    return float(spans[list(plane)].prod()) * (min(arrows) if arrows else 1.0)


def _draw_mark(axes: Axes, mark: CauseMark, plane: tuple[int, int], reach: float) -> None:
    across, up = plane
    start = end = (float(mark.point[across]), float(mark.point[up]))
    axes.plot(*start, "o", color=COLOURS[0], markersize=6, markeredgecolor="white", zorder=5)
    if mark.direction is not None:
        end = (start[0] + reach * float(mark.direction[across]), start[1] + reach * float(mark.direction[up]))
        axes.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": COLOURS[0], "linewidth": 1.8}, zorder=5)
        axes.plot(*end, alpha=0.0)  # so that the axes hold the arrow
    axes.annotate(mark.label, end, (4, 5), textcoords="offset points", color=COLOURS[0], zorder=6)


class CauseMark(NamedTuple):
    """Mark of one cause.

    Attributes
    ----------
    label : str
        Name of the cause.
    point : (3,) array
        Where it acts, base frame [m]: the point of a force or a tank, a link's centre of mass, the accelerometer, or
        the base origin.
    direction : (3,) array or None
        Unit vector along a vector in base axes; None where it has none or its direction is not known.
    """

    label: str
    point: Floats
    direction: Floats | None


def cause_marks(hypothesis: Hypothesis, pose: Floats) -> list[CauseMark]:
    """Return a mark for every cause of a hypothesis, in the robot's pose (joints, 4, 4)."""
    effects = {effect.candidate: effect for effect in hypothesis.fit.effects}
    robot = hypothesis.fit.posterior.model.robot
    marks = []
    for label in hypothesis.labels:
        effect = effects.get(label)
        if effect is not None and effect.link is not None:
            marks.append(CauseMark(label, _centre(robot, effect.link, pose), None))
            continue
        place = _place(hypothesis, label)
        vector = vector_size(hypothesis, label) if place is None else None
        direction = vector.direction if vector is not None and vector.directed else None
        marks.append(CauseMark(label, _origin(hypothesis, effect) if place is None else place, direction))
    return marks


def _place(hypothesis: Hypothesis, label: str) -> Floats | None:
    """Return the point of the base that is among the quantities of a cause."""
    found = {item.quantity.name: item.mean for item in amplitudes_of(hypothesis, label)}
    for name in PLACES:
        keys = [f"{name}.{axis}" for axis in "xyz"]
        if all(key in found for key in keys):
            return np.array([found[key] for key in keys])
    return None


def _origin(hypothesis: Hypothesis, effect: Effect | None) -> Floats:
    """Return where the accelerometer is, for what is wrong with it, and the base origin otherwise."""
    model = hypothesis.fit.posterior.model
    if effect is not None and effect.name.startswith(f"{SensorKind.ACCEL.value}-"):
        for sensor in model.sensors:
            if sensor.kind is SensorKind.ACCEL:
                return np.asarray(sensor.position, dtype=float)
    return np.zeros(3)


def _centre(robot: Robot, name: str, pose: Floats) -> Floats:
    link = robot.link(name)
    carrier = np.eye(4) if link.joint < 0 else pose[link.joint]
    return np.asarray((carrier @ link.placement @ np.append(link.inertial.com, 1.0))[:3])


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
def parameter_forest(changes: Sequence[ParameterChange], named: bool = True) -> Figure:
    """Draw every parameter about its given value, in widths of the prior, as bars of 95 %.

    Parameters
    ----------
    changes : sequence of ParameterChange
    named : bool
        Whether causes are named, so that there is a fit with them.
    """
    figure = wide_figure(0.7 + 0.26 * len(changes))
    axes = figure.subplots()
    rows = np.arange(len(changes))[::-1].astype(float)
    series = [
        ("given, prior", GIVEN, 0.22, [(item.given, item.prior_sd) for item in changes]),
        ("without" if named else "fitted", COLOURS[1], 0.0, [(item.without, item.without_sd) for item in changes]),
    ]
    if named:
        series.append(("with", COLOURS[0], -0.22, [(item.fitted, item.fitted_sd) for item in changes]))
    for name, colour, offset, values in series:
        centre = [(mean - item.given) / item.prior_sd for (mean, _), item in zip(values, changes, strict=True)]
        reach = [Z95 * sd / item.prior_sd for (_, sd), item in zip(values, changes, strict=True)]
        axes.errorbar(centre, rows + offset, xerr=reach, fmt="o", color=colour, markersize=3, linewidth=1.3, label=name)
    axes.axvline(0.0, color="black", linewidth=0.5)
    axes.set_yticks(rows, [item.name for item in changes])
    axes.set_ylim(-0.6, len(changes) - 0.4)
    axes.set_xlabel("distance from the given value [prior widths]")
    axes.grid(visible=False, axis="y")
    axes.legend(loc="upper right", ncols=3, bbox_to_anchor=(1.0, 1.14))
    return figure
