"""Predicted trajectories of base and end-effector, and the distribution of the final position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.design.pose_region import Pose, Region
from bayesid.design.pose_trajectory import PoseTrajectory
from bayesid.report.figures.figure_style import COLOURS, TRUTH, curve_style, ellipse_outline, styled, wide_figure

__all__ = ["final_positions", "trajectory_bands"]

PLANES = ((0, 1), (0, 2), (1, 2))
"""Axes along and up of each panel."""


@styled
def trajectory_bands(trajectory: PoseTrajectory) -> Figure:
    """Draw the mean trajectory of one body with a band of ± 2 sd, and twice the standard deviation beside it."""
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
    axes.plot(draws[:, 0], draws[:, 1], ".", color=colour, markersize=1.5, alpha=0.35, markeredgewidth=0.0)
    axes.plot(outline[0], outline[1], label=name, color=colour)
