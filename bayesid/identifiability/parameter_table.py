"""What is known of each quantity: widths, what it is confused with and, where it is not normal, a profile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from bayesid._io.progress import Progress
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.identifiability.normality import NORMAL, Draws, shape_errors
from bayesid.identifiability.profile_interval import Profile, Target, profile
from bayesid.inference.body_quantities import BODY_QUANTITIES, quantities_of
from bayesid.inference.contraction import ContractionVerdict
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior

__all__ = ["ParameterRow", "profiled", "quantity_of", "tabulate"]

CORRELATED = 0.9
"""Correlation from which on a quantity is named as one that another is confused with."""


@dataclass(frozen=True)
class ParameterRow:
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
    def verdict(self) -> ContractionVerdict:
        """Whether the data told of it."""
        return ContractionVerdict.of(self.shrinkage)

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


def tabulate(knowledge: Knowledge, draws: Draws) -> list[ParameterRow]:
    """Return what is known of every quantity, not profiled yet."""
    errors, correlation, conditional = shape_errors(draws, knowledge), knowledge.correlation, knowledge.conditional_sd
    mean, sd = draws.mean, np.sqrt(np.diag(draws.covariance))
    units = list(BODY_QUANTITIES.values())
    found = []
    for k, name in enumerate(knowledge.names):
        order = [i for i in np.argsort(-np.abs(correlation[k])) if i != k and abs(correlation[k, i]) > CORRELATED]
        found.append(
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
    return found


def profiled(
    posterior: Posterior,
    optimum: Optimum,
    parameters: list[ParameterRow],
    draws: Draws,
    knowledge: Knowledge,
    most: int,
    progress: Progress,
) -> list[ParameterRow]:
    """Profile the least normal quantities; where draws do not tell, the worst known of which something was learnt."""
    errors = shape_errors(draws, knowledge)
    if not draws.trusted:  # the profile of what was not learnt is the prior
        told = np.array([item.verdict is not ContractionVerdict.NOT for item in parameters])
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
    """Return one reported quantity of the bodies as a function of the coordinates."""
    quantities = quantities_of(posterior.unknowns)
    value = jax.jit(lambda z: quantities(z)[index])
    gradient = jax.jit(jax.grad(value))
    return Target(lambda z: float(value(z)), lambda z: np.asarray(gradient(z)))
