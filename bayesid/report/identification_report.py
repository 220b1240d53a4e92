"""The report of an identification, written for a reader who does not see the code."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid.inference.identification import Identification
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.inference.sensor_fit import sensor_fits, torque_fits
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.figures.figure_style import WIDTH
from bayesid.report.sentences import identification_sentences as sentences
from bayesid.report.sentences.model_assumptions import model_sentences
from bayesid.report.tables import identification_tables as tables

__all__ = ["add_identification", "add_joints", "identification_report"]

POSES = 4
"""Number of instants at which the robot is drawn."""

CURVE_POINTS = 600
"""Number of points of a curve over time."""

LARGEST_CORRELATIONS = 30
"""Largest number of quantities in the figure of correlations."""


def identification_report(
    result: Identification,
    title: str,
    assumptions: Sequence[str],
    file: str | Path,
    date: str | None = None,
    *,
    origin: str = "",
) -> None:
    """Write the report of an identification as PDF, whole or not at all.

    Parameters
    ----------
    result : Identification
    title : str
        Title of the study.
    assumptions : sequence of str
        Assumptions of the user beyond those of the model.
    file : path
    date : str, optional
        Date printed under the title. Where it is left out, equal results give equal files.
    origin : str, optional
        Where the report comes from: files with their hashes, version, seed and command.
    """
    document = Document(title, "Identification of inertial parameters", date)
    document.foot(origin)
    add_identification(document, result, assumptions)
    document.write(file)


def add_identification(document: Document, result: Identification, assumptions: Sequence[str]) -> None:
    """Add all sections on an identification to a document."""
    _add_result(document, result)
    _add_robot(document, result)
    _add_fit(document, result)
    _add_uncertainty(document, result)
    _add_computation(document, result)
    _add_assumptions(document, result, assumptions)


def _add_result(document: Document, result: Identification) -> None:
    document.section("Result")
    document.paragraph(sentences.summary(result))
    document.paragraph(sentences.verdict(result))
    if rows := tables.parameter_rows(result):
        document.table(
            ["quantity", "unit", "prior centre", "posterior mean ± sd", "sd / |mean|", "learnt"],
            rows,
            "Identified bodies, in the axes of the link; inertias are about the body's centre of mass. Learnt is the "
            "share by which the data narrowed the prior (half the central 68 %); prior only stands for less than 10 %.",
            ["left", "left", "right", "right", "right", "right"],
        )
    if rows := tables.effect_rows(result):
        header = ["parameter", "unit", "prior, central 68 %", "posterior mean ± sd", "|mean| / sd"]
        caption = "Parameters of the effects in the model."
        document.table(header, rows, caption, ["left", "left", "right", "right", "right"])
    if rows := tables.start_rows(result):
        header = ["recording", "unknown", "unit", "prior", "x", "y", "z"]
        caption = "State of the base at the start of each recording, base axes."
        document.table(header, rows, caption, ["left"] * 3 + ["right"] * 4)


def _add_robot(document: Document, result: Identification) -> None:
    document.section("Robot and manoeuvres")
    robot = result.posterior.model.robot
    joints = ", ".join(f"{joint.name} ({joint.kind})" for joint in robot.joints) or "none"
    document.paragraph(
        f"The robot {robot.name} stands on the base {robot.base}. Moving joints: {joints}. With all links it has a "
        f"mass of {robot.mass:.6g} kg as given, before the identification."
    )
    for number, manoeuvre in enumerate(result.posterior.manoeuvres):
        motion, time, name = manoeuvre.motion, manoeuvre.recording.time, manoeuvre.recording.name
        if number == 0:
            document.figure(
                figures.robot_pose(robot, motion, np.linspace(time[0], time[-1], POSES + 1)[:-1]),
                f"The robot as given, during {name}, in the base frame. Sticks join the joints; the last ones end at "
                "the centre of mass of the last body.",
            )
        if robot.joints:
            curves = figures.manoeuvre(motion, robot, np.linspace(time[0], time[-1], CURVE_POINTS))
            document.figure(curves, f"Motion of the joints in {name}.")


def _add_fit(document: Document, result: Identification) -> None:
    posterior, z = result.posterior, result.optimum.z
    fits = sensor_fits(posterior, z)
    document.section("Measured against simulated")
    document.paragraph(
        "Residuals are in units of their noise σ: that of the sensor and, through the dynamics, that of the encoders. "
        "They are taken at the mode and freed of their correlation, so that a right model leaves independent values "
        "of standard deviation one; the grey band is ± 2 σ."
    )
    document.table(
        ["recording", "sensor", "samples", "chi-square per sample", "largest residual"],
        tables.misfit_rows(posterior, fits),
        "Misfit by recording and sensor. Noise alone gives one, in two cases of three within the ± stated.",
        ["left", "left", "right", "right", "right"],
    )
    for manoeuvre, sensors in zip(posterior.manoeuvres, fits, strict=True):
        document.figure(
            figures.measured_against_simulated(sensors),
            f"Measured and simulated in {manoeuvre.recording.name}, sensor axes; beneath, the residual in σ.",
        )
    _add_torques(document, result)
    document.figure(
        figures.residual_statistics(ResidualView.at(posterior, z)),
        "Residuals of all recordings. Left: mean power by frequency, one for noise alone. Right: distribution, with "
        "the standard normal one.",
    )


def _add_torques(document: Document, result: Identification) -> None:
    posterior = result.posterior
    if posterior.model.torque is None:
        return
    fits = torque_fits(posterior, result.optimum.z)
    document.table(
        ["recording", "joint", "noise per sample", "samples used", "chi-square per sample", "largest residual"],
        tables.torque_rows(posterior, fits),
        "Joint torques. The torque of a joint with dry friction that stands nearly still carries no information and is "
        "left out.",
        ["left", "left", "right", "right", "right", "right"],
    )
    for manoeuvre, joints in zip(posterior.manoeuvres, fits, strict=True):
        document.figure(
            figures.torques_over_time(joints), f"Measured and simulated joint torques in {manoeuvre.recording.name}."
        )


def _add_uncertainty(document: Document, result: Identification) -> None:
    if not result.bodies and not result.effects:
        return
    document.section("Uncertainty")
    document.figure(
        figures.prior_to_posterior(result),
        "Width of the posterior over that of the prior. At one (10⁰) the data said nothing.",
    )
    for name, body in result.bodies.items():
        document.figure(
            figures.corner(body),
            f"Joint posterior of {name}: contours hold 50 % and 90 %. Axes are offsets from the mean in standard "
            "deviations; mean and standard deviation stand over the diagonal.",
        )
    if 0 < len(result.names) <= LARGEST_CORRELATIONS:
        alone = len(result.bodies) == 1
        figure = figures.correlations(
            [name.split(".", 1)[1] if alone else name for name in result.names], result.covariance
        )
        width = f"{100.0 * figure.get_figwidth() / WIDTH:.1f}%"
        document.figure(figure, "Posterior correlations of the identified quantities.", width)


def _add_computation(document: Document, result: Identification) -> None:
    document.section("Computation")
    document.items(sentences.agreement_sentences(result))
    document.figure(
        figures.convergence(result),
        "The coordinates in which the ensembles agree least. Left: mean of the draws so far, about the mean of all, "
        "in posterior standard deviations. Right: ranks of each ensemble's draws among all, which are spread evenly "
        "where all sample the same distribution.",
        floating=True,
    )


def _add_assumptions(document: Document, result: Identification, assumptions: Sequence[str]) -> None:
    document.section("Assumptions")
    document.items([*assumptions, *model_sentences(result.posterior, result.integration_error)])
    add_joints(document, result.posterior)


def add_joints(document: Document, posterior: Posterior) -> None:
    """Add the table of the joints' smoothing; nothing where their motion is prescribed."""
    if rows := tables.joint_rows(posterior):
        document.table(
            ["joint", "noise per sample", "order", "chi-square per sample"],
            rows,
            "Smoothing of the joints: noise of the samples, order of the derivative of the position that is modelled "
            "as white noise, and misfit of the samples to the spline, which is below one as far as the spline follows "
            "their noise. Orders and misfits are those of each recording in turn.",
        )
