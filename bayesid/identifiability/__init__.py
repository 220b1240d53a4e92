"""What recordings can tell at all: which combinations of the inertial parameters, and when their scale."""

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
