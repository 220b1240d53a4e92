"""Inertial parameters of the identified bodies: as given, fitted without the named causes, fitted with them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid.diagnosis import Diagnosis
from bayesid.inference.body_quantities import BODY_QUANTITIES, bodies_of
from bayesid.inference.contraction import half_range
from bayesid.robot.inertial_parameters import mass_com_inertia

__all__ = ["ParameterChange", "parameter_changes"]

PRIOR_DRAWS = 2000
"""Number of draws from which the width of the prior follows."""


class ParameterChange(NamedTuple):
    """One inertial parameter.

    Attributes
    ----------
    name, unit : str
    given, prior_sd : float
        Value in the study's files, and half the central 68 % of its prior.
    without, without_sd : float
        Fitted with the present model.
    fitted, fitted_sd : float
        Fitted with the named causes.
    shift : float
        From the one fit to the other, in the standard deviations of the first.
    """

    name: str
    unit: str
    given: float
    prior_sd: float
    without: float
    without_sd: float
    fitted: float
    fitted_sd: float
    shift: float


def parameter_changes(result: Diagnosis, seed: int = 0) -> list[ParameterChange]:
    """Return all inertial parameters of the identified bodies.

    Parameters
    ----------
    result : Diagnosis
    seed : int
        Seed of the draws from the prior.
    """
    posterior = result.before.fit.posterior
    if not result.gain.before.bodies.names:
        return []
    z = np.random.default_rng(seed).normal(size=(PRIOR_DRAWS, posterior.size))
    widths = np.concatenate([half_range(body.values) for body in bodies_of(posterior, z).values()])
    given = np.concatenate([mass_com_inertia(prior.centre.vector) for prior in posterior.model.bodies])
    before, after = result.gain.before.bodies, result.gain.after.bodies
    units = list(BODY_QUANTITIES.values())
    return [
        ParameterChange(
            name,
            units[index % len(units)],
            float(given[index]),
            float(widths[index]),
            float(before.mean[index]),
            float(before.sd[index]),
            float(after.mean[index]),
            float(after.sd[index]),
            float(result.gain.shift[index]),
        )
        for index, name in enumerate(before.names)
    ]
