"""Complete identification: mode, Laplace approximation, evidence and samples of one posterior, and their agreement."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.files import write_json
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import (
    BODY_QUANTITIES,
    BodyDraws,
    Contraction,
    bodies_of,
    body_dict,
    compare,
    quantity,
    reported_effect,
)
from bayesid.inference.collapsed_proposal import collapsed_proposal
from bayesid.inference.ensemble import Chains, sample
from bayesid.inference.importance import Evidence, choose_parameterisation, importance_sample
from bayesid.inference.mode import Optimum, maximise
from bayesid.inference.parameterisation import LinearParameterisation
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import integration_error_at

__all__ = ["Identification", "identify"]


NEARLY_NORMAL = 0.3
"""Share of effective samples of importance sampling below which a better proposal than the Student-t is sought."""

PRIOR_DRAWS = 4000
"""Number of draws from the prior that give its widths, for the comparison with the posterior."""

MEAN_TOLERANCE, WIDTH_TOLERANCE = 0.25, 0.2
"""Largest unreported difference of two methods: of means in standard deviations, and of widths as a ratio."""


@dataclass(frozen=True)
class Identification:
    """Result of `identify`.

    Attributes
    ----------
    posterior : Posterior
        Posterior with its noise linearised at the mode.
    optimum : Optimum
        Mode and Laplace approximation.
    evidence : Evidence
        Evidence by importance sampling.
    chains : Chains
        Posterior samples.
    seconds : float
        Wall time of the sampler [s].
    """

    posterior: Posterior
    optimum: Optimum
    evidence: Evidence
    chains: Chains
    seconds: float

    @cached_property
    def bodies(self) -> dict[str, BodyDraws]:
        """Draws of the reported quantities of every identified body."""
        return bodies_of(self.posterior, self.chains.flat)

    @cached_property
    def effects(self) -> dict[str, Floats]:
        """Draws of the reported quantities of every effect, (draws, n), or (draws, R, n) if recordings differ."""
        values = self.posterior.unknowns.values_of(self.chains.flat)
        return {
            effect.label: reported_effect(effect, np.asarray(draws))
            for effect, draws in zip(self.posterior.model.effects, values.effects, strict=True)
            if effect.parameters
        }

    @cached_property
    def contraction(self) -> dict[str, Contraction]:
        """Posterior contraction of every reported quantity of the bodies, by its name in `names`."""
        z = np.random.default_rng(0).normal(size=(PRIOR_DRAWS, self.posterior.size))
        prior = bodies_of(self.posterior, z)
        if not prior:
            return {}
        both = (np.concatenate([body.values for body in draws.values()], axis=1) for draws in (prior, self.bodies))
        return compare(self.names, *both)

    @cached_property
    def integration_error(self) -> float:
        """Largest error of any sample due to the integration step, in standard deviations of the sample."""
        return integration_error_at(self.posterior, self.optimum.z)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the reported quantities of all bodies."""
        return tuple(f"{body}.{key}" for body in self.bodies for key in BODY_QUANTITIES)

    @property
    def covariance(self) -> Floats:
        """Posterior covariance of the quantities of all bodies in the order of `names`, (0, 0) without bodies."""
        if not self.bodies:
            return np.zeros((0, 0))
        return np.atleast_2d(np.cov(np.concatenate([body.values for body in self.bodies.values()], axis=1).T))

    @property
    def disagreements(self) -> tuple[str, ...]:
        """Sentences on differences between mode, importance sampling and samples; empty where the methods agree."""
        sentences = []
        draws = self.chains.flat
        mean, sd = draws.mean(axis=0), draws.std(axis=0)
        laplace_sd = np.sqrt(np.diag(self.optimum.covariance))
        methods = [("Laplace approximation", self.optimum.z, laplace_sd)]
        if self.evidence.trusted:
            methods.append(("importance sampling", self.evidence.mean, self.evidence.sd))
        else:
            sentences.append(
                f"Importance sampling is not evaluated: Pareto k-hat {self.evidence.pareto_k:.2f} is above 0.7, "
                "so the evidence may not be trusted."
            )
        for method, other_mean, other_sd in methods:
            shift = np.abs(mean - other_mean) / sd
            ratio = np.abs(other_sd / sd - 1.0)
            worst = int(np.argmax(np.maximum(shift / MEAN_TOLERANCE, ratio / WIDTH_TOLERANCE)))
            if shift[worst] > MEAN_TOLERANCE or ratio[worst] > WIDTH_TOLERANCE:
                sentences.append(
                    f"The {method} and the samples differ most in {self.posterior.unknowns.names[worst]}: "
                    f"means by {shift[worst]:.2f} sd, widths by {100.0 * ratio[worst]:.0f} %. The samples are reported."
                )
        if not self.chains.converged:
            sentences.append(
                f"The sampler has not converged: R-hat {self.chains.r_hat:.3f}, "
                f"{self.chains.effective_samples:.0f} effective samples after {self.chains.steps} steps."
            )
        return tuple(sentences)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of identification.json."""
        return {
            "bodies": {name: body_dict(body) for name, body in self.bodies.items()},
            "effects": self._effects_dict(),
            "learnt": {name: item.to_dict() for name, item in self.contraction.items()},
            "covariance": {"names": list(self.names), "matrix": self.covariance.tolist()},
            "fit": {"chi2": self.optimum.chi2, "samples": self.posterior.samples, "unknowns": self.posterior.size},
            "sampler": {
                "effective_samples": self.chains.effective_samples,
                "r_hat": self.chains.r_hat,
                "evaluations": self.chains.evaluations,
                "seconds": self.seconds,
                "converged": self.chains.converged,
            },
            "log_evidence": {
                "value": self.evidence.value,
                "error": self.evidence.error,
                "pareto_k": self.evidence.pareto_k,
                "trusted": self.evidence.trusted,
            },
            "disagreements": list(self.disagreements),
            "integration": {"step": self.posterior.step, "error_in_sigma": self.integration_error},
        }

    def write_json(self, file: Path) -> None:
        """Write `to_dict` to a file, whole or not at all."""
        write_json(file, self.to_dict())

    def _effects_dict(self) -> dict[str, Any]:
        result: dict[str, Any] = {}
        for effect in self.posterior.model.effects:
            if not effect.parameters:
                continue
            draws = self.effects[effect.label]
            mean, sd = draws.mean(axis=0), draws.std(axis=0, ddof=1)
            rows = [(effect.label, mean, sd)]
            if effect.per_recording:
                rows = [
                    (f"{effect.label}[{manoeuvre.recording.name}]", mean[i], sd[i])
                    for i, manoeuvre in enumerate(self.posterior.manoeuvres)
                ]
            for label, centre, width in rows:
                result[label] = {
                    key: quantity(centre[k], width[k], unit) for k, (key, unit) in enumerate(effect.quantities)
                }
        return result


def identify(
    posterior: Posterior,
    seed: int = 0,
    *,
    start: Floats | None = None,
    effective_samples: float = 4000.0,
    max_steps: int = 5000,
    file: Path | None = None,
    progress: Progress = silent,
) -> Identification:
    """Identify the unknowns of a posterior.

    Parameters
    ----------
    posterior : Posterior
    seed : int
        Seed of all random numbers.
    start : (n,) array, optional
        Starting point of the search for the mode, by default the prior's centre.
    effective_samples, max_steps, file, progress
        See `bayesid.inference.sample`.
    """
    starts, weights, walkers = np.random.SeedSequence(seed).spawn(3)
    refined, optimum = maximise(posterior, np.random.default_rng(starts), start)
    rng = np.random.default_rng(weights)
    parameterisation = choose_parameterisation(refined, optimum, rng)
    evidence = importance_sample(parameterisation, optimum, rng)
    began = time.perf_counter()
    trusted, proposal = evidence.trusted, None
    if evidence.effective_samples < NEARLY_NORMAL * evidence.evaluations:
        proposal = collapsed_proposal(refined, optimum, rng, effective_samples)
    if proposal is not None:
        parameterisation, trusted = LinearParameterisation(refined), True
    chains = sample(
        parameterisation,
        optimum,
        walkers,
        effective_samples=effective_samples,
        max_steps=max_steps,
        trusted=trusted,
        proposal=proposal,
        file=file,
        progress=progress,
    )
    return Identification(refined, optimum, evidence, chains, time.perf_counter() - began)
