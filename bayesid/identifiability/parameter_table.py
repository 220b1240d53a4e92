"""Table of what is known of each quantity: widths, correlations, a test of normality and, where that fails, a profile.

The normal approximation of each quantity's posterior is compared with draws from the posterior itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from bayesid._io.progress import Progress
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.identifiability.profile_interval import Profile, Target, profile
from bayesid.inference.body_quantities import (
    BODY_QUANTITIES,
    ContractionVerdict,
    bodies_of,
    quantities_at,
    quantity_slopes_at,
)
from bayesid.inference.ensemble import sample
from bayesid.inference.importance import choose_parameterisation, weighted_draws
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior

__all__ = [
    "Draws",
    "Method",
    "ParameterRow",
    "draw",
    "profiled",
    "quantity_of",
    "shape_errors",
    "tabulate",
    "weighted_quantile",
]

CORRELATED = 0.9  # absolute correlation above which the table names two quantities as confused with each other
# probabilities at which quantiles are compared, and the quantiles of a standard normal distribution there
LEVELS = {0.025: -1.959963984540054, 0.16: -0.994457883209753, 0.84: 0.994457883209753, 0.975: 1.959963984540054}
# largest difference between a quantile and the normal one at which a posterior counts as normal, in its sd
NORMAL = 0.3
# largest numbers of steps and of unknowns for emcee, which takes too long with many strongly correlated unknowns
STEPS, LARGEST = 2000, 40


@dataclass(frozen=True)
class ParameterRow:
    """What is known of one quantity."""

    #: name and unit of the quantity
    name: str
    unit: str
    #: mean, posterior and prior standard deviation of the normal approximation, in the unit
    mean: float
    sd: float
    prior_sd: float
    conditional_sd: float  #: posterior standard deviation if all other quantities of the bodies were known, in the unit
    #: names and correlations of the quantities most strongly correlated with this one, the strongest first
    correlated_with: tuple[tuple[str, float], ...]
    #: mean and standard deviation of the draws; None where the draws may not be trusted
    sampled: tuple[float, float] | None
    normal: bool | None  #: True where the posterior is nearly normal, None where that is not known
    profile: Profile | None = None  #: profile of the quantity, None where it was not computed

    @property
    def shrinkage(self) -> float:
        """One minus the ratio of posterior to prior standard deviation."""
        return 1.0 - self.sd / self.prior_sd

    @property
    def verdict(self) -> ContractionVerdict:
        """Verdict on how far the data contracted the prior of the quantity."""
        return ContractionVerdict.of(self.shrinkage)

    def to_dict(self) -> dict[str, Any]:
        """Return the row as it stands in identifiability.json."""
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


def tabulate(knowledge: Knowledge, draws: Draws) -> list[ParameterRow]:
    """Return the row of every quantity, without profiles.

    Parameters
    ----------
    knowledge : Knowledge
        Linearisation at the mode.
    draws : Draws
        Draws from the posterior.
    """
    errors, correlation, conditional = shape_errors(draws, knowledge), knowledge.correlation, knowledge.conditional_sd
    mean, sd = draws.mean, np.sqrt(np.diag(draws.covariance))
    units = list(BODY_QUANTITIES.values())
    rows = []
    for k, name in enumerate(knowledge.names):
        order = [i for i in np.argsort(-np.abs(correlation[k])) if i != k and abs(correlation[k, i]) > CORRELATED]
        rows.append(
            ParameterRow(
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
    return rows


def profiled(
    posterior: Posterior,
    optimum: Optimum,
    parameters: list[ParameterRow],
    draws: Draws,
    knowledge: Knowledge,
    most: int,
    progress: Progress,
) -> list[ParameterRow]:
    """Return the rows with profiles of at most ``most`` quantities, the least normal ones.

    Where the draws may not be trusted, the worst known of the learnt quantities are profiled.

    Parameters
    ----------
    posterior : Posterior
    optimum : Optimum
        Mode of the posterior.
    parameters : list of ParameterRow
        Rows of all quantities.
    draws : Draws
        Draws from the posterior.
    knowledge : Knowledge
        Linearisation at the mode.
    most : int
        Largest number of profiles.
    progress : Progress
        Receiver of the fraction done.
    """
    errors = shape_errors(draws, knowledge)
    if not draws.trusted:  # the profile of an unlearnt quantity is the prior
        told = np.array([row.verdict is not ContractionVerdict.NOT for row in parameters])
        errors = told - knowledge.shrinkage
    order = [int(k) for k in np.argsort(-errors) if not parameters[int(k)].normal][:most]
    result = list(parameters)
    for number, k in enumerate(order):
        progress(number / len(order), f"profile of {parameters[k].name}")
        curve = profile(
            posterior.least_squares, posterior.jacobian, optimum.z, optimum.covariance, quantity_of(posterior, k)
        )
        result[k] = ParameterRow(**{**vars(parameters[k]), "profile": curve})
    return result


def quantity_of(posterior: Posterior, index: int) -> Target:
    """Return one reported quantity of the bodies, by its index, as a function of the coordinates.

    Parameters
    ----------
    posterior : Posterior
    index : int
        Index of the quantity among those of all bodies.
    """
    unknowns = posterior.unknowns
    return Target(lambda z: float(quantities_at(unknowns, z)[index]), lambda z: quantity_slopes_at(unknowns, z)[index])


class Method(Enum):
    """Method that produced the draws."""

    IMPORTANCE = "importance sampling"
    ENSEMBLE = "emcee"


@dataclass(frozen=True)
class Draws:
    """Weighted draws of the bodies' quantities."""

    method: Method  #: method that produced the draws
    values: Floats  #: (m, n) draws of the n quantities, in their units
    weights: Floats  #: (m,) weights of the draws, whose sum is one
    #: True if Pareto k-hat (importance sampling), or R-hat and the number of effective samples (emcee), are good enough
    #: to use the draws
    trusted: bool
    pareto_k: float  #: Pareto k-hat of importance sampling, even where emcee produced the draws

    @property
    def covariance(self) -> Floats:
        """Covariance of the quantities, shape (n, n)."""
        away = self.values - self.weights @ self.values
        return np.einsum("i,ij,ik->jk", self.weights, away, away, optimize=True)

    @property
    def mean(self) -> Floats:
        """Mean of the quantities, shape (n,)."""
        return np.asarray(self.weights @ self.values)


