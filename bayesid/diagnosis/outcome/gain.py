"""What an extension is worth: prediction of recordings left out, residuals, errors of the simulation, parameters.

The score of a recording left out is its log predictive density given the others (A. E. Gelfand, D. K. Dey and H. Chang,
Model determination using predictive distributions, Bayesian Statistics 4, 1992), a proper score (T. Gneiting and
A. E. Raftery, Strictly proper scoring rules, prediction, and estimation, JASA 102, 2007).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.body_quantities import BODY_QUANTITIES, bodies_of, half_range
from bayesid.inference.noise_changes import leaving_out
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import by_recording
from bayesid.robot.inertial_parameters import PARAMETERS, mass_com_inertia
from bayesid.simulation.sensors import SensorKind

__all__ = [
    "FOLDS",
    "BodyFigures",
    "Gain",
    "ParameterChange",
    "SimulationError",
    "folds_of",
    "measure_gain",
    "parameter_changes",
    "simulation_errors",
    "strongest_recording",
]

PRIOR_DRAWS = 2000  # from which the width of the prior follows
FOLDS = 10  # most refits: more recordings are left out in so many groups


@dataclass(frozen=True)
class BodyFigures:
    """Laplace approximation of the reported quantities of all identified bodies: names, means, standard deviations."""

    names: tuple[str, ...]
    mean: Floats
    sd: Floats


@dataclass(frozen=True)
class ModelFigures:
    """The figures of one model: before or after.

    Attributes
    ----------
    chi2_per_sample : float
    held_out : (F,) array or None
        Log predictive density of each fold of recordings (`folds_of`) given the others; None with a single recording.
    rms : dict of str to float
        Root mean square of the residual in sigma, by sensor channel.
    inside : float
        Share of the whitened residual within one sigma; 0.683 if all is well.
    bodies : BodyFigures
    """

    chi2_per_sample: float
    held_out: Floats | None
    rms: dict[str, float]
    inside: float
    bodies: BodyFigures


@dataclass(frozen=True)
class Gain:
    """Before and after an extension."""

    before: ModelFigures
    after: ModelFigures

    @property
    def shift(self) -> Floats:
        """Shift of every reported quantity, in standard deviations of the fit before the extension."""
        return (self.after.bodies.mean - self.before.bodies.mean) / self.before.bodies.sd


def measure_gain(before: Hypothesis, after: Hypothesis, executor: Executor | None = None) -> Gain:
    """Compare two hypotheses on the same recordings.

    Parameters
    ----------
    before, after : Hypothesis
    executor : concurrent.futures.Executor, optional
        Refits them without each fold of the recordings at once.
    """
    first = _figures(before, executor)
    return Gain(first, first if after is before else _figures(after, executor))


def _figures(hypothesis: Hypothesis, executor: Executor | None) -> ModelFigures:
    fit = hypothesis.fit
    posterior = fit.posterior
    residual, recorded = fit.view.values, fit.view.mask
    rms = {
        name: float(np.sqrt((residual[..., c][recorded[..., c]] ** 2).mean()))
        for c, name in enumerate(posterior.model.channels.names)
        if recorded[..., c].any()
    }
    return ModelFigures(
        fit.chi2 / posterior.samples,
        _held_out(hypothesis, executor) if len(posterior.manoeuvres) > 1 else None,
        rms,
        float((np.abs(residual[recorded]) < 1.0).mean()),
        _body_figures(hypothesis),
    )


def folds_of(recordings: int) -> list[range]:
    """Return the recordings that are left out together: each by itself, or in ten folds where there are more.

    A fold takes every tenth recording, so that all folds see the same campaign. Source: M. Stone, Cross-validatory
    choice and assessment of statistical predictions, Journal of the Royal Statistical Society B 36, 1974.
    """
    return [range(first, recordings, FOLDS) for first in range(min(recordings, FOLDS))]


def _held_out(hypothesis: Hypothesis, executor: Executor | None) -> Floats:
    """Log density of each fold given the others: the ratio of evidences with and without it (Laplace)."""
    fit = hypothesis.fit
    folds = folds_of(len(fit.posterior.manoeuvres))
    if len(fit.posterior.manoeuvres) > FOLDS:
        return _held_out_by_steps(fit, folds)
    each = map if executor is None else executor.map
    rest = np.array(list(each(_bare_without, [hypothesis] * len(folds), folds)))
    constants = fit.posterior.log_normalisation
    return _bare(fit) - rest + np.array([constants[list(fold)].sum() for fold in folds])


def _held_out_by_steps(fit: Fit, folds: Sequence[range]) -> Floats:
    """Return the same by one Gauss-Newton step each: a tenth of the data moves the mode by less than its deviation."""
    residual, known = (by_recording(fit.posterior, part) for part in (fit.residual, fit.known))
    values = np.concatenate([fit.own_coordinates, *fit.coordinates])
    products, pulls = fit.known.T @ fit.known, fit.known.T @ fit.residual + values
    densities = []
    for fold in folds:
        left_out, columns = residual[list(fold)].ravel(), known[list(fold)].reshape(-1, known.shape[2])
        block = GaussianBlock.of(products - columns.T @ columns)
        moved = block.share(pulls - columns.T @ left_out)
        cost = fit.cost - 0.5 * float(left_out @ left_out + moved @ moved)
        constant = float(fit.posterior.log_normalisation[list(fold)].sum())
        densities.append(_bare(fit) + cost + block.half_log_det + constant)
    return np.array(densities)


def _bare_without(hypothesis: Hypothesis, fold: range) -> float:
    """Log evidence, without constants, of all recordings but those of a fold."""
    fit = hypothesis.fit
    outputs = [whitening.outputs for whitening in fit.posterior.whitenings]
    masks = [output if i in fold else np.zeros_like(output) for i, output in enumerate(outputs)]
    without = hypothesis.perturbed.with_posterior(leaving_out(fit.posterior, masks))
    return _bare(without.fit(fit.effects, fit.coordinates, z=fit.z, operating=fit.operating))


def _bare(fit: Fit) -> float:
    return -fit.cost - fit.block.half_log_det


def _body_figures(hypothesis: Hypothesis) -> BodyFigures:
    """Means and standard deviations of what is reported of the identified bodies."""
    fit = hypothesis.fit
    posterior = fit.posterior
    free = hypothesis.perturbed.free
    vector = posterior.unknowns.values_at(fit.z).inertial.reshape(-1, PARAMETERS)
    slope = posterior.unknowns.inertial_slope(fit.z).reshape(-1, PARAMETERS, len(fit.z))[..., free]
    covariance = fit.covariance[: len(free), : len(free)]
    names, mean, sd = [], [], []
    for index, prior in enumerate(posterior.model.priors):
        if prior.nuisance:
            continue
        quantities = mass_com_inertia(vector[index])
        step = 1e-6 * np.maximum(np.abs(vector[index]), 1e-3 * np.abs(vector[index]).max())
        stepped = mass_com_inertia(vector[index] + np.diag(step))
        slopes = ((stepped - quantities) / step[:, None]).T @ slope[index]
        names += [f"{prior.name}.{key}" for key in BODY_QUANTITIES]
        mean.append(quantities)
        sd.append(np.sqrt(np.einsum("ij,jk,ik->i", slopes, covariance, slopes)))
    empty = np.zeros(0)
    return BodyFigures(tuple(names), np.concatenate(mean) if mean else empty, np.concatenate(sd) if sd else empty)


@dataclass(frozen=True)
class ParameterChange:
    """One inertial parameter.

    Attributes
    ----------
    name, unit : str
    given, prior_sd : float
        Value in the study's files, and half the central 68 % of its prior.
    without, without_sd : float
        Fitted with the present model.
    fitted, fitted_sd : float
        Fitted with the named causes.
    shift : float
        From the one fit to the other, in the standard deviations of the first.
    """

    name: str
    unit: str
    given: float
    prior_sd: float
    without: float
    without_sd: float
    fitted: float
    fitted_sd: float
    shift: float

    def to_dict(self) -> dict[str, Any]:
        """Return the parameter in the form that it has in JSON."""
        return {
            "unit": self.unit,
            "given": self.given,
            "prior_sd": self.prior_sd,
            "before": {"mean": self.without, "sd": self.without_sd},
            "after": {"mean": self.fitted, "sd": self.fitted_sd},
            "shift_in_sd": self.shift,
        }


def parameter_changes(before: Hypothesis, gain: Gain) -> tuple[ParameterChange, ...]:
    """Return all inertial parameters of the identified bodies.

    Parameters
    ----------
    before : Hypothesis
        The present model.
    gain : Gain
        Its figures and those of the extended model.
    """
    posterior, first, second = before.fit.posterior, gain.before.bodies, gain.after.bodies
    if not first.names:
        return ()
    z = np.random.default_rng(0).normal(size=(PRIOR_DRAWS, posterior.size))
    widths = np.concatenate([half_range(body.values) for body in bodies_of(posterior, z).values()])
    given = np.concatenate([mass_com_inertia(prior.centre.vector) for prior in posterior.model.bodies])
    units = list(BODY_QUANTITIES.values()) * len(posterior.model.bodies)
    columns = (given, widths, first.mean, first.sd, second.mean, second.sd, gain.shift)
    rows = zip(first.names, units, *(column.tolist() for column in columns), strict=True)
    return tuple(ParameterChange(*row) for row in rows)


@dataclass(frozen=True)
class SimulationError:
    """Root mean square, over time, of the length of measured minus simulated of one sensor, in its unit.

    The residuals are those that were freed of their correlation, times the noise per sample.

    Attributes
    ----------
    kind : SensorKind
    before, after : float
        After is that of before where no cause is named.
    noise : float
        What the declared noise alone makes of it.
    """

    kind: SensorKind
    before: float
    after: float
    noise: float

    def to_dict(self) -> dict[str, Any]:
        """Return the error in the form that it has in JSON."""
        return {"unit": self.kind.unit, "before": self.before, "after": self.after, "noise": self.noise}


def simulation_errors(before: Hypothesis, after: Hypothesis, gain: Gain) -> tuple[SimulationError, ...]:
    """Return the errors of every sensor over all recordings, of the present model and the extended one.

    Parameters
    ----------
    before, after : Hypothesis
    gain : Gain
        Root mean squares of their residuals.
    """
    channels = before.fit.posterior.model.channels
    errors = []
    for kind in channels.kinds:
        names = channels.names[channels.of(kind)]
        sigmas = [_sigma(hypothesis.fit.posterior, kind) for hypothesis in (before, after)]
        rms = [np.array([figures.rms.get(name, 0.0) for name in names]) for figures in (gain.before, gain.after)]
        first, second = (float(np.linalg.norm(values * sigma)) for values, sigma in zip(rms, sigmas, strict=True))
        errors.append(SimulationError(kind, first, second, float(np.linalg.norm(sigmas[0]))))
    return tuple(errors)


def _sigma(posterior: Posterior, kind: SensorKind) -> Floats:
    """Root mean square over the recordings of the noise per sample of each axis."""
    widths = [posterior.data.sigma(index, kind) for index in range(len(posterior.manoeuvres))]
    return np.sqrt(np.mean(np.square(widths), axis=0))


def strongest_recording(before: Hypothesis, after: Hypothesis | None) -> int:
    """Return the recording whose chi-square decreases most, or is largest where there is no extended model.

    Parameters
    ----------
    before : Hypothesis
        The present model.
    after : Hypothesis or None
        The extended model.
    """
    hypotheses = [before] if after is None else [before, after]
    chi2 = [np.sum(by_recording(before.fit.posterior, model.fit.residual) ** 2, axis=1) for model in hypotheses]
    return int(np.argmax(chi2[0] - sum(chi2[1:])))
