"""A state of the noise with all sets of causes weighed under it."""

from __future__ import annotations

from dataclasses import dataclass

from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.noise.noise_states import FaultyFit, NoiseState
from bayesid.diagnosis.response.perturbed_model import Fit

__all__ = ["WeighedState"]


@dataclass(frozen=True)
class WeighedState:
    """A state of the noise with the probabilities of all sets of causes under it.

    Attributes
    ----------
    start : FaultyFit
        Without causes.
    state : NoiseState
        Linearised where the best set holds.
    found : SetProbabilities
    best : Fit
        Of the most probable set that names all of its causes.
    """

    start: FaultyFit
    state: NoiseState
    found: SetProbabilities
    best: Fit

    @property
    def highest(self) -> float:
        """Log evidence of the best explanation."""
        return self.state.log_nothing + max(item.log_evidence for item in self.found.sets)
