"""The report of a prediction: where planned manoeuvres take base and end-effector."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid.design.base_prediction import ATTITUDE, Prediction
from bayesid.design.pose_region import Region
from bayesid.design.pose_trajectory import PoseTrajectory
from bayesid.inference.posterior import Posterior
from bayesid.report import figures
from bayesid.report.assumptions import planning_sentences
from bayesid.report.document import Document
from bayesid.report.numbers import format_number, format_quantity
from bayesid.simulation.model import Manoeuvre

__all__ = ["pose_rows", "prediction_report", "region_rows"]

CURVE_POINTS = 400

RIGHT = ["left", "left", "left", "right", "right", "right"]


def prediction_report(
    posterior: Posterior,
    manoeuvres: Sequence[Manoeuvre],
    predictions: Sequence[Prediction],
    title: str,
    file: Path,
) -> None:
    """Write the report of predicted manoeuvres as PDF.

    Parameters
    ----------
    posterior : Posterior
        Of a predictor, for what the model supposes.
    manoeuvres : sequence of Manoeuvre
        As planned.
    predictions : sequence of Prediction
    title : str
    file : path
    """
    document = Document(title, "Prediction of planned manoeuvres")
    document.section("Result")
    document.paragraph(
        "Final pose of base and end-effector in orbit axes, counted from where the base started: the position of their "
        "frames' origins and the rotation since the start, as a rotation vector. Every ± is one standard deviation of "
        f"{len(predictions[0].base.position)} draws of what is known of the robot."
    )
    document.table(
        ["manoeuvre", "body", "quantity", "x", "y", "z"],
        [row for prediction in predictions for row in pose_rows(prediction)],
        "Predicted final poses.",
        RIGHT,
    )
    document.table(
        ["manoeuvre", "body", "quantity", "longest semi-axis", "middle", "shortest", "direction of the longest"],
        [row for prediction in predictions for row in region_rows(prediction)],
        "Ellipsoids that hold the final pose with 95 % probability (normal approximation). The region of the rotation "
        "is that of the small rotation about the predicted attitude, orbit axes.",
        [*RIGHT, "right"],
    )
    for manoeuvre, prediction in zip(manoeuvres, predictions, strict=True):
        document.section(f"Manoeuvre {prediction.name}")
        robot, end = posterior.model.robot, float(prediction.base.time[-1])
        if robot.joints:
            time = np.linspace(0.0, end, CURVE_POINTS)
            document.figure(figures.manoeuvre(manoeuvre.motion, robot, time), "Planned motion of the joints.")
        for name, trajectory in _courses(prediction):
            document.figure(
                figures.trajectory_bands(trajectory),
                f"Course of the {name}, orbit axes: mean with a band of ± 2 sd (left), and twice the standard "
                "deviation (right).",
            )
        document.figure(
            figures.final_positions({"draws": prediction.tip.pose()}),
            "Final position of the end-effector about its mean: draws, and the outline of the 95 % ellipsoid.",
        )
    document.section("What was assumed")
    document.items(
        [
            "No external force acts: the centre of mass of the whole robot rests, and the base moves by what the arm "
            "and the rotation of the base displace it. The initial linear velocity is zero.",
            *(_rate_sentence(prediction) for prediction in predictions),
            "The joints follow the planned motion exactly, and the geometry of the arm is exact.",
            *planning_sentences(posterior),
            f"Integration step {format_number(posterior.step)} s, whose error in the attitude is below "
            f"{format_number(0.01 * float(ATTITUDE.noise.sigma(1.0)[0]))} rad.",
        ]
    )
    document.write(file)


def pose_rows(prediction: Prediction) -> list[list[str]]:
    """Return manoeuvre, body, quantity and mean ± sd per axis."""
    return [
        [
            prediction.name,
            name,
            f"{quantity} [{unit}]",
            *(format_quantity(float(m), float(s)) for m, s in zip(region.mean, region.sd, strict=True)),
        ]
        for name, trajectory in _courses(prediction)
        for quantity, unit, region in _regions(trajectory)
    ]


def region_rows(prediction: Prediction) -> list[list[str]]:
    """Return manoeuvre, body, quantity, semi-axes and direction of the longest."""
    return [
        [
            prediction.name,
            name,
            f"{quantity} [{unit}]",
            *(format_number(float(value)) for value in region.semi_axes),
            "(" + ", ".join(f"{value:.2f}".replace("-", "−") for value in region.directions[0]) + ")",
        ]
        for name, trajectory in _courses(prediction)
        for quantity, unit, region in _regions(trajectory)
    ]


def _courses(prediction: Prediction) -> list[tuple[str, PoseTrajectory]]:
    return [("base", prediction.base), (f"end-effector {prediction.tip_frame}", prediction.tip)]


def _regions(trajectory: PoseTrajectory) -> list[tuple[str, str, Region]]:
    final = trajectory.pose()
    return [("position", "mm", final.millimetres), ("rotation", "deg", final.degrees)]


def _rate_sentence(prediction: Prediction) -> str:
    if not prediction.rate.any():
        return f"{prediction.name}: the base starts at rest; its recording tells of no initial rate."
    rate = ", ".join(format_number(float(value)) for value in prediction.rate)
    return f"{prediction.name}: the base starts with the first measured rate, ({rate}) rad/s, taken as exact."
