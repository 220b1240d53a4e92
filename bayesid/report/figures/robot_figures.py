"""The robot in its poses, and the motion of its joints."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import Motion
from bayesid.report.figures.figure_style import (
    WIDTH,
    PageFigure,
    curve_style,
    panels_of,
    shared_legend,
    styled,
    wide_figure,
)
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.link_shapes import equivalent_box, link_shapes
from bayesid.robot.robot import Robot

__all__ = [
    "BASE",
    "VIEWS",
    "draw_box",
    "draw_sticks",
    "manoeuvre",
    "plot_manoeuvre",
    "plot_robot",
    "robot_pose",
    "sticks_of",
    "surface_of",
]


CURVE_POINTS = 600  # number of points of a curve over time
FACE = 0.08  # longest edge of a face that is drawn, relative to the size of the robot
GLASS = 0.3  # opacity of a box in place of the base's shape, which may hold other links
LIGHT = np.array([0.3, -0.5, 0.81])  # direction of the light that shades shapes
LINKS = ("#e0b04c", "#b9b9b9")  # colours of the links, by turns
BASE = "#8fbcdb"
"""Colour of the base."""

VIEWS = (("view along −z", 0, 1), ("view along y", 0, 2), ("view along −x", 1, 2))
"""Title, axis along and axis up of each projection."""


@styled
def manoeuvre(motion: Motion, robot: Robot, time: Floats, axes: Any = None) -> Figure:
    """Draw positions and speeds of the joints over time, one row for each unit (rad, m).

    Parameters
    ----------
    motion : Motion
    robot : Robot
    time : (T,) array
        Times [s]
    axes : array_like of Axes, optional
        Panels of position and speed for each unit, by default those of a new figure.
    """
    state = motion.evaluate(np.asarray(time, dtype=float))
    units = sorted({joint.unit for joint in robot.joints}, reverse=True) or ["rad"]
    figure, panels = panels_of(axes, len(units), 2, 0.3 + 1.65 * len(units), sharex=True)
    for row, unit in enumerate(units):
        curves = ((state.position, f"position [{unit}]"), (state.velocity, f"speed [{unit}/s]"))
        for column, (values, label) in enumerate(curves):
            axes = panels[row, column]
            for index, joint in enumerate(robot.joints):
                if joint.unit == unit:
                    name = joint.name if column == 0 else None
                    axes.plot(time, values[:, index], label=name, **curve_style(index))
            axes.set_ylabel(label)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    if robot.joints:
        longest = max(len(joint.name) for joint in robot.joints)
        if isinstance(figure, PageFigure):
            figure.legend(loc="outside upper center", ncols=max(1, min(len(robot.joints), 90 // (longest + 8))))
        else:
            for axes in panels[:, 0]:
                axes.legend()
    return figure


class HasPosterior(Protocol):
    """Result of a check, an identification, a simulation, a prediction or a design."""

    @property
    def posterior(self) -> Posterior:
        """Model and manoeuvres."""
        ...


def plot_manoeuvre(result: Posterior | HasPosterior | Diagnosis, recording: int = 0, *, axes: Any = None) -> Figure:
    """Draw positions and speeds of the joints in a manoeuvre.

    Parameters
    ----------
    result : Posterior, or result that has one
        Of a diagnosis, the recordings; of a design, the designed manoeuvre.
    recording : int
        Number of the manoeuvre.
    axes : array_like of Axes, optional
        Panels of position and speed, a row for each unit of the joints, by default those of a new figure.
    """
    shown = result.before.fit if isinstance(result, Diagnosis) else result
    posterior = shown if isinstance(shown, Posterior) else shown.posterior
    flown = posterior.manoeuvres[recording]
    time = np.linspace(flown.recording.time[0], flown.recording.time[-1], CURVE_POINTS)
    return manoeuvre(flown.motion, posterior.model.robot, time, axes)


@styled
def robot_pose(robot: Robot, motion: Motion, times: Floats) -> Figure:
    """Draw the robot as sticks in three projections of the base frame, later instants darker.

    Parameters
    ----------
    times : (T,) array
        Instants at which the robot is drawn [s].
    """
    times = np.atleast_1d(np.asarray(times, dtype=float))
    poses = kinematics(robot, motion.evaluate(times)).pose
    box = equivalent_box(robot.link(robot.base).inertial)
    paths = [sticks_of(robot, pose) for pose in poses]
    points = np.concatenate([box, *(stick for path in paths for stick in path)])
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.05 * float((high - low).max())
    spans = high - low + 2.0 * margin
    ratios = [spans[across] for _, across, _ in VIEWS]
    figure = wide_figure(min(5.5, 1.15 + 5.4 * float(spans[1:].max() / sum(ratios))))
    panels = figure.subplots(1, 3, gridspec_kw={"width_ratios": ratios})
    colours = colormaps["cividis_r"](np.linspace(0.25, 1.0, len(times)))
    for axes, (title, across, up) in zip(panels, VIEWS, strict=True):
        draw_box(axes, box, (across, up))
        for path, colour, time, pose in zip(paths, colours, times, poses, strict=True):
            draw_sticks(axes, path, (across, up), colour)
            centre = _centre_of_mass(robot, pose)
            axes.plot(centre[across], centre[up], "X", color=colour, markersize=5.5, markeredgecolor="white", mew=0.5)
            axes.plot([], [], color=colour, linewidth=1.4, label=f"t = {time:.4g} s")
        axes.set_title(title)
        axes.set_xlabel(f"{'xyz'[across]} [m]")
        axes.set_ylabel(f"{'xyz'[up]} [m]")
        axes.set_xlim(low[across] - margin, high[across] + margin)
        axes.set_ylim(low[up] - margin, high[up] + margin)
        axes.set_aspect("equal")
        axes.locator_params(axis="both", nbins=5)
    _symbols(panels[0])
    shared_legend(figure, panels[0], columns=4, place="outside lower center")
    return figure


@styled
def plot_robot(robot: Robot | str | Path, position: ArrayLike | None = None, *, ax: Any = None) -> Figure:
    """Draw a robot in space: its meshes if available, otherwise primitives or boxes of the same inertia.

    Parameters
    ----------
    robot : Robot or path of a URDF or MJCF
        Robot, or its file.
    position : (joints,) array_like, optional
        Positions of the joints [rad or m], by default zero, or the nearest that the limits allow.
    ax : Axes3D, optional
        Axes to draw in, with ``projection="3d"``, by default those of a new figure.
    """
    robot = robot if isinstance(robot, Robot) else Robot.from_urdf(robot)
    rest = np.array([np.clip(0.0, joint.lower, joint.upper) for joint in robot.joints])
    given = rest if position is None else np.asarray(position, dtype=float)
    if given.shape != rest.shape:
        names = ", ".join(joint.name for joint in robot.joints)
        raise InputError(f"{given.size} positions for {rest.size} joints", remedy=f"Give the positions of {names}")
    if ax is None:
        ax = PageFigure(figsize=(WIDTH, 3.8)).add_axes((0.1, 0.05, 0.8, 0.95), projection="3d")
    elif not hasattr(ax, "zaxis"):
        raise InputError("the axes are flat", remedy='Create them with figure.add_subplot(projection="3d")')
    state = given.reshape(1, -1)
    drawn, shades = surface_of(robot, kinematics(robot, JointState(state, 0.0 * state, 0.0 * state)).pose[0])
    low, high = drawn.min(axis=(0, 1)), drawn.max(axis=(0, 1))
    shown = {"linewidths": 0.0, "antialiased": False, "rasterized": True}
    ax.add_collection3d(Poly3DCollection(drawn, facecolors=shades, **shown))
    middle, reach = 0.5 * (low + high), 0.5 * np.maximum(high - low, 0.2 * float((high - low).max()))
    for axis, place, half in zip("xyz", middle, reach, strict=True):
        getattr(ax, f"set_{axis}lim")(place - half, place + half)
        getattr(ax, f"set_{axis}label")(f"{axis} [m]")
        ax.locator_params(axis=axis, nbins=4)
    ax.set_box_aspect(reach, zoom=1.0)
    return ax.get_figure(root=True)


def surface_of(robot: Robot, pose: Floats) -> tuple[Floats, Floats]:
    """Return the triangles (T, 3, 3) of a robot in a pose (joints, 4, 4), base frame, and their colours (T, 4).

    Whoever draws the farthest first, by the middle of each face, hides what is behind: large faces are cut for that.
    """
    placed, looks = [], []
    for shape in link_shapes(robot):
        link = robot.link(shape.link)
        carrier = (np.eye(4) if link.joint < 0 else pose[link.joint]) @ link.placement
        placed.append(shape.triangles @ carrier[:3, :3].T + carrier[:3, 3])
        looks.append((link.joint, GLASS if link.joint < 0 and shape.source == "box" else 1.0))
    everything = np.concatenate(placed)
    longest = FACE * float(np.ptp(everything, axis=(0, 1)).max())
    faces, colours = [], []
    for part, (joint, alpha) in zip(placed, looks, strict=True):
        corners = _split(part, longest) if alpha == 1.0 else part
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        bright = np.abs(normal @ LIGHT) / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
        shade = np.outer(0.55 + 0.45 * bright, to_rgb(BASE if joint < 0 else LINKS[joint % 2]))
        faces.append(corners)
        colours.append(np.column_stack([shade, np.full(len(shade), alpha)]))
    return np.concatenate(faces), np.concatenate(colours)


def _split(triangles: Floats, longest: float) -> Floats:
    """Return triangles (T, 3, 3) of edges no longer than a length, those with longer ones cut in four."""
    large = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1, initial=0.0) > longest
    if not large.any():
        return triangles
    corners = triangles[large]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))  # of the edges from each corner to the next
    cut = [np.stack([corners[:, k], middles[:, k], middles[:, k - 1]], axis=1) for k in range(3)]
    return np.concatenate([triangles[~large], *(_split(part, longest) for part in [*cut, middles])])


def sticks_of(robot: Robot, pose: Floats) -> list[Floats]:
    """Return one stick to each moving joint from its parent, and one on to the centre of mass of every last link."""
    parents = [robot.model.parents[index + 2] - 2 for index in range(len(robot.joints))]
    origin = [pose[index, :3, 3] for index in range(len(robot.joints))]
    sticks = [
        np.stack([np.zeros(3) if parent < 0 else origin[parent], origin[index]]) for index, parent in enumerate(parents)
    ]
    for link in robot.links.values():
        if link.joint >= 0 and link.joint not in parents and link.inertial.mass > 0.0:
            end = pose[link.joint] @ link.placement @ np.append(link.inertial.com, 1.0)
            sticks.append(np.stack([origin[link.joint], end[:3]]))
    return sticks


def _centre_of_mass(robot: Robot, pose: Floats) -> Floats:
    moment = np.zeros(3)
    for link in robot.links.values():
        carrier = np.eye(4) if link.joint < 0 else pose[link.joint]
        moment += link.inertial.mass * (carrier @ link.placement @ np.append(link.inertial.com, 1.0))[:3]
    return moment / robot.mass


def draw_sticks(axes: Axes, path: Sequence[Floats], plane: tuple[int, int], colour: Any) -> None:
    """Draw the sticks of a robot in one projection."""
    for stick in path:
        axes.plot(*stick[:, list(plane)].T, "-o", color=colour, markersize=2.2, linewidth=1.2)


def draw_box(axes: Axes, box: Floats, plane: tuple[int, int]) -> None:
    """Draw the box of the base in one projection, and the origin of the base frame."""
    flat = box[:, list(plane)]
    if min(np.ptp(flat, axis=0)) > 1e-9:
        hull = flat[ConvexHull(flat, qhull_options="QJ").vertices]
        axes.fill(hull[:, 0], hull[:, 1], facecolor="#cfe3f1", edgecolor="#0072B2", linewidth=0.8)
    axes.plot(0.0, 0.0, "+", color="#0072B2", markersize=7)


def _symbols(axes: Axes) -> None:
    """Add the symbols to the legend."""
    axes.plot([], [], "s", color="#cfe3f1", markeredgecolor="#0072B2", label="base, as a homogeneous box")
    axes.plot([], [], "+", color="#0072B2", label="origin of the base frame")
    axes.plot([], [], "X", color="#666666", label="centre of mass of the robot")
