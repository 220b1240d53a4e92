"""Advice on what to measure or to move next: candidates, ranked by what they would tell of the worst directions."""

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
"""Number of directions, from the worst known, that the advice evaluates."""


@dataclass(frozen=True)
class Advice:
    """Predicted effect of one candidate.

    Attributes
    ----------
    name, text : str
        Name and description of the candidate.
    directions : tuple of float
        Ratios of posterior to prior standard deviation in the presently worst directions.
    parameter : str
        Name of the presently worst known quantity.
    sd : float
        Standard deviation that the quantity would have, in its unit.
    shrinkage : float
        Shrinkage that the quantity would have, one minus the ratio of posterior to prior standard deviation.
    information : float
        Information gained on all quantities beyond what is known now [nats].
    reason : str
        Reason why the candidate was not evaluated; empty if it was.
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
        """Return the advice as it stands in identifiability.json."""
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
    """Evaluate candidates at the predictor's linearisation point, and return the most informative first.

    Candidates are ranked by the predicted width of the presently worst direction, then by the information gained.

    Parameters
    ----------
    predictor : InformationPredictor
        Predictor of what an experiment tells.
    candidates : sequence of AddedMeasurement
        Candidates to evaluate, each alone.
    worst : sequence of Direction
        Directions as known now, the worst first.
    now : Knowledge
        Present knowledge of the bodies' quantities.
    progress : Progress
        Receiver of the fraction done.
    """
    advice = []
    for number, candidate in enumerate(candidates):
        progress(number / len(candidates), candidate.text)
        try:
            known = predictor.knowledge(candidate.change(predictor.flown))
        except (NotEvaluated, InputError) as error:
            advice.append(Advice(candidate.name, candidate.text, reason=str(error)))
            continue
        advice.append(_of(candidate, known, worst, now))
    return sorted(advice, key=lambda item: (bool(item.reason), item.directions[:1], -item.information))


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
    """Return half the logarithm of the determinant of the covariance relative to that of the prior."""
    relative = np.linalg.solve(knowledge.prior_factor, knowledge.factor)
    return float(np.log(np.linalg.svd(relative, compute_uv=False)).sum())
