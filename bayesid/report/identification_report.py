"""The report of an identification, written for a reader who does not see the code."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid._io.words import counted, joined
from bayesid.inference.body_quantities import BODY_QUANTITIES, Contraction, ContractionVerdict
from bayesid.inference.identification import Identification
from bayesid.inference.predicted_readings import WhitenedFit
from bayesid.inference.residual_view import ResidualView
from bayesid.report import figures
from bayesid.report.document import Document, Rows
from bayesid.report.figures.figure_style import WIDTH
from bayesid.report.model_assumptions import add_joints, model_sentences
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_percent,
    format_quantity,
    format_signed,
    format_unit,
)
from bayesid.robot.inertial_parameters import mass_com_inertia

__all__ = ["add_identification", "agreement_sentences", "identification_report", "verdict"]

POSES = 4  # number of instants at which the robot is drawn
LARGEST_CORRELATIONS = 30  # largest number of quantities in the figure of correlations
LIMIT = 3.0  # deviation of chi-square, in standard deviations of chi-square, that noise alone rarely reaches


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
    document.paragraph(summary(result))
    document.paragraph(verdict(result))
    if rows := parameter_rows(result):
        document.table(
            ["quantity", "unit", "prior centre:", "posterior mean ± sd:", "sd / |mean|:", "learnt:"],
            rows,
            "Identified bodies, in the axes of the link; inertias are about the body's centre of mass. Learnt is the "
            "share by which the data narrowed the prior (half the central 68 %); prior only means less than 10 %.",
        )
    if rows := effect_rows(result):
        header = ["parameter", "unit", "prior, central 68 %:", "posterior mean ± sd:", "|mean| / sd:"]
        caption = "Parameters of the effects in the model."
        document.table(header, rows, caption)
    if rows := start_rows(result):
        header = ["recording", "unknown", "unit", "prior:", "x:", "y:", "z:"]
        caption = "State of the base at the start of each recording, base axes."
        document.table(header, rows, caption)


def _add_robot(document: Document, result: Identification) -> None:
    document.section("Robot and manoeuvres")
    robot = result.posterior.model.robot
    joints = ", ".join(f"{joint.name} ({joint.kind})" for joint in robot.joints) or "none"
    document.paragraph(
        f"The base of the robot {robot.name} is {robot.base}. Moving joints: {joints}. The mass of all links together "
        f"is {robot.mass:.6g} kg as given, before the identification."
    )
    for number, manoeuvre in enumerate(result.posterior.manoeuvres):
        motion, time, name = manoeuvre.motion, manoeuvre.recording.time, manoeuvre.recording.name
        if number == 0:
            document.figure(
                figures.robot_pose(robot, motion, np.linspace(time[0], time[-1], POSES + 1)[:-1]),
                f"The robot as given, during {name}, in the base frame. Lines connect the joints; the last ones end at "
                "the centre of mass of the last body.",
            )
        if robot.joints:
            document.figure(figures.plot_manoeuvre(result, number), f"Motion of the joints in {name}.")


def _add_fit(document: Document, result: Identification) -> None:
    document.section("Measured against simulated")
    document.paragraph(
        "Residuals are in units of their noise σ: that of the sensor and, through the dynamics, that of the encoders. "
        "They are evaluated at the mode and decorrelated, so that a correct model gives independent values with a "
        "standard deviation of one; the grey band is ± 2 σ."
    )
    document.table(
        ["recording", "sensor", "samples:", "chi-square per sample:", "largest residual:"],
        misfit_rows(result),
        "Misfit by recording and sensor. Noise alone gives one, within the stated ± in two of three cases.",
    )
    for manoeuvre, sensors in zip(result.posterior.manoeuvres, result.sensor_fits, strict=True):
        document.figure(
            figures.measured_against_simulated(sensors),
            f"Measured and simulated readings of {manoeuvre.recording.name}, sensor axes; below, the residual in σ.",
        )
    _add_torques(document, result)
    document.figure(
        figures.residual_statistics(ResidualView.at(result.posterior, result.optimum.z)),
        "Residuals of all recordings. Left: mean power by frequency; noise alone gives one. Right: distribution, with "
        "the standard normal distribution.",
    )


def _add_torques(document: Document, result: Identification) -> None:
    if result.posterior.model.torque is None:
        return
    document.table(
        ["recording", "joint", "noise per sample:", "samples used:", "chi-square per sample:", "largest residual:"],
        torque_rows(result),
        "Joint torques. The torque of a joint with dry friction that is nearly at rest contains no information and is "
        "omitted.",
    )
    for manoeuvre, joints in zip(result.posterior.manoeuvres, result.torque_fits, strict=True):
        document.figure(
            figures.torques_over_time(joints), f"Measured and simulated joint torques in {manoeuvre.recording.name}."
        )


def _add_uncertainty(document: Document, result: Identification) -> None:
    if not result.bodies and not result.effects:
        return
    document.section("Uncertainty")
    document.figure(
        figures.prior_to_posterior(result),
        "Width of the posterior relative to that of the prior. At one (10⁰), the data add no information.",
    )
    for name in result.bodies:
        document.figure(
            figures.plot_posterior(result, name),
            f"Joint posterior of {name}: contours contain 50 % and 90 %. Axes are offsets from the mean in standard "
            "deviations; mean and standard deviation are given above the diagonal.",
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
    document.items(agreement_sentences(result))
    document.figure(
        figures.convergence(result),
        "The coordinates in which the ensembles agree least. Left: running mean of the draws, relative to the mean of "
        "all draws, in posterior standard deviations. Right: ranks of each ensemble's draws among all draws, which are "
        "uniform if all ensembles sample the same distribution.",
        floating=True,
    )


def _add_assumptions(document: Document, result: Identification, assumptions: Sequence[str]) -> None:
    document.section("Assumptions")
    document.items([*assumptions, *model_sentences(result.posterior, result.integration_error)])
    add_joints(document, result.posterior)


def summary(result: Identification) -> str:
    """Return which bodies were identified, from how many samples, and their masses."""
    posterior = result.posterior
    names = joined(body.name for body in posterior.model.bodies) or "no body"
    masses = [
        f"{name} {format_quantity(float(body.mean[0]), float(body.sd[0]))} kg" for name, body in result.bodies.items()
    ]
    return (
        f"Mass, centre of mass and inertia of {names} of the robot {posterior.model.robot.name} were identified from "
        f"{counted(len(posterior.manoeuvres), 'recording')} with {posterior.samples} scalar sensor samples. "
        f"Identified mass: {', '.join(masses) or 'none'}. Every ± is one standard deviation of the posterior."
    )


def verdict(result: Identification) -> str:
    """Return whether the model explains the data, judged by chi-square at the mode."""
    posterior, chi2, deviation = result.posterior, result.optimum.chi2, result.chi2_deviation
    expected, spread = result.expected_chi2
    numbers = (
        f"Chi-square, the sum of squares of the residuals in units of their noise, is {chi2:.0f}, or "
        f"{chi2 / posterior.samples:.3f} per sample. With {posterior.samples} samples and {posterior.size} unknowns, "
        f"noise alone gives {expected:.0f} ± {spread:.0f}; the difference is {format_signed(deviation)} standard "
        "deviations. "
    )
    if deviation > LIMIT:
        return numbers + (
            "The model does not explain the data: the residuals contain more than the declared noise. The "
            "uncertainties below assume that the model is correct, so they are too small, and the errors of the values "
            "may be larger than stated. A diagnosis searches for the cause."
        )
    if deviation < -LIMIT:
        return numbers + (
            "The residuals are smaller than the declared noise: the sensors are better than declared, so the "
            "uncertainties below are too large."
        )
    return numbers + "The declared noise is sufficient: by this measure the model explains the data."


def agreement_sentences(result: Identification) -> list[str]:
    """Return how the posterior was computed, and whether the three methods agree."""
    chains, evidence, optimum = result.chains, result.evidence, result.optimum
    mode = (
        f"Mode: Levenberg-Marquardt with exact derivatives, {optimum.evaluations} evaluations, "
        f"{_converged(optimum.converged)}."
    )
    sampler = (
        f"Samples: {chains.origin}, {chains.evaluations} evaluations in {result.seconds:.0f} s. "
        f"{chains.effective_samples:.0f} effective samples, largest R-hat {chains.r_hat:.4f}, longest autocorrelation "
        f"time {format_number(chains.autocorrelation)} steps; {_converged(chains.converged)}."
    )
    weights = (
        f"Importance sampling: {evidence.evaluations} draws, {evidence.effective_samples:.0f} effective, Pareto k-hat "
        f"{format_fixed(evidence.pareto_k, 2)} ({'trusted' if evidence.trusted else 'not trusted'}; the limit is 0.7). "
        f"Log evidence {format_quantity(evidence.value, evidence.error)}; the Laplace approximation gives "
        f"{format_number(optimum.log_evidence(result.posterior), 8)}."
    )
    agreement = "Laplace approximation, importance sampling and ensembles agree on means and widths."
    return [mode, sampler, weights, *(result.disagreements or (agreement,))]


def _converged(flag: bool) -> str:
    return "converged" if flag else "not converged"


def parameter_rows(result: Identification) -> Rows:
    """Return quantity, unit, prior centre, posterior, relative sd and shrinkage for every identified body."""
    rows = []
    for prior in result.posterior.model.bodies:
        body, centre = result.bodies[prior.name], mass_com_inertia(prior.centre.vector)
        for index, (key, unit) in enumerate(BODY_QUANTITIES.items()):
            mean, sd = float(body.mean[index]), float(body.sd[index])
            rows.append(
                [
                    f"{prior.name}.{key}",
                    format_unit(unit),
                    format_number(centre[index], 4),
                    format_quantity(mean, sd),
                    _relative(mean, sd),
                    _shrinkage(result.contraction[f"{prior.name}.{key}"]),
                ]
            )
    return rows


def effect_rows(result: Identification) -> Rows:
    """Return quantity, unit, central 68 % of the prior, posterior and distance from zero of effects with parameters."""
    return [
        [
            f"{row.label}.{row.name}",
            format_unit(row.unit),
            " to ".join(map(format_number, row.prior)),
            format_quantity(row.mean, row.sd),
            f"{format_fixed(abs(row.mean) / row.sd, 1)} sd" if row.sd > 0.0 else "",
        ]
        for row in result.effect_quantities
    ]


def start_rows(result: Identification) -> Rows:
    """Return recording, unknown, unit, prior, and posterior per axis for unknown initial rates and attitudes."""
    return [
        [
            *(state.recording, state.name, state.unit, f"0 ± {format_number(state.prior_sd)}"),
            *map(format_quantity, state.mean.tolist(), state.sd.tolist()),
        ]
        for state in result.starts
    ]


def misfit_rows(result: Identification) -> Rows:
    """Return recording, sensor, number of scalar samples, chi-square per sample and largest residual."""
    return [
        [manoeuvre.recording.name, fit.kind.value, str(fit.samples), *_misfit_cells(fit)]
        for manoeuvre, sensors in zip(result.posterior.manoeuvres, result.sensor_fits, strict=True)
        for fit in sensors
    ]


def torque_rows(result: Identification) -> Rows:
    """Return recording, joint, noise, number of samples used, chi-square per sample and largest residual."""
    sensor = result.posterior.model.torque
    return [
        [
            *(manoeuvre.recording.name, fit.joint, f"{format_number(sigma, 2)} {fit.unit}"),
            f"{fit.samples} of {len(fit.time)}",
            *_misfit_cells(fit),
        ]
        for manoeuvre, joints in zip(result.posterior.manoeuvres, result.torque_fits, strict=True)
        for fit, sigma in zip(joints, sensor.sigma if sensor else (), strict=True)
    ]


def _misfit_cells(fit: WhitenedFit) -> list[str]:
    """Return chi-square per sample ± the standard deviation that noise alone gives it, and the largest residual."""
    chi2 = f"{format_fixed(fit.chi2_per_sample, 3)} ± {format_fixed(fit.chi2_sd, 3)}" if fit.samples else "none"
    return [chi2, f"{format_fixed(fit.largest_residual, 1)} σ"]


def _shrinkage(contraction: Contraction) -> str:
    if contraction.verdict is ContractionVerdict.NOT:
        return "prior only"
    text = format_percent(contraction.shrinkage, 3)
    return text if contraction.verdict is ContractionVerdict.CONTRACTED else f"{text} (weakly)"


def _relative(mean: float, sd: float) -> str:
    if mean == 0.0 or sd > abs(mean):
        return "> 100 %"
    return format_percent(sd / abs(mean), 2)
