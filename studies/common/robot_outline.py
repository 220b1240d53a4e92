"""A small drawing of a robot beside the conditions of a study."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.report.figures.figure_style import TRUTH, styled
from bayesid.report.figures.robot_figures import VIEWS, draw_box, draw_sticks, equivalent_box, sticks_of
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot

__all__ = ["robot_outline"]

SIDE = 1.15
"""Longer side of the drawing as printed [in]."""

BARS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Lengths that the scale may have [m]; the longest is drawn that is at most half as long as the drawing is wide."""


@styled
def robot_outline(robot: Robot, position: Floats | None = None) -> Figure:
    """Draw the robot as sticks from the side on which it reaches furthest from the base, with a scale in metres.

    Parameters
    ----------
    position : (n,) array, optional
        Positions of the joints, by default zero [rad, m].
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
