"""Practical identifiability: what the manoeuvres, sensors and priors of a study tell of its bodies."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from bayesid._io.progress import Progress, part_of, silent
from bayesid.identifiability.advice import Advice, advise, candidates
from bayesid.identifiability.directions import Direction, covers_all, describe, directions
from bayesid.identifiability.hypothetical_experiment import InformationPredictor
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.identifiability.parameter_table import Draws, ParameterRow, draw, profiled, tabulate
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior

__all__ = ["Basis", "Practical", "practical"]


class Basis(Enum):
    """Basis of the statements: a fit to recorded data, or a prediction before the flight."""

    FIT = "fit"
    PREDICTION = "prediction"


@dataclass(frozen=True)
class Practical:
    """Result of `practical`."""

    basis: Basis  #: basis of the statements
    posterior: Posterior  #: posterior that was examined
    optimum: Optimum  #: mode of the posterior
    knowledge: Knowledge  #: posterior and prior knowledge, linearised at the mode
    directions: tuple[Direction, ...]  #: directions from the worst known to the best
    words: tuple[str, ...]  #: description of each direction
    parameters: tuple[ParameterRow, ...]  #: table of what is known of each quantity
    draws: Draws  #: draws from the posterior
    advice: tuple[Advice, ...]  #: advice on what to measure, the most informative first

    def to_dict(self) -> dict[str, Any]:
        """Return the entries of identifiability.json that concern the posterior."""
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
            "advice": [advice.to_dict() for advice in self.advice],
        }


def practical(
    posterior: Posterior,
    optimum: Optimum,
    basis: Basis,
    seed: int,
    *,
    effective_samples: float = 500.0,
    profiles: int = 6,
    progress: Progress = silent,
) -> Practical:
    """Determine what a posterior knows of its bodies, and which further measurements would tell more.

    Parameters
    ----------
    posterior : Posterior
        Posterior with at least one body to identify and with its noise linearised at the mode.
    optimum : Optimum
        Mode of the posterior.
    basis : Basis
        Basis of the statements.
    seed : int
        Seed of all random numbers.
    effective_samples : float
        Number of effective samples at which emcee stops, where importance sampling may not be trusted.
    profiles : int
        Largest number of quantities to profile, the least normal first.
    progress : Progress
        Receiver of the fraction done.
    """
    knowledge = Knowledge.at(posterior, optimum.z)
    ordered = tuple(directions(knowledge))
    whole = covers_all(posterior)
    words = tuple(describe(one, knowledge.values, knowledge.prior_sd, whole) for one in ordered)
    draws = draw(posterior, optimum, np.random.SeedSequence(seed), effective_samples, part_of(progress, 0.1, 0.4))
    parameters = tabulate(knowledge, draws)
    parameters = profiled(posterior, optimum, parameters, draws, knowledge, profiles, part_of(progress, 0.4, 0.6))
    predictor = InformationPredictor(posterior.model, posterior.manoeuvres, optimum.z, posterior.step)
    advice = advise(predictor, candidates(posterior.model), ordered, knowledge, part_of(progress, 0.6, 1.0))
    return Practical(basis, posterior, optimum, knowledge, ordered, words, tuple(parameters), draws, tuple(advice))
