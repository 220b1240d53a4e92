"""What a model assumes: priors, links, sensors, effects, orbit, joint motion and its smoothing, integration."""

from __future__ import annotations

import numpy as np

from bayesid._io.words import counted
from bayesid.design import Plan
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.smoothing import SmoothedJoint
from bayesid.report.document import Document, Rows
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_range, format_unit, format_vector
from bayesid.robot.inertial_parameters import PARAMETERS
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Filter, Quantised, Sensor, SensorKind

__all__ = ["add_joints", "model_sentences", "planning_sentences"]

FAMILIES = {"position": "", "velocity": "/s", "acceleration": "/s²"}
"""Families of joint channels, with what follows the unit of the joint's position."""


def model_sentences(posterior: Posterior, integration_error: float) -> list[str]:
    """Return what the model and the declared noise assume.

    Parameters
    ----------
    posterior : Posterior
    integration_error : float
        Largest error of the integration in standard deviations of a sample.
    """
    model = posterior.model
    return [
        *_prior_sentences(posterior),
        _link_sentence(model),
        *(_sensor_sentence(posterior, sensor) for sensor in model.sensors),
        *_torque_sentences(model),
        *_effect_sentences(model),
        _orbit_sentence(model),
        _motion_sentence(posterior),
        f"Integration step {format_number(posterior.step)} s; the largest error of the integration is "
        f"{format_number(integration_error, 2)} standard deviations of a sample.",
        "Nothing else acts: bodies and links are rigid, and momentum changes only through the effects listed here and "
        "the recorded external actions.",
    ]


def planning_sentences(planned: Posterior | Plan) -> list[str]:
    """Return what a prediction, which has no sensors, assumes of the robot and of what acts on it."""
    model = planned.model
    tilt = max(planned.unknowns.tilt_sigma)
    attitude = f"uncertain by {format_number(tilt)} rad per axis" if tilt > 0.0 else "known exactly"
    return [
        *_body_sentences(model),
        _link_sentence(model),
        *_wheel_sentences(model),
        *_effect_sentences(model),
        _orbit_sentence(model),
        f"The initial attitude is {attitude}.",
    ]


def _prior_sentences(posterior: Posterior) -> list[str]:
    if posterior.flat_prior:
        return ["No prior: the likelihood alone was used."]
    sentences = _body_sentences(posterior.model)
    sigma = posterior.unknowns.rate_sigma
    rate = "exactly zero"
    if sigma > 0.0:
        rate = f"unknown in each recording, prior 0 ± {format_number(sigma)} rad/s per axis"
    tilt = max(posterior.unknowns.tilt_sigma)
    attitude = f"uncertain by up to {format_number(tilt)} rad per axis" if tilt > 0.0 else "known exactly"
    return [*sentences, f"The initial rate is {rate}. The initial attitude is {attitude}."]


def _body_sentences(model: Model) -> list[str]:
    return _joint_prior_sentences(model) or [
        f"Prior of {body.name}: the log-Cholesky coordinates of its pseudo-inertia are normal about the given values, "
        f"with a relative width of {format_number(body.spread)}, so that every value corresponds to a physical body. "
        f"The logarithm of the mass has a standard deviation of {format_number(2.0 * body.spread)}."
        for body in model.bodies
    ]


def _joint_prior_sentences(model: Model) -> list[str]:
    """Describe a joint prior of the bodies; nothing where they are independent."""
    if model.mixing is None:
        return []
    # theta_1 is half the logarithm of the mass
    widths = np.linalg.norm(np.array(model.mixing)[::PARAMETERS], axis=1)
    masses = ", ".join(
        f"{prior.name} {format_number(prior.centre.mass, 5)} kg ± {format_percent(2.0 * float(width), 2)}"
        for prior, width in zip(model.priors, widths, strict=True)
        if not prior.nuisance
    )
    return [
        "The prior of the bodies is the posterior of an earlier study, with the changes of mass stated since then: a "
        "correlated Gaussian of their log-Cholesky coordinates, so that every value corresponds to a physical body. "
        f"Masses: {masses}."
    ]


def _link_sentence(model: Model) -> str:
    nuisance = [prior for prior in model.priors if prior.nuisance]
    if not nuisance:
        return "All other links are known exactly: masses, centres of mass, inertias and geometry as given."
    width = format_range(prior.spread for prior in nuisance)
    names = ", ".join(prior.name for prior in nuisance)
    return (
        f"The inertial parameters of {names} have a relative uncertainty of {width}, which the result accounts for. "
        "The geometry is exact."
    )


def _wheel_sentences(model: Model) -> list[str]:
    wheels = model.robot.wheels
    if not wheels:
        return []
    listed = ", ".join(f"{wheel.name} ({format_number(wheel.inertia)} kg m2)" for wheel in wheels)
    return [f"Wheels of known speed contribute their momentum to the base; at rest they are part of it: {listed}."]


