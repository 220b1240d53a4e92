"""The robot with the named causes drawn into it, beside what the simulation misses before and after."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis, Hypothesis
from bayesid.inference.residual_view import ResidualView
from bayesid.report.cause_marks import CauseMark, cause_marks
from bayesid.report.figures.figure_style import BAND, COLOURS, axis_title, residual_limits, styled, wide_figure
from bayesid.report.figures.residual_figures import SIDES, draw_history
from bayesid.report.figures.robot_figures import VIEWS, draw_box, draw_sticks, equivalent_box, sticks_of
from bayesid.robot.kinematics import kinematics
from bayesid.simulation.sensors import SensorKind

__all__ = ["cause_picture", "moved_axis"]

ROBOT = "#888888"
"""Colour of the robot's sticks."""

ARROW = 0.45
"""Length of the arrow of a vector, relative to the width of the picture."""


@styled
def cause_picture(result: Diagnosis, recording: int) -> Figure:
    """Draw the robot with its causes at the left, and the residual of one axis before and after at the right.

    Parameters
    ----------
    result : Diagnosis
    recording : int
        Recording whose residual is drawn, and at whose start the robot is drawn.
    """
    figure = wide_figure(2.3)
    grid = figure.add_gridspec(1, 2, width_ratios=[1.0, 1.35])
    _draw_robot(figure.add_subplot(grid[0]), result, recording)
    sides = [_residuals(result.before)] + ([_residuals(result.after)] if result.verdict.causes else [])
    kind, axis = moved_axis(sides, recording)
    panels = grid[1].subgridspec(len(sides), 1)
    values = [side.series(recording, kind, axis) for side in sides]
    drawn: list[Axes] = []
    for place, ((time, value), (name, colour)) in enumerate(zip(values, SIDES, strict=False)):
        axes = figure.add_subplot(panels[place], sharex=drawn[0] if drawn else None)
        axes.axhspan(-2.0, 2.0, **BAND)
        draw_history(axes, time, value, colour, name)
        residual_limits(axes, np.concatenate([own for _, own in values]))
        axes.set_title(f"{axis_title(kind, axis)}, {name}" if len(sides) > 1 else axis_title(kind, axis))
        axes.set_ylabel("residual [σ]")
        axes.locator_params(axis="both", nbins=4)
        drawn.append(axes)
    drawn[-1].set_xlabel("time [s]")
    return figure


def moved_axis(sides: list[ResidualView], recording: int) -> tuple[SensorKind, int]:
    """Return the sensor axis of a recording whose sum of squares decreases most, or is largest of a single side."""

    def gain(kind: SensorKind, axis: int) -> float:
        squares = [float(np.sum(side.series(recording, kind, axis)[1] ** 2)) for side in sides]
        return squares[0] - sum(squares[1:])

    return max(((kind, axis) for kind in sides[0].kinds for axis in range(kind.size)), key=lambda item: gain(*item))


def _residuals(hypothesis: Hypothesis) -> ResidualView:
    return hypothesis.fit.view


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
