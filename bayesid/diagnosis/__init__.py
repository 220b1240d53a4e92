"""What the simulation gets wrong: candidates, their signatures, the probability of every set of causes, the gain."""

from bayesid.diagnosis.candidates.cause_kind import candidates
from bayesid.diagnosis.diagnose import diagnose, identify_extended
from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities
from bayesid.diagnosis.evidence.verdict import ProbableVerdict, Status
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
    "SetProbabilities",
    "Status",
    "TorqueCause",
    "TorqueReading",
    "TorquesNotRead",
    "candidates",
    "diagnose",
    "identify_extended",
]
