"""What can be identified: by the structure of the robot, and by a study's manoeuvres, sensors and priors."""

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
