"""Designed manoeuvres: joints within their limits, motion of tip and base, and the covariances they predict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.design import Design
from bayesid.report.figures.figure_style import curve_style, decimal_scale, ellipse_outline, styled, wide_figure
from bayesid.report.numbers import format_number, format_unit
from bayesid.robot.robot import Joint

__all__ = ["base_motion", "covariance_ellipses", "joints_within_limits", "tip_motion"]

LIMIT: Any = {"color": "#B00020", "linewidth": 0.9, "linestyle": (0, (4, 2))}
"""Look of limits."""

ELLIPSE = 2.4477
"""Half-width, in standard deviations, of an ellipse that holds 95 %."""

WIDEST = 6.0
"""Largest half-width of a panel, in half-widths of the middle ellipse of all designs."""


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
