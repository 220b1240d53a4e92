"""What can be identified: by the structure of the robot, and by a study's manoeuvres, sensors and priors."""

from bayesid.identifiability.base_parameters import BaseParameters, base_parameters, standard_names
from bayesid.identifiability.equations import Base
from bayesid.identifiability.scale import Determined, consistent_accelerations, determined, rates_at_rest

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
