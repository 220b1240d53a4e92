"""What the simulation gets wrong: candidates, their signatures, the probability of every set of causes, the gain."""

from bayesid.diagnosis.candidate_effects import candidates
from bayesid.diagnosis.candidate_table import Candidate
from bayesid.diagnosis.cause_prior import CausePrior
from bayesid.diagnosis.diagnosis_run import Diagnosis, diagnose, identify_extended
from bayesid.diagnosis.disturbing_wrench import Frame, Unexplained
from bayesid.diagnosis.gain import Gain
from bayesid.diagnosis.hypothesis import Hypothesis
from bayesid.diagnosis.loop_review import DiagnosisReview
from bayesid.diagnosis.probable_verdict import ProbableVerdict
from bayesid.diagnosis.set_probabilities import CauseSet, SetProbabilities
from bayesid.diagnosis.status import Status
from bayesid.diagnosis.torque_reading import TorqueCause, TorqueReading, Unread

__all__ = [
    "Candidate",
    "CausePrior",
    "CauseSet",
    "Diagnosis",
    "DiagnosisReview",
    "Frame",
    "Gain",
    "Hypothesis",
    "ProbableVerdict",
    "SetProbabilities",
    "Status",
    "TorqueCause",
    "TorqueReading",
    "Unexplained",
    "Unread",
    "candidates",
    "diagnose",
    "identify_extended",
]
