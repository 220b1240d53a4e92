"""What to measure or to move so that the worst known becomes known: candidates, ranked by what they would tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid.identifiability.added_information import AddedMeasurement, NotEvaluated
from bayesid.identifiability.directions import Direction
from bayesid.identifiability.hypothetical_experiment import InformationPredictor
from bayesid.identifiability.local_knowledge import Knowledge

__all__ = ["WORST", "Advice", "advise"]

WORST = 3
"""Directions, from the worst, of which the advice speaks."""


@dataclass(frozen=True)
class Advice:
    """What a candidate would tell.

    Attributes
    ----------
    name, text : str
        Of the candidate.
    directions : tuple of float
        Standard deviations of the presently worst directions over those of the prior.
    parameter : str
        The presently worst known quantity.
    sd : float
        Its standard deviation, in its unit.
    shrinkage : float
        Of that quantity.
    information : float
        Gained on all quantities beyond what is known now [nats].
    reason : str
        Why it was not evaluated; empty if it was.
    """

    name: str
    text: str
    directions: tuple[float, ...] = ()
    parameter: str = ""
    sd: float = np.nan
    shrinkage: float = np.nan
    information: float = np.nan
    reason: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Form in JSON."""
        if self.reason:
            return {"name": self.name, "text": self.text, "evaluated": False, "reason": self.reason}
        return {
            "name": self.name,
            "text": self.text,
            "evaluated": True,
            "worst_directions": list(self.directions),
            "worst_parameter": {"name": self.parameter, "sd": self.sd, "shrinkage": self.shrinkage},
            "information": self.information,
        }


def advise(
    predictor: InformationPredictor,
    candidates: Sequence[AddedMeasurement],
    worst: Sequence[Direction],
    now: Knowledge,
    progress: Progress,
) -> list[Advice]:
    """Evaluate candidates at the point of the predictor, the most telling of the worst direction first.

    Parameters
    ----------
    worst : sequence of Direction
        As known now, the worst first.
    now : Knowledge
    """
    found = []
    for number, candidate in enumerate(candidates):
        progress(number / len(candidates), candidate.text)
        try:
            known = predictor.knowledge(candidate.change(predictor.flown))
        except (NotEvaluated, InputError) as error:
            found.append(Advice(candidate.name, candidate.text, reason=str(error)))
            continue
        found.append(_of(candidate, known, worst, now))
    return sorted(found, key=lambda item: (bool(item.reason), item.directions[:1], -item.information))


def _of(candidate: AddedMeasurement, known: Knowledge, worst: Sequence[Direction], now: Knowledge) -> Advice:
    index = int(np.argmin(now.shrinkage))
    ratios = tuple(float(np.linalg.norm(item.weights @ known.factor)) / item.prior_sd for item in worst[:WORST])
    return Advice(
        name=candidate.name,
        text=candidate.text,
        directions=ratios,
        parameter=known.names[index],
        sd=float(known.sd[index]),
        shrinkage=float(known.shrinkage[index]),
        information=_half_log_det(now) - _half_log_det(known),
    )


def _half_log_det(knowledge: Knowledge) -> float:
    """Half the logarithm of the determinant of the covariance, relative to that of the prior."""
    own = np.linalg.solve(knowledge.prior_factor, knowledge.factor)
    return float(np.log(np.linalg.svd(own, compute_uv=False)).sum())
