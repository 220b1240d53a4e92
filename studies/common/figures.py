"""Figures that several studies draw: the robot's outline, and manoeuvres side by side as MuJoCo flies them."""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Motion
from bayesid.report.figures.figure_style import COLOURS, TRUTH, curve_style, shared_legend, styled, wide_figure
from bayesid.report.figures.robot_figures import VIEWS, draw_box, draw_sticks, sticks_of
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.link_shapes import equivalent_box
from bayesid.robot.robot import Robot
from studies.common import mission
from studies.common.ets7 import TIP_SPEED
from studies.common.flight import flown_along

TITLE = 88  # number of characters of titles side by side that fill the page's width
SIDE = 1.15  # longer side of the drawing as printed [in]

# lengths that the scale may have [m]; the longest is drawn that is at most half as long as the drawing is wide
BARS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)


@styled
def robot_outline(robot: Robot, position: Floats | None = None) -> Figure:
    """Draw the robot as sticks from the side on which it reaches furthest from the base, with a scale in metres.

    Parameters
    ----------
    position : (n,) array, optional; positions of the joints, by default zero [rad, m]
    """
    rest = np.zeros((1, len(robot.joints)))
    state = JointState(rest if position is None else np.reshape(position, rest.shape), rest, rest)
    box = equivalent_box(robot.link(robot.base).inertial)
    path = sticks_of(robot, kinematics(robot, state).pose[0])
    points = np.concatenate([box, *path])
    _, across, up = max(VIEWS, key=lambda view: _area(points, view[1:]) - _area(box, view[1:]))
    low, high = points[:, [across, up]].min(axis=0), points[:, [across, up]].max(axis=0)
    spans = 1.1 * (high - low)
    bar = max((length for length in BARS if length <= 0.5 * spans[0]), default=BARS[0])
    below = 0.16 * spans.max()  # room for the scale and its number
    size = np.array([spans[0], spans[1] + below])
    figure = Figure(figsize=tuple(SIDE * size / size.max()))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    draw_box(axes, box, (across, up))
    draw_sticks(axes, path, (across, up), TRUTH)
    foot = low[1] - 0.3 * below
    axes.plot([low[0], low[0] + bar], [foot, foot], color="black", linewidth=1.0)
    axes.text(low[0] + 0.5 * bar, foot - 0.1 * below, f"{bar:g} m", ha="center", va="top", fontsize=8.0)
    axes.set_xlim(low[0] - 0.045 * spans[0], high[0] + 0.045 * spans[0])
    axes.set_ylim(low[1] - 0.045 * spans[1] - below, high[1] + 0.045 * spans[1])
    axes.set_aspect("equal")
    return figure


def _area(points: Floats, plane: tuple[int, int]) -> float:
    return float(np.prod(np.ptp(points[:, plane], axis=0)))


@styled
def manoeuvre_figure(motions: Mapping[str, Motion]) -> Figure:
    """Draw manoeuvres, one column for each, by their titles."""
    figure = wide_figure(4.2)
    panels = figure.subplots(3, len(motions), sharex=True, sharey="row", squeeze=False)
    for column, ((top, middle, bottom), (title, motion)) in enumerate(zip(panels.T, motions.items(), strict=True)):
        course = flown_along(mission.published_robot(), motion, mission.DURATION)
        position = motion.evaluate(course.time).position
        for joint in range(6):
            top.plot(
                course.time, position[:, joint], label=None if column else f"joint {joint + 1}", **curve_style(joint)
            )
        middle.plot(course.time, 1e3 * course.tip_speed, color=COLOURS[0])
        middle.axhline(1e3 * TIP_SPEED, color="black", linestyle=":", linewidth=0.8)
        bottom.plot(course.time, np.degrees(course.base_rotation), color=COLOURS[0])
        top.set_title(fill(title, TITLE // len(motions)))
        bottom.set_xlabel("time [s]")
    for axes, label in zip(panels[:, 0], ("joints [rad]", "tip speed [mm/s]", "base turned [deg]"), strict=True):
        axes.set_ylabel(label)
    shared_legend(figure, panels[0, 0], 6)
    return figure
