"""Whether the normal approximation describes the posterior of each quantity, by draws of the posterior itself."""

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

LEVELS = {0.025: -1.959963984540054, 0.16: -0.994457883209753, 0.84: 0.994457883209753, 0.975: 1.959963984540054}
"""Quantiles compared, and where a standard normal distribution has them."""

NORMAL = 0.3
"""Largest difference of a quantile from the normal one that passes for normal, in standard deviations."""

STEPS, LARGEST = 2000, 40
"""Of the ensembles where importance sampling may not be trusted: most steps, and most unknowns.

With more unknowns tied together sharply, ensembles need more time than the question is worth.
"""


class Method(Enum):
    """Where draws come from."""

    IMPORTANCE = "importance sampling"
    ENSEMBLE = "emcee"


@dataclass(frozen=True)
class Draws:
    """Weighted draws of the bodies' quantities.

    Attributes
    ----------
    method : Method
    values : (m, n) array
    weights : (m,) array
        Of sum one.
    trusted : bool
        Whether Pareto k-hat (importance sampling) or R-hat and the number of effective samples (emcee) allow their use.
    pareto_k : float
        Of importance sampling, whether it was used or not.
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
    """Draw from a posterior: by importance sampling, or by emcee where that may not be trusted and can be afforded."""
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
    """Return how far the draws' quantiles are from those of the normal approximation at most, in its sd, shape (n,)."""
    errors = [
        np.abs((weighted_quantile(draws.values, draws.weights, level) - knowledge.values) / knowledge.sd - normal)
        for level, normal in LEVELS.items()
    ]
    return np.max(errors, axis=0)


def weighted_quantile(values: Floats, weights: Floats, level: float) -> Floats:
    """Quantile of weighted draws (m, n), shape (n,)."""
    order = np.argsort(values, axis=0)
    below = np.cumsum(weights[order], axis=0) - 0.5 * weights[order]
    columns = range(values.shape[1])
    return np.array([np.interp(level, below[:, k], values[order[:, k], k]) for k in columns])


def _quantities(posterior: Posterior, z: Floats) -> Floats:
    return np.concatenate([body.values for body in bodies_of(posterior, z).values()], axis=1)
