"""Figures of planned manoeuvres: limits, motion of tip and base, predicted covariances and poses, and a loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.design import Design
from bayesid.design.pose_trajectory import Pose, PoseTrajectory, Region
from bayesid.report.figures.figure_style import (
    COLOURS,
    TRUTH,
    WIDTH,
    curve_style,
    decimal_scale,
    ellipse_outline,
    styled,
    wide_figure,
)
from bayesid.report.numbers import format_number, format_unit
from bayesid.robot.robot import Joint

__all__ = [
    "base_motion",
    "covariance_ellipses",
    "final_positions",
    "joints_within_limits",
    "loop_progress",
    "tip_motion",
    "trajectory_bands",
]

LIMIT: Any = {"color": "#B00020", "linewidth": 0.9, "linestyle": (0, (4, 2))}
"""Look of limits."""

ELLIPSE = 2.4477  # half-width, in standard deviations, of an ellipse that holds 95 %
WIDEST = 6.0  # largest half-width of a panel, in half-widths of the middle ellipse of all designs
PLANES = ((0, 1), (0, 2), (1, 2))  # axes along and up of each panel
SHOWN = ("mass", "inertia.xx", "inertia.yy", "inertia.zz")  # quantities whose relative standard deviations are drawn
MARKS = ("o", "s", "^", "D")  # marks of the quantities, in their order


@styled
def joints_within_limits(design: Design) -> Figure:
    """Draw positions and speeds of the joints, one row for each unit, with the limits that lie near the curves."""
    trajectory, joints = design.trajectory, design.problem.plan.model.robot.joints
    general = design.problem.limits.joint_speed
    units = sorted({joint.unit for joint in joints}, reverse=True)
    figure = wide_figure(0.35 + 1.8 * len(units))
    panels = figure.subplots(len(units), 2, squeeze=False, sharex=True)
    for row, unit in enumerate(units):
        chosen = [index for index, joint in enumerate(joints) if joint.unit == unit]
        for column, values in enumerate((np.asarray(trajectory.position), np.asarray(trajectory.velocity))):
            axes = panels[row, column]
            for index in chosen:
                name = joints[index].name if column == 0 else None
                axes.plot(trajectory.time, values[:, index], label=name, **curve_style(index))
            bounds = {value for index in chosen for value in _bounds(joints[index], column == 1, general)}
            _draw_limits(axes, values[:, chosen], bounds, unit if column == 0 else f"{unit}/s")
            axes.set_ylabel(f"position [{unit}]" if column == 0 else f"speed [{unit}/s]")
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    longest = max(len(joint.name) for joint in joints)
    figure.legend(loc="outside upper center", ncols=max(1, min(len(joints), 90 // (longest + 8))))
    return figure


@styled
def tip_motion(designs: Mapping[str, Design]) -> Figure:
    """Draw speed and turning rate of the tip, with their limits."""
    figure = wide_figure(2.2)
    panels = figure.subplots(1, 2)
    limits = next(iter(designs.values())).problem.limits
    for axes, name, unit, bound in zip(
        panels, ("speed", "rate"), ("m/s", "rad/s"), (limits.tip_speed, limits.tip_rate), strict=True
    ):
        for index, (label, design) in enumerate(designs.items()):
            trajectory = design.trajectory
            values = np.asarray(trajectory.tip_speed if name == "speed" else trajectory.tip_rate)
            axes.plot(trajectory.time, values, label=label if name == "speed" else None, **curve_style(index))
        axes.set_ylim(bottom=0.0)
        if bound is not None:
            axes.axhline(bound, label="limit" if name == "speed" else None, **LIMIT)
            axes.set_ylim(top=1.12 * max(bound, axes.get_ylim()[1] / 1.12))
        axes.set_ylabel(f"tip {name} [{unit}]")
        axes.set_xlabel("time [s]")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


@styled
def base_motion(designs: Mapping[str, Design]) -> Figure:
    """Draw rate, displacement and attitude of the base as the paper's figure 4 does, one column for each design."""
    figure = wide_figure(4.6)
    panels = figure.subplots(3, len(designs), squeeze=False, sharex=True, sharey="row")
    for column, (label, design) in enumerate(designs.items()):
        trajectory = design.trajectory
        excursion = np.asarray(trajectory.excursion)
        rows = (
            ("rate [mrad/s]", 1e3 * np.asarray(trajectory.rate)),
            ("displacement [mm]", 1e3 * excursion[:, :3]),
            ("Cardan angles [deg]", np.degrees(excursion[:, 3:])),
        )
        panels[0, column].set_title(label)
        for row, (name, values) in enumerate(rows):
            for axis in range(3):
                text = "xyz"[axis] if row == column == 0 else None
                panels[row, column].plot(trajectory.time, values[:, axis], label=text, **curve_style(axis))
            if column == 0:
                panels[row, column].set_ylabel(name)
        panels[-1, column].set_xlabel("time [s]")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


