"""The robot drawn from its geometry, with its causes where they act, from where these are seen best."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from scipy.spatial import ConvexHull

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis, Hypothesis
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.diagnosis.outcome.cause_sizes import VectorSize, vector_size
from bayesid.report.figures.figure_style import COLOURS
from bayesid.report.figures.robot_figures import BASE, surface_of
from bayesid.report.numbers import format_number, format_unit
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.sensors import SensorKind

__all__ = ["CauseMark", "cause_marks", "draw_robot_with_causes", "view_of"]

ARROW = 0.55  # length of the longest arrow of each unit, relative to the size of the robot
SCALE = 0.35  # longest scale, relative to the size of the robot
GAP = 0.11  # height of a line of text and its distance from the robot, relative to the size of the robot
PLACES = ("cp", "position")  # names of the quantities of an effect that are a point of the base
DIRECTIONS, TURNS = 200, 36  # numbers of directions that are tried, in space and perpendicular to an arrow
PALE = 0.35  # saturation of glass
FULL = 0.99  # share of its length from which on an arrow counts as seen in full


class CauseMark(NamedTuple):
    """Mark of one cause.

    Attributes
    ----------
    label : str
        Name of the cause.
    point : (3,) array
        Where it acts, base frame [m]: the point of a force or a tank, a link's centre of mass, the accelerometer, or
        the base origin.
    vector : VectorSize or None
        Vector in base axes; None where it has none or its direction is not known.
    """

    label: str
    point: Floats
    vector: VectorSize | None


def draw_robot_with_causes(axes: Axes, result: Diagnosis, recording: int) -> None:
    """Draw the robot at the start of a recording, looking so that the arrows of its causes have their full length."""
    posterior = result.before.fit.posterior
    robot, manoeuvre = posterior.model.robot, posterior.manoeuvres[recording]
    pose = kinematics(robot, manoeuvre.motion.evaluate(manoeuvre.recording.time[:1])).pose[0]
    marks = cause_marks(result.after, pose) if result.verdict.causes else []
    faces, colours = surface_of(robot, pose)
    points = faces.reshape(-1, 3)
    view = view_of(points, [mark.vector.direction for mark in marks if mark.vector is not None])
    _draw_surface(axes, faces, colours, view)
    flat = points @ view[:2].T
    size = float(np.ptp(flat, axis=0).max())
    lengths = _lengths(marks, ARROW * size)
    corners = [flat.min(axis=0), flat.max(axis=0)]
    for mark in marks:
        corners += [view[:2] @ mark.point, _end(mark, view, lengths)]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    for place, mark in enumerate(marks):
        label = np.array([0.5 * (low[0] + high[0]), high[1] + GAP * size * (len(marks) - place - 0.4)])
        _draw_mark(axes, mark, view, lengths, label)
    below = low[1] - 0.6 * GAP * size
    _draw_scales(axes, (low[0], high[0]), below, lengths, size)
    _draw_triad(axes, view, np.array([0.5 * (low[0] + high[0]), below - 0.6 * GAP * size]), 0.8 * GAP * size)
    axes.set_xlim(low[0] - GAP * size, high[0] + GAP * size)
    axes.set_ylim(below - GAP * size * (1.8 + max(len(lengths) - 1, 0)), high[1] + GAP * size * (0.6 + len(marks)))
    axes.set_aspect("equal")
    axes.set_axis_off()


def _draw_surface(axes: Axes, faces: Floats, colours: Floats, view: Floats) -> None:
    """Draw faces, the farthest first; of what is glass only the far side and the outline, so that one looks into it."""
    glass = colours[:, 3] < 1.0
    far = np.zeros(len(faces), dtype=bool)
    if glass.any():
        shell = faces[glass]
        normal = np.cross(shell[:, 1] - shell[:, 0], shell[:, 2] - shell[:, 0])
        outward = np.sign(np.sum(normal * (shell.mean(axis=1) - shell.mean(axis=(0, 1))), axis=1))
        far[glass] = outward * (normal @ view[2]) < 0.0
        flat = shell.reshape(-1, 3) @ view[:2].T
        axes.fill(*flat[ConvexHull(flat, qhull_options="QJ").vertices].T, fill=False, edgecolor=BASE, linewidth=0.8)
    pale = np.concatenate([1.0 - PALE * (1.0 - colours[:, :3]), np.ones((len(faces), 1))], axis=1)
    paint = np.where(glass[:, None], pale, colours)
    depth = np.where(glass, -np.inf, (faces @ view[2]).mean(axis=1))
    order = np.argsort(depth)
    order = order[far[order] | ~glass[order]]
    drawn: Any = {"facecolors": paint[order], "edgecolors": paint[order], "linewidths": 0.3, "rasterized": True}
    axes.add_collection(PolyCollection(list(faces[order] @ view[:2].T), **drawn))


def view_of(points: Floats, arrows: Sequence[Floats]) -> Floats:
    """Return right, up and towards the eye, the rows of a (3, 3) array, of the view with all arrows in full length.

    Of several such views it is the one in which the convex hull of the points is largest; the base's z axis points up.

    Parameters
    ----------
    points : (N, 3) array
        Corners of the robot, base axes.
    arrows : sequence of (3,) arrays
        Unit vectors.
    """
    corners = points[ConvexHull(points, qhull_options="QJ").vertices]

    def rank(view: Floats) -> tuple[float, float]:
        seen = min((float(np.linalg.norm(view[:2] @ arrow)) for arrow in arrows), default=1.0)
        return min(seen, FULL), float(ConvexHull(corners @ view[:2].T, qhull_options="QJ").volume)  # area in a plane

    return max(map(_looking_along, _directions(arrows)), key=rank)


def _directions(arrows: Sequence[Floats]) -> Floats:
    """Return unit vectors over half a sphere (Fibonacci's lattice), and perpendicular to each arrow and each two."""
    number = np.arange(DIRECTIONS)
    height, angle = (number + 0.5) / DIRECTIONS, math.pi * (3.0 - math.sqrt(5.0)) * number
    radius = np.sqrt(1.0 - height**2)
    eyes = [np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)]
    turn = np.linspace(0.0, math.pi, TURNS, endpoint=False)
    for arrow in arrows:
        first, second = np.linalg.svd(arrow[None])[2][1:]
        eyes.append(np.outer(np.cos(turn), first) + np.outer(np.sin(turn), second))
        crossed = np.array([np.cross(arrow, other) for other in arrows])
        lengths = np.linalg.norm(crossed, axis=1)
        eyes.append(crossed[lengths > 1e-6] / lengths[lengths > 1e-6, None])
    return np.concatenate(eyes)


