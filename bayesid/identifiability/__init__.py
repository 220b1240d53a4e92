"""What recordings can tell at all: which combinations of the inertial parameters, and when their scale."""

from bayesid.identifiability.base_parameters import BaseParameters, base_parameters, standard_names
from bayesid.identifiability.equations import Base

__all__ = [
    "Base",
    "BaseParameters",
    "Determined",
    "base_parameters",
    "consistent_states",
    "determined",
    "standard_names",
]
