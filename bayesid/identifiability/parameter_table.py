"""Table of what is known of each quantity: widths, correlations and, where it is not normal, a profile."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._io.progress import Progress
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.identifiability.normality import NORMAL, Draws, shape_errors
from bayesid.identifiability.profile_interval import Profile, Target, profile
from bayesid.inference.body_quantities import BODY_QUANTITIES, quantities_at, quantity_slopes_at
from bayesid.inference.contraction import ContractionVerdict
from bayesid.inference.mode import Optimum
from bayesid.inference.posterior import Posterior

__all__ = ["ParameterRow", "profiled", "quantity_of", "tabulate"]

CORRELATED = 0.9  # absolute correlation above which the table names two quantities as confused with each other


@dataclass(frozen=True)
class ParameterRow:
    """What is known of one quantity.

    Attributes
    ----------
    name, unit : str
        Name and unit of the quantity.
    mean, sd, prior_sd : float
        Mean, posterior and prior standard deviation of the normal approximation, in the unit.
    conditional_sd : float
        Posterior standard deviation if all other quantities of the bodies were known, in the unit.
    correlated_with : tuple of (str, float)
        Names and correlations of the quantities most strongly correlated with this one, the strongest first.
    sampled : (float, float) or None
        Mean and standard deviation of the draws; None where the draws may not be trusted.
    normal : bool or None
        True where the posterior is nearly normal, None where that is not known.
    profile : Profile or None
        Profile of the quantity, None where it was not computed.
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
    """Return the row of every quantity, without profiles."""
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
    """
    errors = shape_errors(draws, knowledge)
    if not draws.trusted:  # the profile of an unlearnt quantity is the prior
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
    """Return one reported quantity of the bodies, by its index, as a function of the coordinates."""
    unknowns = posterior.unknowns
    return Target(lambda z: float(quantities_at(unknowns, z)[index]), lambda z: quantity_slopes_at(unknowns, z)[index])
