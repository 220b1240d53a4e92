"""Largest size that is physically plausible of an effect's amplitudes.

A diagnosis gives all amplitudes of an effect that share a unit one scale, log-uniform between this bound and what the
data can resolve. The bound limits that scale, not each amplitude. Where it is generous by a factor of two, the evidence
loses less than a tenth of a nat over four decades; where it is too narrow, a cause is missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._io.errors import InputError
from bayesid.simulation.effects.effect_parameters import Parameter

__all__ = ["PhysicalBound", "bounds_of_priors", "three_digits"]

SPREADS = 3.0
"""Prior standard deviations at which the largest size lies where no physical bound is known."""


@dataclass(frozen=True)
class PhysicalBound:
    """Largest plausible size of the amplitudes of one unit.

    Parameters
    ----------
    unit : str
        Unit of the amplitudes.
    largest : float
        Largest plausible magnitude, in that unit.
    reason : str
        One sentence on why no more is plausible.

    Raises
    ------
    InputError
        If the size is not a positive number or the reason is empty.
    """

    unit: str
    largest: float
    reason: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "largest", float(self.largest))
        if not 0.0 < self.largest < np.inf:
            raise InputError(
                f"the largest size {self.largest:g} {self.unit} is not a positive number",
                remedy="Give the largest plausible magnitude",
            )
        if not self.reason:
            raise InputError(
                f"the largest size {self.largest:g} {self.unit} has no reason",
                remedy="Say in one sentence why no more is plausible",
            )


def three_digits(value: float) -> str:
    """Return a number with three digits for a reason, such as ``2790``."""
    return f"{float(f'{value:.3g}'):g}"


def bounds_of_priors(parameters: Sequence[Parameter]) -> tuple[PhysicalBound, ...]:
    """Return the sizes of amplitudes at three standard deviations of their priors, one bound for each unit."""
    bounds = []
    for unit in dict.fromkeys(parameter.unit for parameter in parameters):
        group = [parameter for parameter in parameters if parameter.unit == unit]
        ends = [float(abs(parameter.value(np.array([-SPREADS, SPREADS]))).max()) for parameter in group]
        reason = f"No physical bound is stated; this is the size at {SPREADS:g} standard deviations of the prior."
        bounds.append(PhysicalBound(unit, max(ends), reason))
    return tuple(bounds)