def draw(
    posterior: Posterior, optimum: Optimum, seed: np.random.SeedSequence, effective_samples: float, progress: Progress
) -> Draws:
    """Draw from a posterior by importance sampling, or by emcee where that is not trusted and there are few unknowns.

    Parameters
    ----------
    posterior : Posterior
        Posterior to draw from.
    optimum : Optimum
        Mode of the posterior, with its normal approximation.
    seed : numpy.random.SeedSequence
        Source of all random numbers.
    effective_samples : float
        Number of effective samples at which emcee stops.
    progress : Progress
        Receiver of the fraction done.
    """
    weigh, walk = seed.spawn(2)
    rng = np.random.default_rng(weigh)
    parameterisation = choose_parameterisation(posterior, optimum, rng)
    weighted = weighted_draws(parameterisation, optimum, rng)
    if weighted.trusted or posterior.size > LARGEST:
        values = _quantities(posterior, weighted.z)
        return Draws(Method.IMPORTANCE, values, weighted.weights, weighted.trusted, weighted.pareto_k)

    chains = sample(
        parameterisation, optimum, walk, effective_samples=effective_samples, max_steps=STEPS, progress=progress
    )
    values = _quantities(posterior, chains.flat)
    weights = np.full(len(values), 1.0 / len(values))
    return Draws(Method.ENSEMBLE, values, weights, chains.converged, weighted.pareto_k)


def shape_errors(draws: Draws, knowledge: Knowledge) -> Floats:
    """Return the largest differences between quantiles of the draws and of the normal approximation.

    They are in standard deviations of the normal approximation, shape (n,).

    Parameters
    ----------
    draws : Draws
        Draws of the n quantities.
    knowledge : Knowledge
        Normal approximation of the same quantities.
    """
    errors = [
        np.abs((weighted_quantile(draws.values, draws.weights, level) - knowledge.values) / knowledge.sd - normal)
        for level, normal in LEVELS.items()
    ]
    return np.max(errors, axis=0)


def weighted_quantile(values: Floats, weights: Floats, level: float) -> Floats:
    """Return the quantiles (n,) of weighted draws (m, n) at a probability ``level``.

    Parameters
    ----------
    values : (m, n) array
    weights : (m,) array
        Weights whose sum is one.
    level : float
        Probability.
    """
    order = np.argsort(values, axis=0)
    below = np.cumsum(weights[order], axis=0) - 0.5 * weights[order]
    columns = range(values.shape[1])
    return np.array([np.interp(level, below[:, k], values[order[:, k], k]) for k in columns])


def _quantities(posterior: Posterior, z: Floats) -> Floats:
    return np.concatenate([body.values for body in bodies_of(posterior, z).values()], axis=1)
