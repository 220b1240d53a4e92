"""Diagnosis of what a loop has flown, so that a wrong model is not identified to ever more digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bayesid._io.files import write_json
from bayesid.design.loop_goals import Review
from bayesid.diagnosis.diagnose import diagnose
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["DiagnosisReview"]


@dataclass(frozen=True)
class DiagnosisReview:
    """Reviewer of a loop that diagnoses all its recordings together.

    Parameters
    ----------
    bounds : mapping of str to sequence of PhysicalBound
        Largest sizes that replace those of the catalogue, by the candidates' labels.
    prior : CausePrior
        Prior of the number of causes, and of something outside the catalogue.
    knows_latitude : bool
        Whether the manoeuvres' argument of latitude is known.
    settings : DiagnosisSettings
        Thresholds of the decisions.
    """

    bounds: Mapping[str, Sequence[PhysicalBound]] = field(default_factory=dict)
    prior: CausePrior = CausePrior()  # noqa: RUF009  (immutable)
    knows_latitude: bool = False
    settings: DiagnosisSettings = DEFAULT_SETTINGS

    def review(self, model: Model, manoeuvres: Sequence[Manoeuvre], seed: int, file: Path) -> Review:
        """Diagnose, write the content of diagnosis.json to a file, and return its summary.

        Parameters
        ----------
        model : Model
        manoeuvres : sequence of Manoeuvre
            All that the loop has flown.
        seed : int
        file : Path
        """
        result = diagnose(
            model,
            manoeuvres,
            seed,
            bounds=self.bounds,
            prior=self.prior,
            settings=self.settings,
            knows_latitude=self.knows_latitude,
        )
        write_json(file, result.to_dict())
        probabilities = result.probabilities
        return Review(
            result.verdict.status.value,
            tuple(result.verdict.causes),
            result.alarm.silent or probabilities.nothing >= self.settings.trusted_from,
            {**probabilities.inclusion, "unknown": probabilities.unknown},
            result.remainder.verdict.value,
        )