def _sensor_sentence(posterior: Posterior, sensor: Sensor) -> str:
    width = format_range(
        float(sigma) for index in range(len(posterior.manoeuvres)) for sigma in posterior.data.sigma(index, sensor.kind)
    )
    parts = [f"Sensor {sensor.kind.value}: white noise of {width} {format_unit(sensor.kind.unit)} per sample and axis"]
    if sensor.coloured is not None:
        level, unit = format_range(sensor.coloured.sigma), format_unit(sensor.kind.unit)
        time = format_number(sensor.coloured.time)
        parts.append(f"additional coloured noise of {level} {unit} with a correlation time of {time} s")
    if isinstance(sensor.noise, Quantised):
        step = f"{format_range(sensor.noise.step)} {format_unit(sensor.kind.unit)}"
        parts.append(f"rounding to a step of {step} included in it")
    if sensor.outliers:
        parts.append(f"outliers, up to about {format_percent(sensor.outliers)} of the readings, omitted")
    if sensor.kind is SensorKind.ACCEL:
        parts.append(f"mounted at {format_vector(np.asarray(sensor.position, dtype=float))} m in the base frame")
    if not np.allclose(sensor.rotation, np.eye(3)):
        parts.append("rotated relative to the base axes as declared")
    if sensor.filter.low_pass is not None:
        parts.append(f"low-pass at {format_number(sensor.filter.low_pass)} Hz")
    if sensor.filter.decimate > 1:
        parts.append(f"one sample of {sensor.filter.decimate} used")
    if sensor.filter != Filter():
        parts.append("measurement and simulation filtered identically")
    return "; ".join(parts) + "."


def _torque_sentences(model: Model) -> list[str]:
    if model.torque is None:
        return []
    width = format_range(model.torque.sigma)
    return [
        f"Joint torques of {', '.join(model.torque.joints)}: white noise of {width} N m (N for prismatic joints) per "
        "sample, measured on the motor side. Joint friction acts only if an effect of the model describes it."
    ]


def _effect_sentences(model: Model) -> list[str]:
    if not model.effects:
        return ["The model contains no effect beyond the motion of rigid bodies."]
    return [
        f"Effect {effect.label}. {effect.summary} "
        + ("Its parameters are unknowns." if effect.parameters else "It has no free parameter.")
        for effect in model.effects
    ]


def _orbit_sentence(model: Model) -> str:
    if model.orbit is None:
        return "No orbit was given: no environmental effect acts."
    return (
        f"Orbit: semi-major axis {format_number(model.orbit.radius / 1e3, 6)} km, eccentricity "
        f"{format_number(model.orbit.eccentricity)}."
    )


def _motion_sentence(posterior: Posterior) -> str:
    measured = [item.motion for item in posterior.manoeuvres if isinstance(item.motion, MeasuredMotion)]
    if not measured:
        return "The motion of the joints is prescribed and exact."
    window = max(item.window.every for item in posterior.whitenings)
    reach = f"correlated over up to {window} samples" if window else "with negligible correlation between samples"
    jumps = sum(len(joint.jumps) for motion in measured for joint in motion.joints)
    free = f" that permits {counted(jumps, 'jump')} of acceleration or jerk" if jumps else ""
    return (
        f"The motion of the joints is a smoothing spline of the encoder samples{free} (table below); its "
        f"uncertainty is propagated into the noise of the sensors, {reach}."
    )


def joint_rows(posterior: Posterior) -> Rows:
    """Return joint, noise of its channels, order of its smoothing and misfit, the last two for each recording in turn.

    The rows are empty where the motion of the joints is prescribed.
    """
    rows = []
    for index, joint in enumerate(posterior.model.robot.joints):
        fits: list[SmoothedJoint] = []
        noise: dict[str, list[float]] = {}
        for manoeuvre in posterior.manoeuvres:
            if isinstance(manoeuvre.motion, MeasuredMotion):
                fit = manoeuvre.motion.joints[index]
                present = [family for family in FAMILIES if f"{family}.{joint.name}" in manoeuvre.recording.channels]
                for family, sigma in zip(present, fit.sigmas, strict=False):
                    noise.setdefault(family, []).append(sigma)
                fits.append(fit)
        if fits:
            rows.append(
                [
                    joint.name,
                    "; ".join(
                        f"{family} {format_range(values, 2)} {joint.unit}{FAMILIES[family]}"
                        for family, values in noise.items()
                    ),
                    ", ".join(str(fit.order) for fit in fits),
                    ", ".join(format_fixed(fit.chi2 / max(fit.samples, 1), 2) for fit in fits),
                ]
            )
    return rows


def add_joints(document: Document, posterior: Posterior) -> None:
    """Add the table of the joints' smoothing; nothing where their motion is prescribed."""
    if rows := joint_rows(posterior):
        document.table(
            ["joint", "noise per sample", "order", "chi-square per sample"],
            rows,
            "Smoothing of the joints: noise of the samples, order of the derivative of the position that is modelled "
            "as white noise, and misfit of the samples to the spline, which is below one to the extent that the spline "
            "follows their noise. Orders and misfits are listed recording by recording.",
        )
