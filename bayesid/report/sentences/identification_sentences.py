"""Sentences of an identification report: the result, whether the model explains the data, and the computation."""

from __future__ import annotations

import numpy as np

from bayesid._io.words import counted, joined
from bayesid.inference.identification import Identification
from bayesid.report.numbers import format_number, format_quantity, format_signed

__all__ = ["agreement_sentences", "summary", "verdict"]

LIMIT = 3.0
"""Deviation of chi-square, in standard deviations of chi-square, that noise alone rarely reaches."""


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
    posterior, chi2 = result.posterior, result.optimum.chi2
    expected, spread = posterior.samples - posterior.size, float(np.sqrt(2.0 * posterior.samples))
    deviation = (chi2 - expected) / spread
    numbers = (
        f"Chi-square, the sum of squares of the residuals in units of their noise, is {chi2:.0f}, that is "
        f"{chi2 / posterior.samples:.3f} per sample. With {posterior.samples} samples and {posterior.size} unknowns, "
        f"noise alone gives {expected} ± {spread:.0f}; the difference is {format_signed(deviation)} standard "
        "deviations. "
    )
    if deviation > LIMIT:
        return numbers + (
            "The model does not explain the data: they hold more than the declared noise. The uncertainties below "
            "assume that the model is right, so they are too small, and the values may be shifted by more than "
            "they say. A diagnosis looks for the cause."
        )
    if deviation < -LIMIT:
        return numbers + (
            "The residuals are smaller than the declared noise: the sensors are better than declared, so the "
            "uncertainties below are too large."
        )
    return numbers + "The declared noise is enough: by this measure the model explains the data."


def agreement_sentences(result: Identification) -> list[str]:
    """Return how the posterior was computed, and whether the three methods agree."""
    chains, evidence, optimum = result.chains, result.evidence, result.optimum
    mode = (
        f"Mode: Levenberg-Marquardt with exact derivatives, {optimum.evaluations} evaluations, "
        f"{_converged(optimum.converged)}."
    )
    sampler = (
        f"Samples: emcee, {len(chains.z)} independent ensembles of {chains.walkers} walkers, {chains.steps} steps "
        f"each, {chains.evaluations} evaluations in {result.seconds:.0f} s. {chains.effective_samples:.0f} effective "
        f"samples, largest R-hat {chains.r_hat:.4f}, longest autocorrelation time "
        f"{format_number(chains.autocorrelation)} steps, {100.0 * chains.acceptance:.0f} % of the proposals accepted; "
        f"{_converged(chains.converged)}."
    )
    weights = (
        f"Importance sampling: {evidence.evaluations} draws worth {evidence.effective_samples:.0f}, Pareto k-hat "
        f"{evidence.pareto_k:.2f} ({'trusted' if evidence.trusted else 'not trusted'}; the limit is 0.7). "
        f"Log evidence {format_quantity(evidence.value, evidence.error)}; the Laplace approximation gives "
        f"{format_number(optimum.log_evidence(result.posterior), 8)}."
    )
    agreement = "Laplace approximation, importance sampling and ensembles agree on means and widths."
    return [mode, sampler, weights, *(result.disagreements or (agreement,))]


def _converged(flag: bool) -> str:
    return "converged" if flag else "not converged"
