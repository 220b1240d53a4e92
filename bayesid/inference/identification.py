"""Complete identification: mode, Laplace approximation, evidence and samples of one posterior, and their agreement."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from emcee.backends import HDFBackend

from bayesid._io.errors import InputError
from bayesid._io.files import write_json
from bayesid._io.progress import Progress, silent
from bayesid._io.short_form import ShortForm, Summary, format_spread
from bayesid._io.words import joined
from bayesid._math.arrays import Floats
from bayesid._math.divergence import divergence_named
from bayesid._math.double_precision import in_double_precision
from bayesid._math.on_device import on_device
from bayesid.inference.adapted_proposal import adapted_proposal, effective_share
from bayesid.inference.body_quantities import (
    BODY_QUANTITIES,
    BodyDraws,
    Contraction,
    bodies_of,
    body_dict,
    compare,
    half_range,
    quantity,
    reported_effect,
)
from bayesid.inference.collapsed_proposal import collapsed_proposal
from bayesid.inference.encoder_noise import first_rate_sd
from bayesid.inference.ensemble import Chains
from bayesid.inference.importance import Evidence, choose_parameterisation, importance_sample
from bayesid.inference.mode import Optimum, maximise
from bayesid.inference.parameterisation import LinearParameterisation, LogCholeskyParameterisation
from bayesid.inference.posterior import Posterior
from bayesid.inference.posterior_as_prior import identified_robot
from bayesid.inference.posterior_file import to_arviz
from bayesid.inference.predicted_readings import SensorFit, TorqueFit, integration_error_at, sensor_fits, torque_fits
from bayesid.inference.sampler import Emcee, Sampler, SamplingTarget, chains_of
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect

if TYPE_CHECKING:
    from xarray import DataTree

__all__ = ["EffectQuantity", "Identification", "StartState", "identify"]


NEARLY_NORMAL = 0.3
"""Share of effective samples of importance sampling below which a better proposal than the Student-t is sought."""

WORTHLESS = 0.02
"""Share of effective draws below which the proposal of the linearised likelihood is not used."""

PRIOR_DRAWS = 4000
"""Number of draws from the prior that give its widths, for the comparison with the posterior."""

HOPELESS = 1e6
"""Chi-square per sample from which on a posterior says nothing: the readings are a thousand sigma off."""

MEAN_TOLERANCE, WIDTH_TOLERANCE = 0.25, 0.2
"""Largest unreported difference of two methods: of means in standard deviations, and of widths as a ratio."""


@dataclass(frozen=True)
class EffectQuantity:
    """One reported quantity of an effect.

    Attributes
    ----------
    label : str
        Effect, with the recording in brackets if it has values in each.
    name, unit : str
    prior : tuple of float
        Ends of the central 68 % of the prior.
    mean, sd : float
        Of the posterior.
    """

    label: str
    name: str
    unit: str
    prior: tuple[float, float]
    mean: float
    sd: float


@dataclass(frozen=True)
class StartState:
    """Unknown state of the base at the start of one recording: its rate, or its rotation from the attitude given.

    Attributes
    ----------
    recording, name, unit : str
    prior_sd : float
        Standard deviation of the prior per axis, about zero.
    mean, sd : (3,) array
        Of the posterior, base axes.
    """

    recording: str
    name: str
    unit: str
    prior_sd: float
    mean: Floats
    sd: Floats

    def to_dict(self) -> dict[str, Any]:
        """Return the state in the form that it has in JSON."""
        return {**vars(self), "mean": self.mean.tolist(), "sd": self.sd.tolist()}


@dataclass(frozen=True, repr=False)
class Identification(ShortForm):
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
    def effect_quantities(self) -> tuple[EffectQuantity, ...]:
        """Reported quantities of the effects with parameters, in all recordings."""
        rows = []
        for effect in self.posterior.model.effects:
            if not effect.parameters:
                continue
            draws = self.effects[effect.label]
            mean, sd = np.atleast_2d(draws.mean(axis=0)), np.atleast_2d(draws.std(axis=0, ddof=1))
            prior = list(zip(*prior_range(effect), strict=True))
            for index, label in enumerate(self._labels(effect)):
                rows += [
                    EffectQuantity(label, name, unit, prior[k], float(mean[index, k]), float(sd[index, k]))
                    for k, (name, unit) in enumerate(effect.quantities)
                ]
        return tuple(rows)

    def _labels(self, effect: Effect) -> list[str]:
        """Return the names of an effect's values, one for each recording if they differ."""
        if not effect.per_recording:
            return [effect.label]
        return [f"{effect.label}[{manoeuvre.recording.name}]" for manoeuvre in self.posterior.manoeuvres]

    @cached_property
    def starts(self) -> tuple[StartState, ...]:
        """Unknown initial rates and rotations of the base; rates include the uncertainty caused by encoder noise."""
        unknowns, values = self.posterior.unknowns, self.posterior.unknowns.values_of(self.chains.flat)
        states = []
        for index, manoeuvre in enumerate(self.posterior.manoeuvres):
            for name, unit, draws, sigma in (
                ("initial rate", "rad/s", values.rate, unknowns.rate_sigma),
                ("initial rotation", "rad", values.tilt, unknowns.tilt_sigma[index]),
            ):
                if sigma > 0.0:
                    drawn = np.asarray(draws)[:, index]
                    mean, sd = drawn.mean(axis=0), drawn.std(axis=0, ddof=1)
                    if name == "initial rate":
                        samples = self.posterior.data.recorded[index]
                        sd = np.hypot(sd, first_rate_sd(self.robot, samples.motion, samples.wheels))
                    states.append(StartState(manoeuvre.recording.name, name, unit, float(sigma), mean, sd))
        return tuple(states)

    @cached_property
    def widths(self) -> dict[str, tuple[float, float]]:
        """Half the central 68 % range of every reported quantity of bodies and effects, in prior and posterior."""
        z = np.random.default_rng(0).normal(size=(PRIOR_DRAWS, self.posterior.size))
        drawn = self.posterior.unknowns.values_of(z).effects
        names, sides = list(self.names), [list[Floats](), list[Floats]()]
        for side, bodies in zip(sides, (bodies_of(self.posterior, z), self.bodies), strict=True):
            side.extend(half_range(body.values) for body in bodies.values())
        for effect, values in zip(self.posterior.model.effects, drawn, strict=True):
            if effect.parameters:
                names += [f"{label}.{key}" for label in self._labels(effect) for key, _ in effect.quantities]
                both = (reported_effect(effect, np.asarray(values)), self.effects[effect.label])
                for side, draws in zip(sides, both, strict=True):
                    side.append(half_range(draws.reshape(len(draws), -1)))
        prior, posterior = (np.concatenate(side).tolist() if side else [] for side in sides)
        return dict(zip(names, zip(prior, posterior, strict=True), strict=True))

    @cached_property
    def r_hat(self) -> dict[str, float]:
        """R-hat of every unknown over the ensembles."""
        from arviz_stats.base import array_stats  # here, as it takes a second that commands without samples save

        values = array_stats.rhat(self.chains.z, chain_axis=0, draw_axis=1)
        return dict(zip(self.posterior.unknowns.names, values.tolist(), strict=True))

    @property
    def expected_chi2(self) -> tuple[float, float]:
        """Chi-square that noise alone gives at the mode, and its standard deviation."""
        samples = self.posterior.samples
        return float(samples - self.posterior.size), float(np.sqrt(2.0 * samples))

    @property
    def chi2_deviation(self) -> float:
        """Deviation of chi-square at the mode from what noise alone gives, in standard deviations."""
        expected, sd = self.expected_chi2
        return (self.optimum.chi2 - expected) / sd

    @cached_property
    def sensor_fits(self) -> list[list[SensorFit]]:
        """Readings at the mode: a list per recording, an entry per sensor."""
        return sensor_fits(self.posterior, self.optimum.z)

    @cached_property
    def torque_fits(self) -> list[list[TorqueFit]]:
        """Joint torques at the mode: a list per recording, an entry per joint."""
        return torque_fits(self.posterior, self.optimum.z)

    @cached_property
    def integration_error(self) -> float:
        """Largest error of any sample caused by the integration step, in standard deviations of the sample."""
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
                "so the evidence is not reliable."
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
                + (
                    " Almost no proposal was accepted: these recordings do not determine the individual unknowns, only "
                    "strongly nonlinear combinations of them. Record moving joints."
                    if self.chains.stuck
                    else ""
                )
            )
        return tuple(sentences)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of identification.json."""
        return {
            "bodies": {name: body_dict(body) for name, body in self.bodies.items()},
            "effects": self._effects_dict(),
            "learnt": {name: contraction.to_dict() for name, contraction in self.contraction.items()},
            "widths": {name: {"prior": both[0], "posterior": both[1]} for name, both in self.widths.items()},
            "starts": [state.to_dict() for state in self.starts],
            "covariance": {"names": list(self.names), "matrix": self.covariance.tolist()},
            "fit": {
                "chi2": self.optimum.chi2,
                "samples": self.posterior.samples,
                "unknowns": self.posterior.size,
                "expected_chi2": self.expected_chi2[0],
                "expected_sd": self.expected_chi2[1],
            },
            "misfit": {
                manoeuvre.recording.name: {
                    **{fit.kind.value: fit.misfit_dict() for fit in sensors},
                    **{f"torque.{fit.joint}": fit.misfit_dict() for fit in joints},
                }
                for manoeuvre, sensors, joints in zip(
                    self.posterior.manoeuvres, self.sensor_fits, self.torque_fits, strict=True
                )
            },
            "sampler": {
                "effective_samples": self.chains.effective_samples,
                "r_hat": self.chains.r_hat,
                "r_hat_by_unknown": self.r_hat,
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

    def to_datatree(self, seed: int = 0) -> DataTree:
        """Return the result by the convention of ArviZ, each independent ensemble a chain.

        Its groups are posterior, prior, sample_stats, log_likelihood, posterior_predictive and observed_data.

        Parameters
        ----------
        seed : int
            Seed of the predicted sensor noise and of the draws from the prior.
        """
        return to_arviz(self, np.random.default_rng(seed))

    @cached_property
    def robot(self) -> Robot:
        """Robot with the posterior mean of every unknown body."""
        return identified_robot(self)

    def to_urdf(self, file: str | Path) -> None:
        """Write the URDF with the identified inertias of the unknown bodies, whole or not at all."""
        self.robot.write_urdf(file)

    def summary(self) -> Summary:
        """Return the fit, and mean and standard deviation of every quantity."""
        expected, sd = self.expected_chi2
        names = joined(self.bodies) or "effects only"
        fit = (
            f"Identification of {names}: {self.posterior.samples} samples, {self.posterior.size} unknowns; chi-square "
            f"{self.optimum.chi2:.0f}, where {expected:.0f} ± {sd:.0f} is expected; "
            f"{self.chains.effective_samples:.0f} effective samples."
        )
        rows = [row for body in self.bodies.values() for row in body.summary().rows]
        effects = self.effect_quantities
        rows += [(f"{row.label}.{row.name}", format_spread(row.mean, row.sd, row.unit)) for row in effects]
        return Summary([fit, *self.disagreements], ("quantity", "mean ± sd"), rows)

    def _effects_dict(self) -> dict[str, Any]:
        effects: dict[str, Any] = {}
        for row in self.effect_quantities:
            entry = {**quantity(row.mean, row.sd, row.unit), "prior_68": list(row.prior)}
            effects.setdefault(row.label, {})[row.name] = entry
        return effects


@in_double_precision
def prior_range(effect: Effect) -> tuple[list[float], list[float]]:
    """Return the ends of the central 68 % of the prior of an effect's quantities."""
    z = on_device(np.random.default_rng(0).normal(size=(2001, len(effect.parameters))))
    values = np.stack([np.asarray(p.value(z[:, k])) for k, p in enumerate(effect.parameters)], axis=-1)
    low, high = np.percentile(reported_effect(effect, values), [16.0, 84.0], axis=0)
    return low.tolist(), high.tolist()