@styled
def covariance_ellipses(
    designs: Sequence[Design], pairs: Sequence[tuple[str, str]], units: Mapping[str, str]
) -> Figure:
    """Draw the 95 % ellipses that all designs predict, about the prior's centre.

    Parameters
    ----------
    designs : sequence of Design
    pairs : sequence of (str, str)
        Names of the quantities along and up.
    units : mapping of str to str
        Unit of each quantity.
    """
    rows = -(-len(pairs) // 3)
    figure = wide_figure(0.4 + 2.05 * rows)
    panels = figure.subplots(rows, 3, squeeze=False)
    for axes in panels.flat[len(pairs) :]:
        axes.set_visible(False)
    for number, (axes, pair) in enumerate(zip(panels.flat, pairs, strict=False)):
        widths, outlines = [], []
        for design in designs:
            chosen = [design.predicted.names.index(name) for name in pair]
            covariance = design.predicted.covariance[np.ix_(chosen, chosen)]
            outlines.append(ellipse_outline(covariance, ELLIPSE))
            widths.append(ELLIPSE * np.sqrt(np.diag(covariance)))
        half = 1.1 * np.minimum(np.max(widths, axis=0), WIDEST * np.median(widths, axis=0))
        scales = [decimal_scale(half[0]), decimal_scale(half[1])]
        for index, (design, outline) in enumerate(zip(designs, outlines, strict=True)):
            name = design.name if number == 0 else None
            axes.plot(outline[0] / scales[0][0], outline[1] / scales[1][0], label=name, **curve_style(index))
        axes.set_xlim(-half[0] / scales[0][0], half[0] / scales[0][0])
        axes.set_ylim(-half[1] / scales[1][0], half[1] / scales[1][0])
        for label, name, (_, power) in zip((axes.set_xlabel, axes.set_ylabel), pair, scales, strict=True):
            label(f"{name.split('.', 1)[1]} [{power}{format_unit(units[name])}]")
        axes.locator_params(nbins=5)
    figure.legend(loc="outside upper center", ncols=4)
    return figure


def _bounds(joint: Joint, speed: bool, general: float | None) -> list[float]:
    if speed:
        largest = min(joint.velocity, np.inf if general is None else general)
        return [-largest, largest]
    return [joint.lower, joint.upper]


def _draw_limits(axes: Axes, values: Floats, bounds: set[float], unit: str) -> None:
    """Draw the limits near the curves, and name in the title those too far away to be drawn."""
    low, high = float(values.min()), float(values.max())
    span = 0.5 * max(high - low, 1e-9)
    finite = sorted(bound for bound in bounds if np.isfinite(bound))
    for bound in finite:
        if low - span <= bound <= high + span:
            axes.axhline(bound, **LIMIT)
    beyond = [bound for bound in finite if not low - span <= bound <= high + span]
    if beyond:
        names = ", ".join(format_number(bound) for bound in beyond)
        axes.set_title(f"limits beyond the panel: {names} {unit}", color="#B00020", loc="right")


@styled
def trajectory_bands(trajectory: PoseTrajectory) -> Figure:
    """Draw the mean trajectory of one body with a band of ± 2 sd, and twice the standard deviation next to it."""
    poses = [trajectory.pose(index) for index in range(len(trajectory.time))]
    figure = wide_figure(3.2)
    panels = figure.subplots(2, 2, sharex=True)
    rows = (("position", "mm", [pose.millimetres for pose in poses]), ("rotation", "deg", [p.degrees for p in poses]))
    for row, (name, unit, regions) in enumerate(rows):
        mean, sd = np.stack([region.mean for region in regions]), np.stack([region.sd for region in regions])
        for axis in range(3):
            style = curve_style(axis)
            panels[row, 0].plot(trajectory.time, mean[:, axis], label="xyz"[axis] if row == 0 else None, **style)
            panels[row, 0].fill_between(
                trajectory.time,
                mean[:, axis] - 2.0 * sd[:, axis],
                mean[:, axis] + 2.0 * sd[:, axis],
                color=style["color"],
                alpha=0.25,
                linewidth=0.0,
            )
            panels[row, 1].plot(trajectory.time, 2.0 * sd[:, axis], **style)
        panels[row, 0].set_ylabel(f"{name} [{unit}]")
        panels[row, 1].set_ylabel(f"2 sd of {name} [{unit}]")
        panels[row, 1].set_ylim(bottom=0.0)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


@styled
def final_positions(poses: Mapping[str, Pose], truth: Floats | None = None, colours: Sequence[str] = COLOURS) -> Figure:
    """Draw samples of the final position in three planes, with the projection of the 95 % ellipsoid.

    Parameters
    ----------
    poses : mapping of str to Pose
        Poses by their names in the legend.
    truth : (3,) array, optional
        True position [m], from which offsets are counted; where it is left out, they are counted from the first
        pose's mean.
    colours : sequence of str
        Colours of the poses.
    """
    figure = wide_figure(2.4)
    panels = figure.subplots(1, 3)
    origin = next(iter(poses.values())).millimetres.mean if truth is None else 1e3 * truth
    for colour, (name, pose) in zip(colours, poses.items(), strict=False):
        draws, region = 1e3 * pose.position - origin, pose.millimetres
        moved = replace(region, mean=region.mean - origin)
        for axes, plane in zip(panels, PLANES, strict=True):
            _shadow(axes, draws[:, plane], moved, plane, name if plane == PLANES[0] else None, colour)
    for axes, (first, second) in zip(panels, PLANES, strict=True):
        if truth is not None:
            label = "truth" if (first, second) == PLANES[0] else None
            axes.plot(0.0, 0.0, "+", color=TRUTH, markersize=9, markeredgewidth=1.6, label=label, zorder=5)
        axes.set_xlabel(f"{'xyz'[first]} [mm]")
        axes.set_ylabel(f"{'xyz'[second]} [mm]")
        axes.set_aspect("equal", adjustable="datalim")
        axes.locator_params(nbins=5)
    if len(poses) > 1 or truth is not None:
        figure.legend(loc="outside upper center", ncols=len(poses) + 1)
    return figure


def _shadow(axes: Axes, draws: Floats, region: Region, plane: tuple[int, int], name: str | None, colour: str) -> None:
    """Draw the samples and the projection of the ellipsoid onto a plane."""
    covariance = region.covariance[np.ix_(plane, plane)]
    outline = ellipse_outline(covariance, region.reach) + region.mean[list(plane)][:, None]
    axes.plot(draws[:, 0], draws[:, 1], ".", color=colour, markersize=3.0, alpha=0.6, markeredgewidth=0.0)
    axes.plot(outline[0], outline[1], label=name, color=colour)


@styled
def loop_progress(steps: Sequence[dict[str, Any]]) -> Figure:
    """Draw relative standard deviations after each step, and the 99 % quantile of each limited quantity over its limit.

    Parameters
    ----------
    steps : sequence of dict
        Steps of a loop that were identified.
    """
    figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
    known, limits = figure.subplots(1, 2)
    numbers = [step["step"] for step in steps]
    bodies = steps[0]["identification"]["bodies"]
    for colour, name in zip(COLOURS, bodies, strict=False):
        for mark, key in zip(MARKS, SHOWN, strict=True):
            items = [step["identification"]["bodies"][name][key] for step in steps]
            ratio = [100.0 * item["sd"] / abs(item["mean"]) for item in items]
            known.plot(numbers, ratio, marker=mark, markersize=3.5, color=colour, label=f"{name} {key}", alpha=0.8)
    known.set(yscale="log", xlabel="step", ylabel="standard deviation / mean [%]", title="Relative uncertainty")
    names = list(dict.fromkeys(key for step in steps for key in step["plan"]["attempts"][-1]["limits"]))
    for colour, name in zip(COLOURS, names, strict=False):
        entries = [step["plan"]["attempts"][-1]["limits"].get(name) for step in steps]
        used = [np.nan if item is None else 100.0 * item["quantile_99"] / item["limit"] for item in entries]
        limits.plot(numbers, used, marker="o", markersize=3.5, color=colour, label=name.replace("_", " "))
    limits.axhline(100.0, color="black", linewidth=0.8, linestyle="--")
    limits.set(xlabel="step", ylabel="99 % quantile / limit [%]", title="Limits affected by the uncertainty")
    limits.set_ylim(0.0, 110.0)
    for axes in (known, limits):
        axes.set_xticks(numbers)
        axes.set_xlim(numbers[0] - 0.5, numbers[-1] + 0.5)
    known.legend()
    if names:
        limits.legend(loc="lower right")
    return figure
