"""What an extension is worth: prediction of recordings left out, residuals, shift of the parameters, calibration.

The score of a recording left out is its log predictive density given the others (A. E. Gelfand, D. K. Dey and H. Chang,
Model determination using predictive distributions, Bayesian Statistics 4, 1992), a proper score (T. Gneiting and
A. E. Raftery, Strictly proper scoring rules, prediction, and estimation, JASA 102, 2007).
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.inference.noise_changes import leaving_out
from bayesid.robot.inertial_parameters import PARAMETERS, mass_com_inertia

__all__ = ["BodyFigures", "Gain", "measure_gain"]


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
    held_out : (R,) array or None
        Log predictive density of each recording given the others; None with a single recording.
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
        """Shift of every reported quantity, in the standard deviations believed before."""
        return (self.after.bodies.mean - self.before.bodies.mean) / self.before.bodies.sd


def measure_gain(before: Hypothesis, after: Hypothesis, executor: Executor | None = None) -> Gain:
    """Compare two hypotheses on the same recordings.

    Parameters
    ----------
    before, after : Hypothesis
    executor : concurrent.futures.Executor, optional
        Refits them without each of the recordings at once.
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


def _held_out(hypothesis: Hypothesis, executor: Executor | None) -> Floats:
    """Log density of each recording given the others: the ratio of evidences with and without it (Laplace)."""
    fit = hypothesis.fit
    numbers = range(len(fit.posterior.manoeuvres))
    each = map if executor is None else executor.map
    rest = np.array(list(each(_bare_without, [hypothesis] * len(numbers), numbers)))
    return _bare(fit) - rest + fit.posterior.log_normalisation


def _bare_without(hypothesis: Hypothesis, number: int) -> float:
    """Log evidence, without constants, of all recordings but one."""
    fit = hypothesis.fit
    outputs = [whitening.outputs for whitening in fit.posterior.whitenings]
    masks = [output if i == number else np.zeros_like(output) for i, output in enumerate(outputs)]
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
