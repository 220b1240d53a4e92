"""Rows of a prediction report's tables."""

from __future__ import annotations

from collections.abc import Iterator

from bayesid.design.base_prediction import Prediction
from bayesid.design.pose_region import Region
from bayesid.design.pose_trajectory import PoseTrajectory
from bayesid.report.document import Rows
from bayesid.report.numbers import format_fixed, format_number, format_quantity

__all__ = ["pose_rows", "predicted_trajectories", "region_rows"]


def pose_rows(prediction: Prediction) -> Rows:
    """Return manoeuvre, body, quantity, and mean ± sd along each axis."""
    return [
        [*place, *(format_quantity(float(mean), float(sd)) for mean, sd in zip(region.mean, region.sd, strict=True))]
        for place, region in _final_regions(prediction)
    ]


def region_rows(prediction: Prediction) -> Rows:
    """Return manoeuvre, body, quantity, semi-axes from the longest, and direction of the longest."""
    return [
        [
            *place,
            *(format_number(float(value)) for value in region.semi_axes),
            f"({', '.join(format_fixed(float(value), 2) for value in region.directions[0])})",
        ]
        for place, region in _final_regions(prediction)
    ]


def predicted_trajectories(prediction: Prediction) -> list[tuple[str, PoseTrajectory]]:
    """Return the trajectories of base and end-effector with what they are called."""
    return [("base", prediction.base), (f"end-effector {prediction.tip_frame}", prediction.tip)]


def _final_regions(prediction: Prediction) -> Iterator[tuple[list[str], Region]]:
    """Yield manoeuvre, body and quantity with the region of the final pose."""
    for name, trajectory in predicted_trajectories(prediction):
        final = trajectory.pose()
        yield [prediction.name, name, "position [mm]"], final.millimetres
        yield [prediction.name, name, "rotation [deg]"], final.degrees
