"""Rows of an identification report's tables."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import BODY_QUANTITIES, reported_effect
from bayesid.inference.contraction import Contraction, ContractionVerdict
from bayesid.inference.identification import Identification
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.smoothing import SmoothedJoint
from bayesid.report.numbers import format_number, format_quantity, format_unit
from bayesid.report.sensor_fit import SensorFit, TorqueFit
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.effects import Effect

__all__ = ["effect_rows", "joint_rows", "misfit_rows", "parameter_rows", "start_rows"]

Rows = list[list[str]]

FAMILIES = ("position", "velocity", "acceleration")


def parameter_rows(result: Identification) -> Rows:
    """Quantity, unit, prior centre, posterior, relative sd, shrinkage of the prior of every identified body."""
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
    """Quantity, unit, prior (central 68 %), posterior and distance from zero of every effect that has parameters."""
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
                        f"{abs(mean) / sd:.1f} sd" if sd > 0.0 else "",
                    ]
                )
    return rows


def prior_range(effect: Effect) -> tuple[Floats, Floats]:
    """Return the ends of the central 68 % of the prior of an effect's quantities."""
    z = jnp.asarray(np.random.default_rng(0).normal(size=(2001, len(effect.parameters))))
    values = np.stack([np.asarray(p.value(z[:, k])) for k, p in enumerate(effect.parameters)], axis=-1)
    low, high = np.percentile(reported_effect(effect, values), [16.0, 84.0], axis=0)
    return low, high


def start_rows(result: Identification) -> Rows:
    """Return initial rate and attitude of each recording, where unknown."""
    posterior = result.posterior
    values = posterior.unknowns.values_of(result.chains.flat)
    rows = []
    for index, manoeuvre in enumerate(posterior.manoeuvres):
        unknown = [("initial rate", "rad/s", values.rate, posterior.unknowns.rate_sigma)]
        unknown.append(("initial rotation", "rad", values.tilt, posterior.unknowns.tilt_sigma[index]))
        for label, unit, draws, sigma in unknown:
            if sigma > 0.0:
                own = np.asarray(draws)[:, index]
                texts = [
                    format_quantity(float(m), float(s))
                    for m, s in zip(own.mean(axis=0), own.std(axis=0, ddof=1), strict=True)
                ]
                rows.append([manoeuvre.recording.name, label, unit, f"0 ± {format_number(sigma)}", *texts])
    return rows


def misfit_rows(posterior: Posterior, fits: list[list[SensorFit]]) -> Rows:
    """Return recording, sensor, scalar samples, chi2 per sample and largest residual."""
    return [
        [
            manoeuvre.recording.name,
            fit.kind.value,
            str(fit.samples),
            f"{fit.chi2 / max(fit.samples, 1):.3f} ± {np.sqrt(2.0 / max(fit.samples, 1)):.3f}",
            f"{np.nanmax(np.abs(fit.residual), initial=0.0):.1f} σ",
        ]
        for manoeuvre, own in zip(posterior.manoeuvres, fits, strict=True)
        for fit in own
    ]


def torque_rows(posterior: Posterior, fits: list[list[TorqueFit]]) -> Rows:
    """Return recording, joint, noise, samples used, chi2 per sample and largest residual."""
    sigmas = () if posterior.model.torque is None else posterior.model.torque.sigma
    return [
        [
            manoeuvre.recording.name,
            fit.joint,
            f"{format_number(sigma, 2)} {fit.unit}",
            f"{len(fit.residual)} of {len(fit.time)}",
            f"{(fit.residual**2).mean():.3f} ± {np.sqrt(2.0 / len(fit.residual)):.3f}" if len(fit.residual) else "none",
            f"{np.max(np.abs(fit.residual), initial=0.0):.1f} σ",
        ]
        for manoeuvre, own in zip(posterior.manoeuvres, fits, strict=True)
        for fit, sigma in zip(own, sigmas, strict=True)
    ]


def joint_rows(posterior: Posterior) -> Rows:
    """Joint, noise of its channels, order of its smoothing and misfit, the last two one value per recording."""
    joints = posterior.model.robot.joints
    rows = []
    for index, joint in enumerate(joints):
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
            texts = [
                f"{family} {_span(values)} {joint.unit}{('', '/s', '/s²')[FAMILIES.index(family)]}"
                for family, values in noise.items()
            ]
            orders = ", ".join(str(fit.order) for fit in fits)
            misfits = ", ".join(f"{fit.chi2 / max(fit.samples, 1):.2f}" for fit in fits)
            rows.append([joint.name, "; ".join(texts), orders, misfits])
    return rows


def _span(values: list[float]) -> str:
    low, high = format_number(min(values), 2), format_number(max(values), 2)
    return low if low == high else f"{low} to {high}"


def _shrinkage(contraction: Contraction) -> str:
    if contraction.verdict is ContractionVerdict.NOT:
        return "prior only"
    text = f"{format_number(100.0 * contraction.shrinkage, 3)} %"
    return text if contraction.verdict is ContractionVerdict.CONTRACTED else f"{text} (weakly)"


def _relative(mean: float, sd: float) -> str:
    if mean == 0.0 or sd > abs(mean):
        return "> 100 %"
    return f"{format_number(100.0 * sd / abs(mean), 2)} %"
