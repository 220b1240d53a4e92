"""Rows of an identification report's tables."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.inference.body_quantities import BODY_QUANTITIES, reported_effect
from bayesid.inference.contraction import Contraction, ContractionVerdict
from bayesid.inference.identification import Identification
from bayesid.inference.posterior import Posterior
from bayesid.inference.sensor_fit import SensorFit, TorqueFit
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.smoothing import SmoothedJoint
from bayesid.report.document import Rows
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_percent,
    format_quantity,
    format_range,
    format_unit,
)
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.effects import Effect

__all__ = ["effect_rows", "joint_rows", "misfit_rows", "parameter_rows", "prior_range", "start_rows", "torque_rows"]

FAMILIES = {"position": "", "velocity": "/s", "acceleration": "/s²"}
"""Families of joint channels, with what follows the unit of the joint's position."""


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
    rows = []
    for effect in result.posterior.model.effects:
        if not effect.parameters:
            continue
        draws = result.effects[effect.label]
        copies = [(effect.label, draws)]
        if effect.per_recording:
            names = [manoeuvre.recording.name for manoeuvre in result.posterior.manoeuvres]
            copies = [(f"{effect.label}[{name}]", draws[:, index]) for index, name in enumerate(names)]
        prior = prior_range(effect)
        for label, values in copies:
            for index, (key, unit) in enumerate(effect.quantities):
                mean, sd = float(values[:, index].mean()), float(values[:, index].std(ddof=1))
                rows.append(
                    [
                        f"{label}.{key}",
                        format_unit(unit),
                        f"{format_number(prior[0][index])} to {format_number(prior[1][index])}",
                        format_quantity(mean, sd),
                        f"{format_fixed(abs(mean) / sd, 1)} sd" if sd > 0.0 else "",
                    ]
                )
    return rows


def prior_range(effect: Effect) -> tuple[Floats, Floats]:
    """Return the ends of the central 68 % of the prior of an effect's quantities."""
    z = on_device(np.random.default_rng(0).normal(size=(2001, len(effect.parameters))))
    values = np.stack([np.asarray(p.value(z[:, k])) for k, p in enumerate(effect.parameters)], axis=-1)
    low, high = np.percentile(reported_effect(effect, values), [16.0, 84.0], axis=0)
    return low, high


def start_rows(result: Identification) -> Rows:
    """Return recording, unknown, unit, prior, and posterior per axis for unknown initial rates and attitudes."""
    posterior = result.posterior
    values = posterior.unknowns.values_of(result.chains.flat)
    rows = []
    for index, manoeuvre in enumerate(posterior.manoeuvres):
        unknown = [("initial rate", "rad/s", values.rate, posterior.unknowns.rate_sigma)]
        unknown.append(("initial rotation", "rad", values.tilt, posterior.unknowns.tilt_sigma[index]))
        for label, unit, draws, sigma in unknown:
            if sigma > 0.0:
                drawn = np.asarray(draws)[:, index]
                texts = [
                    format_quantity(float(mean), float(sd))
                    for mean, sd in zip(drawn.mean(axis=0), drawn.std(axis=0, ddof=1), strict=True)
                ]
                rows.append([manoeuvre.recording.name, label, unit, f"0 ± {format_number(sigma)}", *texts])
    return rows


def misfit_rows(posterior: Posterior, fits: list[list[SensorFit]]) -> Rows:
    """Return recording, sensor, number of scalar samples, chi-square per sample and largest residual."""
    return [
        [
            manoeuvre.recording.name,
            fit.kind.value,
            str(fit.samples),
            _chi2_per_sample(fit.chi2, max(fit.samples, 1)),
            _largest(fit.residual),
        ]
        for manoeuvre, sensors in zip(posterior.manoeuvres, fits, strict=True)
        for fit in sensors
    ]


def torque_rows(posterior: Posterior, fits: list[list[TorqueFit]]) -> Rows:
    """Return recording, joint, noise, number of samples used, chi-square per sample and largest residual."""
    sigmas = () if posterior.model.torque is None else posterior.model.torque.sigma
    return [
        [
            manoeuvre.recording.name,
            fit.joint,
            f"{format_number(sigma, 2)} {fit.unit}",
            f"{len(fit.residual)} of {len(fit.time)}",
            _chi2_per_sample(float(fit.residual @ fit.residual), len(fit.residual)) if len(fit.residual) else "none",
            _largest(fit.residual),
        ]
        for manoeuvre, joints in zip(posterior.manoeuvres, fits, strict=True)
        for fit, sigma in zip(joints, sigmas, strict=True)
    ]


def _chi2_per_sample(chi2: float, samples: int) -> str:
    """Return chi-square per sample ± the standard deviation that noise alone gives it."""
    return f"{format_fixed(chi2 / samples, 3)} ± {format_fixed(float(np.sqrt(2.0 / samples)), 3)}"


def _largest(residual: Floats) -> str:
    return f"{format_fixed(float(np.nanmax(np.abs(residual), initial=0.0)), 1)} σ"


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


def _shrinkage(contraction: Contraction) -> str:
    if contraction.verdict is ContractionVerdict.NOT:
        return "prior only"
    text = format_percent(contraction.shrinkage, 3)
    return text if contraction.verdict is ContractionVerdict.CONTRACTED else f"{text} (weakly)"


def _relative(mean: float, sd: float) -> str:
    if mean == 0.0 or sd > abs(mean):
        return "> 100 %"
    return format_percent(sd / abs(mean), 2)