def _looking_along(eye: Floats) -> Floats:
    """Return right, up and towards the eye, with z up, or x where the eye is above."""
    eye = eye if eye[2] >= 0.0 else -eye
    upward = np.array([1.0, 0.0, 0.0]) if eye[2] > 0.98 else np.array([0.0, 0.0, 1.0])
    right = np.cross(upward, eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def _lengths(marks: Sequence[CauseMark], longest: float) -> dict[str, tuple[float, float]]:
    """Return the largest magnitude of each unit, and the length of an arrow of one unit [m]."""
    largest: dict[str, float] = {}
    for mark in marks:
        if mark.vector is not None:
            largest[mark.vector.unit] = max(largest.get(mark.vector.unit, 0.0), mark.vector.magnitude)
    return {unit: (magnitude, longest / magnitude) for unit, magnitude in largest.items()}


def _end(mark: CauseMark, view: Floats, lengths: dict[str, tuple[float, float]]) -> Floats:
    """Return where the arrow of a mark ends in a view; its point where it has none."""
    if mark.vector is None:
        return view[:2] @ mark.point
    return view[:2] @ (mark.point + lengths[mark.vector.unit][1] * mark.vector.vector)


def _draw_mark(
    axes: Axes, mark: CauseMark, view: Floats, lengths: dict[str, tuple[float, float]], place: Floats
) -> None:
    """Draw point and arrow of a cause, and its name at a place above the robot, with a line to the nearer end."""
    start, end = _pair(view[:2] @ mark.point), _pair(_end(mark, view, lengths))
    axes.plot(*start, "o", color=COLOURS[0], markersize=5.5, markeredgecolor="white", zorder=5)
    if mark.vector is not None:
        arrow = {"arrowstyle": "-|>", "color": COLOURS[0], "linewidth": 1.8, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", end, start, arrowprops=arrow, zorder=5)
    line = {"arrowstyle": "-", "color": COLOURS[0], "linewidth": 0.5, "shrinkA": 1.0, "shrinkB": 2.0}
    near = max(start, end, key=lambda point: point[1])
    axes.annotate(mark.label, near, _pair(place), color=COLOURS[0], ha="center", va="bottom", arrowprops=line, zorder=6)


def _draw_scales(
    axes: Axes, ends: tuple[float, float], height: float, lengths: dict[str, tuple[float, float]], size: float
) -> None:
    """Draw a scale in metres at the left, and at the right an arrow for each unit, with the values of their lengths."""
    metres = _round_below(SCALE * size)
    axes.plot([ends[0], ends[0] + metres], [height, height], color="black", linewidth=1.2)
    axes.annotate(f"{format_number(metres, 1)} m", (ends[0], height), (0, -2), textcoords="offset points", va="top")
    sized = {unit: length for unit, length in lengths.items() if format_unit(unit)}  # the others are directions alone
    for place, (unit, (largest, metre)) in enumerate(sized.items()):
        value, at = _round_below(largest * SCALE / ARROW), height - GAP * size * 1.5 * place
        arrow = {"arrowstyle": "-|>", "color": COLOURS[0], "linewidth": 1.8, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", (ends[1], at), (ends[1] - metre * value, at), arrowprops=arrow)
        text = f"{format_number(value, 1)} {format_unit(unit)}"
        axes.annotate(text, (ends[1], at), (0, -4), textcoords="offset points", va="top", ha="right", color=COLOURS[0])


def _draw_triad(axes: Axes, view: Floats, origin: Floats, length: float) -> None:
    """Draw the axes of the base frame as they are seen."""
    for name, axis in zip("xyz", view[:2].T, strict=True):
        end = origin + length * axis
        axes.plot(*np.stack([origin, end]).T, color="#666666", linewidth=0.8)
        if np.linalg.norm(axis) > 0.2:
            place = _pair(origin + length * axis * (1.0 + 0.35 / np.linalg.norm(axis)))
            axes.text(*place, name, ha="center", va="center")


def _pair(point: Floats) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _round_below(value: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that does not exceed a value."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9))


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
        point = _origin(hypothesis, effect) if place is None else place
        marks.append(CauseMark(label, point, vector if vector is not None and vector.directed else None))
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