@divergence_named()
def identify(
    posterior: Posterior,
    seed: int = 0,
    *,
    start: Floats | None = None,
    effective_samples: float = 4000.0,
    sampler: Sampler | None = None,
    max_steps: int = 5000,
    file: str | Path | HDFBackend | None = None,
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
    sampler : Sampler, optional
        Sampler of the posterior, by default `Emcee`, whose ``max_steps`` and ``file`` may be given here.
    effective_samples, max_steps, file, progress
        See `bayesid.inference.sample`.

    Raises
    ------
    InputError
        If no values of the unknowns fit the data, or the sampler does not return draws of the
        posterior; `DivergenceError` where no fit is finite.
    """
    if sampler is not None and file is not None:
        raise InputError("a sampler and a file of emcee are given", remedy="Give sampler=Emcee(file=...) alone")
    starts, weights, walkers = np.random.SeedSequence(seed).spawn(3)
    refined, optimum = maximise(posterior, np.random.default_rng(starts), start)
    if not optimum.chi2 < HOPELESS * refined.samples:
        raise InputError(
            f"no values of the unknowns fit the data: chi-square per sample is {optimum.chi2 / refined.samples:.2g} "
            "after the fit, where noise alone gives 1",
            remedy="Run `bayesid check` and `bayesid diagnose` to examine attitudes, units, the declared noise and "
            "missing causes",
        )
    rng = np.random.default_rng(weights)
    parameterisation = choose_parameterisation(refined, optimum, rng)
    evidence = importance_sample(parameterisation, optimum, rng)
    began = time.perf_counter()
    nearly = parameterisation.proposal(optimum)
    target = SamplingTarget(refined, optimum, parameterisation, nearly, evidence.trusted)
    if evidence.effective_samples < NEARLY_NORMAL * evidence.evaluations:
        progress(0.0, "searching for a proposal")
        linear = LinearParameterisation(refined)
        proposal = collapsed_proposal(refined, optimum, rng, effective_samples)
        if proposal is not None and effective_share(linear, proposal, rng) < WORTHLESS:
            proposal = None
        if proposal is not None:
            target = SamplingTarget(refined, optimum, linear, proposal, True)
        elif not evidence.trusted:
            simple = LogCholeskyParameterisation(refined)
            adapted = adapted_proposal(simple, optimum, rng)
            target = target if adapted is None else SamplingTarget(refined, optimum, simple, adapted, True)
    chosen: Sampler = Emcee(max_steps, file) if sampler is None else sampler
    drawn = chosen.sample(
        target, np.random.default_rng(walkers), effective_samples=effective_samples, progress=progress
    )
    chains = drawn if isinstance(drawn, Chains) else chains_of(refined, drawn, rng, effective_samples)
    return Identification(refined, optimum, evidence, chains, time.perf_counter() - began)
