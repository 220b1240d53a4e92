"""A hypothesis: the present model with some causes added, fitted."""

from __future__ import annotations

from dataclasses import dataclass

from bayesid.diagnosis.noise.noise_faults import NoiseFault
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel

__all__ = ["Hypothesis"]


@dataclass(frozen=True)
class Hypothesis:
    """The present model with some causes added, fitted.

    Attributes
    ----------
    perturbed : PerturbedModel
        Whose noise has the faults.
    fit : Fit
    faults : tuple of NoiseFault
    """

    perturbed: PerturbedModel
    fit: Fit
    faults: tuple[NoiseFault, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of its causes."""
        released = ("initial-rate",) if len(self.fit.released) else ()
        return (*(effect.candidate for effect in self.fit.effects), *released, *(fault.label for fault in self.faults))
