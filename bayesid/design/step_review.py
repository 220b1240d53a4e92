"""Review of what a loop has flown: whether its model describes the recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["Review", "Reviewer"]


@dataclass(frozen=True)
class Review:
    """What the recordings so far say of the model.

    Attributes
    ----------
    status : str
        Status of the verdict, such as ``adequate`` or ``explained``.
    causes : tuple of str
        Causes that the verdict names.
    trusted : bool
        Whether the model may be right, so that it makes sense to identify it further.
    probabilities : mapping of str to float
        Probability of every cause of the catalogue, and of ``"unknown"``.
    """

    status: str
    causes: tuple[str, ...]
    trusted: bool
    probabilities: Mapping[str, float]

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of loop.json."""
        return {
            "status": self.status,
            "causes": list(self.causes),
            "trusted": self.trusted,
            "probabilities": dict(self.probabilities),
        }


class Reviewer(Protocol):
    """Method by which the recordings of a loop are reviewed."""

    def review(self, model: Model, manoeuvres: Sequence[Manoeuvre], seed: int, file: Path) -> Review:
        """Write what was found to a JSON file, and return its summary.

        Parameters
        ----------
        model : Model
            The loop's model with its first prior.
        manoeuvres : sequence of Manoeuvre
            All manoeuvres flown so far.
        seed : int
        file : Path
        """
        ...
