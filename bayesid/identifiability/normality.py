"""Test of the normal approximation of each quantity's posterior against draws from the posterior itself."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from bayesid._io.progress import Progress
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.body_quantities import bodies_of
from bayesid.inference.ensemble import sample
from bayesid.inference.importance import choose_parameterisation, weighted_draws
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior

__all__ = ["Draws", "Method", "draw", "shape_errors", "weighted_quantile"]

# probabilities at which quantiles are compared, and the quantiles of a standard normal distribution there
LEVELS = {0.025: -1.959963984540054, 0.16: -0.994457883209753, 0.84: 0.994457883209753, 0.975: 1.959963984540054}
# largest difference between a quantile and the normal one at which a posterior counts as normal, in its sd
NORMAL = 0.3
# largest numbers of steps and of unknowns for emcee, which takes too long with many strongly correlated unknowns
STEPS, LARGEST = 2000, 40


class Method(Enum):
    """Method that produced the draws."""

    IMPORTANCE = "importance sampling"
    ENSEMBLE = "emcee"


@dataclass(frozen=True)
class Draws:
    """Weighted draws of the bodies' quantities.

    Attributes
    ----------
    method : Method
        Method that produced the draws.
    values : (m, n) array
        Draws of the n quantities, in their units.
    weights : (m,) array
        Weights of the draws, whose sum is one.
    trusted : bool
        True if Pareto k-hat (importance sampling), or R-hat and the number of effective samples (emcee), are good
        enough to use the draws.
    pareto_k : float
        Pareto k-hat of importance sampling, even where emcee produced the draws.
    """

    method: Method
    values: Floats
    weights: Floats
    trusted: bool
    pareto_k: float

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
    posterior: Posterior,
    optimum: Optimum,
    seed: np.random.SeedSequence,
    effective_samples: float,
    progress: Progress,
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
    """
    errors = [
        np.abs((weighted_quantile(draws.values, draws.weights, level) - knowledge.values) / knowledge.sd - normal)
        for level, normal in LEVELS.items()
    ]
    return np.max(errors, axis=0)


def weighted_quantile(values: Floats, weights: Floats, level: float) -> Floats:
    """Return the quantiles (n,) of weighted draws (m, n) at a probability ``level``."""
    order = np.argsort(values, axis=0)
    below = np.cumsum(weights[order], axis=0) - 0.5 * weights[order]
    columns = range(values.shape[1])
    return np.array([np.interp(level, below[:, k], values[order[:, k], k]) for k in columns])


def _quantities(posterior: Posterior, z: Floats) -> Floats:
    return np.concatenate([body.values for body in bodies_of(posterior, z).values()], axis=1)
