"""The report of a prediction: where planned manoeuvres take base and end-effector."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bayesid.design.base_prediction import ATTITUDE, Prediction
from bayesid.design.pose_trajectory import PoseTrajectory, Region
from bayesid.inference.posterior import Posterior
from bayesid.report import figures
from bayesid.report.document import Document, Rows
from bayesid.report.model_assumptions import planning_sentences
from bayesid.report.numbers import format_fixed, format_number, format_quantity, format_vector
from bayesid.simulation.model import Manoeuvre

__all__ = ["prediction_report"]

CURVE_POINTS = 400  # number of points of a curve over time


def prediction_report(
    posterior: Posterior,
    manoeuvres: Sequence[Manoeuvre],
    predictions: Sequence[Prediction],
    title: str,
    file: Path,
    *,
    origin: str = "",
) -> None:
    """Write the report of predicted manoeuvres as PDF, whole or not at all.

    Parameters
    ----------
    posterior : Posterior
        Posterior of the predictor, which holds the assumptions of the model.
    manoeuvres : sequence of Manoeuvre
        Planned manoeuvres.
    predictions : sequence of Prediction
        Prediction of each manoeuvre.
    title : str
        Title of the study.
    file : path
    origin : str, optional
        Where the report comes from: files with their hashes, version, seed and command.
    """
    document = Document(title, "Prediction of planned manoeuvres")
    document.foot(origin)
    document.section("Result")
    document.paragraph(
        "Final pose of base and end-effector in orbit axes: the position of the origins of their frames relative to "
        "the initial position of the base, and the rotation since the start as a rotation vector. Every ± is one "
        f"standard deviation of {len(predictions[0].base.position)} draws from the present knowledge of the robot."
    )
    document.table(
        ["manoeuvre", "body", "quantity", "x:", "y:", "z:"],
        [row for prediction in predictions for row in pose_rows(prediction)],
        "Predicted final poses.",
    )
    document.table(
        ["manoeuvre", "body", "quantity", "longest semi-axis:", "middle:", "shortest:", "direction of the longest:"],
        [row for prediction in predictions for row in region_rows(prediction)],
        "Ellipsoids that contain the final pose with 95 % probability (normal approximation). The region of the "
        "rotation is that of the small rotation about the predicted attitude, orbit axes.",
    )
    for manoeuvre, prediction in zip(manoeuvres, predictions, strict=True):
        document.section(f"Manoeuvre {prediction.name}")
        robot, end = posterior.model.robot, float(prediction.base.time[-1])
        if robot.joints:
            time = np.linspace(0.0, end, CURVE_POINTS)
            document.figure(figures.manoeuvre(manoeuvre.motion, robot, time), "Planned motion of the joints.")
        for name, trajectory in predicted_trajectories(prediction):
            document.figure(
                figures.trajectory_bands(trajectory),
                f"Trajectory of the {name}, orbit axes: mean with a band of ± 2 sd (left), and twice the standard "
                "deviation (right).",
            )
        document.figure(
            figures.final_positions({"draws": prediction.tip.pose()}),
            "Final position of the end-effector about its mean: draws, and the outline of the 95 % ellipsoid.",
        )
    document.section("Assumptions")
    document.items(
        [
            "No external force acts: the centre of mass of the whole robot remains at rest, and the base moves only by "
            "reaction to the arm and by its rotation. The initial linear velocity is zero.",
            *(_rate_sentence(prediction) for prediction in predictions),
            "The joints follow the planned motion exactly, and the geometry of the arm is exact.",
            *planning_sentences(posterior),
            f"Integration step {format_number(posterior.step)} s, whose error in the attitude is below "
            f"{format_number(0.01 * float(ATTITUDE.noise.sigma(1.0)[0]))} rad.",
        ]
    )
    document.write(file)


def _rate_sentence(prediction: Prediction) -> str:
    if not prediction.rate.any():
        return f"{prediction.name}: the base starts at rest; its recording contains no initial rate."
    rate = format_vector(prediction.rate)
    return f"{prediction.name}: the base starts with the first measured rate, {rate} rad/s, taken as exact."


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
