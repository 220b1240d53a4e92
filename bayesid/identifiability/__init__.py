"""Identifiability: what the robot's structure allows, and what a study's manoeuvres, sensors and priors allow."""

from bayesid.identifiability.base_parameters import BaseParameters, base_parameters, standard_names
from bayesid.identifiability.mass_scale import Determined, consistent_accelerations, determined, rates_at_rest
from bayesid.identifiability.stacked_regressor import Base

__all__ = [
    "Base",
    "BaseParameters",
    "Determined",
    "base_parameters",
    "consistent_accelerations",
    "determined",
    "rates_at_rest",
    "standard_names",
]
