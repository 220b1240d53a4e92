"""Practical identifiability: what manoeuvres, sensors and priors of a study tell of its bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

import jax
import numpy as np

from bayesid.identifiability.advice import Advice, advise
from bayesid.identifiability.candidates import candidates
from bayesid.identifiability.directions import Direction, directions
from bayesid.identifiability.experiment import Predictor
from bayesid.identifiability.knowledge import Knowledge
from bayesid.identifiability.normality import NORMAL, Draws, draw, shape_errors
from bayesid.identifiability.profile import Profile, Target, profile
from bayesid.identifiability.words import describe
from bayesid.inference.identification import BODY_QUANTITIES, quantities_of
from bayesid.inference.learnt import Verdict
from bayesid.inference.optimum import Optimum
from bayesid.posterior import Posterior

__all__ = ["Basis", "Parameter", "Practical", "covers_all", "practical"]

CORRELATED = 0.9
"""Correlation from which on a quantity is named as one that another is confused with."""

Show = Callable[[float, str], None]


class Basis(Enum):
    """What a statement rests on."""

    FIT = "fit"
    PREDICTION = "prediction"


@dataclass(frozen=True)
class Parameter:
    """What is known of one quantity.

    Attributes
    ----------
    name, unit : str
    mean, sd, prior_sd : float
        Of the normal approximation.
    conditional_sd : float
        If all other quantities of the bodies were known.
    correlated_with : tuple of (str, float)
        Quantities with which it is confused, and the correlation, the strongest first.
    sampled : (float, float) or None
        Mean and sd of draws; None where draws may not be trusted.
    normal : bool or None
        Whether the posterior is normal; None where that is not known.
    profile : Profile or None
        Where the posterior is not normal and the profile was asked for.
    """

    name: str
    unit: str
    mean: float
    sd: float
    prior_sd: float
    conditional_sd: float
    correlated_with: tuple[tuple[str, float], ...]
    sampled: tuple[float, float] | None
    normal: bool | None
    profile: Profile | None = None

    @property
    def shrinkage(self) -> float:
        """One minus the ratio of posterior to prior standard deviation."""
        return 1.0 - self.sd / self.prior_sd

    @property
    def verdict(self) -> Verdict:
        """Whether the data told of it."""
        return Verdict.of(self.shrinkage)

    def to_dict(self) -> dict[str, Any]:
        """Form in JSON."""
        interval: Any = None if self.normal else "not evaluated"
        return {
            "name": self.name,
            "mean": self.mean,
            "sd": self.sd,
            "unit": self.unit,
            "prior_sd": self.prior_sd,
            "conditional_sd": self.conditional_sd,
            "shrinkage": self.shrinkage,
            "verdict": self.verdict.value,
            "correlated_with": dict(self.correlated_with),
            "sampled": None if self.sampled is None else dict(zip(("mean", "sd"), self.sampled, strict=True)),
            "gaussian": self.normal,
            "profile": interval if self.profile is None else self.profile.to_dict(),
        }


@dataclass(frozen=True)
class Practical:
    """Result of `practical`.

    Attributes
    ----------
    basis : Basis
    posterior : Posterior
    optimum : Optimum
    knowledge : Knowledge
    directions : tuple of Direction
        From the worst known to the best.
    words : tuple of str
        Of each direction.
    parameters : tuple of Parameter
    draws : Draws
    advice : tuple of Advice
        The most telling first.
    """

    basis: Basis
    posterior: Posterior
    optimum: Optimum
    knowledge: Knowledge
    directions: tuple[Direction, ...]
    words: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    draws: Draws
    advice: tuple[Advice, ...]

    def to_dict(self) -> dict[str, Any]:
        """Keys of identifiability.json that are about the posterior."""
        spread = self.draws.covariance if self.draws.trusted else None
        return {
            "basis": self.basis.value,
            "directions": [
                {
                    **direction.to_dict(),
                    "sampled_sd": None
                    if spread is None
                    else float(np.sqrt(direction.weights @ spread @ direction.weights)),
                    "words": words,
                }
                for direction, words in zip(self.directions, self.words, strict=True)
            ],
            "parameters": [parameter.to_dict() for parameter in self.parameters],
            "covariance": {"names": list(self.knowledge.names), "matrix": self.knowledge.covariance.tolist()},
            "prior_covariance": {
                "names": list(self.knowledge.names),
                "matrix": self.knowledge.prior_covariance.tolist(),
            },
            "draws": {
                "method": self.draws.method.value,
                "trusted": self.draws.trusted,
                "pareto_k": self.draws.pareto_k,
            },
            "advice": [item.to_dict() for item in self.advice],
        }


def practical(
    posterior: Posterior,
    optimum: Optimum,
    basis: Basis,
    seed: int,
    *,
    effective_samples: float = 500.0,
    profiles: int = 6,
    progress: Show = lambda _fraction, _text: None,
) -> Practical:
    """Say what a posterior knows of its bodies, and what would tell more.

    Parameters
    ----------
    posterior : Posterior
        With at least one body to identify; its noise linearised at the mode.
    optimum : Optimum
    seed : int
        Every random number follows from it.
    effective_samples : float
        Wanted of emcee where importance sampling may not be trusted.
    profiles : int
        Quantities that are profiled at most, the least normal first.
    """
    knowledge = Knowledge.at(posterior, optimum.z)
    found = tuple(directions(knowledge))
    whole = covers_all(posterior)
    words = tuple(describe(item, knowledge.values, knowledge.prior_sd, whole) for item in found)
    draws = draw(posterior, optimum, np.random.SeedSequence(seed), effective_samples, _part(progress, 0.1, 0.4))
    parameters = _parameters(knowledge, draws)
    parameters = _profiled(posterior, optimum, parameters, draws, knowledge, profiles, _part(progress, 0.4, 0.6))
    predictor = Predictor(posterior.model, posterior.manoeuvres, optimum.z, posterior.step)
    advice = advise(predictor, candidates(posterior.model), found, knowledge, _part(progress, 0.6, 1.0))
    return Practical(basis, posterior, optimum, knowledge, found, words, tuple(parameters), draws, tuple(advice))


def covers_all(posterior: Posterior) -> bool:
    """Whether every body of the robot that has mass is to be identified."""
    named = {body.name for body in posterior.model.bodies}
    return {name for name, link in posterior.model.robot.links.items() if link.inertial.mass > 0.0} <= named


def _parameters(knowledge: Knowledge, draws: Draws) -> list[Parameter]:
    errors, correlation, conditional = shape_errors(draws, knowledge), knowledge.correlation, knowledge.conditional_sd
    mean, sd = draws.mean, np.sqrt(np.diag(draws.covariance))
    units = list(BODY_QUANTITIES.values())
    found = []
    for k, name in enumerate(knowledge.names):
        order = [i for i in np.argsort(-np.abs(correlation[k])) if i != k and abs(correlation[k, i]) > CORRELATED]
        found.append(
            Parameter(
                name=name,
                unit=units[k % len(units)],
                mean=float(knowledge.values[k]),
                sd=float(knowledge.sd[k]),
                prior_sd=float(knowledge.prior_sd[k]),
                conditional_sd=float(conditional[k]),
                correlated_with=tuple((knowledge.names[i], float(correlation[k, i])) for i in order[:3]),
                sampled=(float(mean[k]), float(sd[k])) if draws.trusted else None,
                normal=bool(errors[k] <= NORMAL) if draws.trusted else None,
            )
        )
    return found


def _profiled(
    posterior: Posterior,
    optimum: Optimum,
    parameters: list[Parameter],
    draws: Draws,
    knowledge: Knowledge,
    most: int,
    progress: Show,
) -> list[Parameter]:
    """Profile the least normal quantities; where draws do not tell, the worst known of which something was learnt."""
    errors = shape_errors(draws, knowledge)
    if not draws.trusted:  # the profile of what was not learnt is the prior
        told = np.array([item.verdict is not Verdict.NOT for item in parameters])
        errors = told - knowledge.shrinkage
    order = [int(k) for k in np.argsort(-errors) if not parameters[int(k)].normal][:most]
    result = list(parameters)
    for number, k in enumerate(order):
        progress(number / len(order), f"profile of {parameters[k].name}")
        curve = profile(
            posterior.least_squares, posterior.jacobian, optimum.z, optimum.covariance, quantity_of(posterior, k)
        )
        result[k] = Parameter(**{**vars(parameters[k]), "profile": curve})
    return result


def quantity_of(posterior: Posterior, index: int) -> Target:
    """Return one reported quantity of the bodies as a function of the coordinates."""
    quantities = quantities_of(posterior.unknowns)
    value = jax.jit(lambda z: quantities(z)[index])
    gradient = jax.jit(jax.grad(value))
    return Target(lambda z: float(value(z)), lambda z: np.asarray(gradient(z)))


def _part(progress: Show, start: float, end: float) -> Show:
    return lambda fraction, text: progress(start + (end - start) * fraction, text)
