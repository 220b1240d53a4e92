"""What the simulation gets wrong: candidates, their signatures, the probability of every set of causes, the gain.

Names are loaded on first use (PEP 562), so that the evidence of a Gram can be used without loading the simulation.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bayesid.diagnosis.candidates.cause_kind import candidates
    from bayesid.diagnosis.diagnose import diagnose, identify_extended
    from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities
    from bayesid.diagnosis.evidence.verdict import ProbableVerdict, Remainder, Rest, Status
    from bayesid.diagnosis.loop_review import DiagnosisReview
    from bayesid.diagnosis.outcome.candidate_table import Candidate
    from bayesid.diagnosis.outcome.disturbance import DisturbingWrench, Frame
    from bayesid.diagnosis.outcome.gain import Gain
    from bayesid.diagnosis.outcome.torque_reading import TorqueCause, TorqueReading, TorquesNotRead
    from bayesid.diagnosis.result import Diagnosis
    from bayesid.diagnosis.search.fitted_set import Hypothesis
    from bayesid.diagnosis.settings import DiagnosisSettings

__all__ = [
    "Candidate",
    "CausePrior",
    "CauseSet",
    "Diagnosis",
    "DiagnosisReview",
    "DiagnosisSettings",
    "DisturbingWrench",
    "Frame",
    "Gain",
    "Hypothesis",
    "ProbableVerdict",
    "Remainder",
    "Rest",
    "SetProbabilities",
    "Status",
    "TorqueCause",
    "TorqueReading",
    "TorquesNotRead",
    "candidates",
    "diagnose",
    "identify_extended",
]

_PLACES = {
    "Candidate": "outcome.candidate_table",
    "CausePrior": "evidence.cause_sets",
    "CauseSet": "evidence.cause_sets",
    "Diagnosis": "result",
    "DiagnosisReview": "loop_review",
    "DiagnosisSettings": "settings",
    "DisturbingWrench": "outcome.disturbance",
    "Frame": "outcome.disturbance",
    "Gain": "outcome.gain",
    "Hypothesis": "search.fitted_set",
    "ProbableVerdict": "evidence.verdict",
    "Remainder": "evidence.verdict",
    "Rest": "evidence.verdict",
    "SetProbabilities": "evidence.cause_sets",
    "Status": "evidence.verdict",
    "TorqueCause": "outcome.torque_reading",
    "TorqueReading": "outcome.torque_reading",
    "TorquesNotRead": "outcome.torque_reading",
    "candidates": "candidates.cause_kind",
    "diagnose": "diagnose",
    "identify_extended": "diagnose",
}


class _Package(ModuleType):
    """A package in which `candidates` and `diagnose` stay functions once the submodules of these names are loaded."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _PLACES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> object:
    """Load a public name."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
